// SPDX-License-Identifier: Apache-2.0
#include "tests/ipc/allocations.h"

#include <sys/mman.h>
#include <sys/syscall.h>
#include <unistd.h>

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
std::atomic<void (*)()> heap_listener{nullptr};
}  // namespace

namespace farpoint::test {
bool counts_allocations() {
  return FARPOINT_COUNTS_ALLOCATIONS != 0;
}
std::uint64_t allocations() {
  return calls.load();
}
void on_heap_call(void (*listener)()) {
  heap_listener = listener;
}
}  // namespace farpoint::test

#if FARPOINT_COUNTS_ALLOCATIONS
namespace {
void note_call() {
  if (auto* const listener = heap_listener.load(std::memory_order_relaxed)) listener();
}
void note_allocation() {
  ++calls;
  note_call();
}
}  // namespace

// The program's own functions, by glibc's names, go before glibc's for every library in the process.
// NOLINTBEGIN(readability-identifier-naming,readability-inconsistent-declaration-parameter-name)
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* block, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* block);

void* malloc(std::size_t size) noexcept {
  note_allocation();
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) noexcept {
  note_allocation();
  return __libc_calloc(count, size);
}
void* realloc(void* block, std::size_t size) noexcept {
  note_allocation();
  return __libc_realloc(block, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  note_allocation();
  return __libc_memalign(alignment, size);
}
void* memalign(std::size_t alignment, std::size_t size) noexcept {
  note_allocation();
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** block, std::size_t alignment, std::size_t size) noexcept {
  note_allocation();
  *block = __libc_memalign(alignment, size);
  return *block == nullptr ? ENOMEM : 0;
}
void free(void* block) noexcept {
  if (block != nullptr) note_call();
  __libc_free(block);
}
void* mmap(void* address, std::size_t length, int protection, int flags, int fd, off_t offset) noexcept {
  note_call();
  return reinterpret_cast<void*>(syscall(SYS_mmap, address, length, protection, flags, fd, offset));
}
}
// NOLINTEND(readability-identifier-naming,readability-inconsistent-declaration-parameter-name)
#endif
