#include "tests/ipc/allocations.h"

#include <atomic>
#include <cerrno>
#include <cstddef>

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && defined(__GLIBC__)
#define FARPOINT_COUNTS_ALLOCATIONS 1
#else
#define FARPOINT_COUNTS_ALLOCATIONS 0
#endif

namespace {
std::atomic<std::uint64_t> calls{0};
}

namespace farpoint::test {
bool counts_allocations() {
  return FARPOINT_COUNTS_ALLOCATIONS != 0;
}
std::uint64_t allocations() {
  return calls.load();
}
}  // namespace farpoint::test

#if FARPOINT_COUNTS_ALLOCATIONS
// The program's own functions, by glibc's names, go before glibc's for every library in the process.
// NOLINTBEGIN(readability-identifier-naming,readability-inconsistent-declaration-parameter-name)
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* block, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) noexcept {
  ++calls;
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) noexcept {
  ++calls;
  return __libc_calloc(count, size);
}
void* realloc(void* block, std::size_t size) noexcept {
  ++calls;
  return __libc_realloc(block, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  ++calls;
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** block, std::size_t alignment, std::size_t size) noexcept {
  ++calls;
  *block = __libc_memalign(alignment, size);
  return *block == nullptr ? ENOMEM : 0;
}
}
// NOLINTEND(readability-identifier-naming,readability-inconsistent-declaration-parameter-name)
#endif
