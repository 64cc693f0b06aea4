#include "tests/realtime/heap_watch.h"

#include <execinfo.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <cstring>

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && defined(__GLIBC__)
#define FARPOINT_WATCHES_HEAP 1
#else
#define FARPOINT_WATCHES_HEAP 0
#endif

namespace {

constexpr std::size_t kNameBytes = 16, kThreads = 64, kTraces = 12, kTraceDepth = 24;

struct ThreadCount {
  char name[kNameBytes] = {};
  std::atomic<std::uint64_t> calls{0};
};
struct Trace {
  char name[kNameBytes] = {};
  int depth = 0;
  void* frames[kTraceDepth] = {};
};

std::atomic<bool> watching{false};
std::array<ThreadCount, kThreads> threads;
std::atomic<std::size_t> thread_count{0};
std::array<Trace, kTraces> traces;
std::atomic<std::size_t> trace_count{0};
thread_local ThreadCount* own = nullptr;
thread_local bool noting = false;  // what is done to note a call may call the heap itself

[[maybe_unused]] void note() {
  if (!watching.load(std::memory_order_relaxed) || noting) return;
  noting = true;
  if (own == nullptr) {
    const std::size_t index = thread_count.fetch_add(1);
    own = &threads[index < kThreads ? index : kThreads - 1];
    prctl(PR_GET_NAME, own->name);
  }
  own->calls.fetch_add(1);
  // Of the threads that must not; mapping and the main thread may.
  if (std::strncmp(own->name, "fp-", 3) == 0 && std::strcmp(own->name, "fp-mapping") != 0) {
    const std::size_t index = trace_count.fetch_add(1);
    if (index < kTraces) {
      std::memcpy(traces[index].name, own->name, kNameBytes);
      traces[index].depth = backtrace(traces[index].frames, static_cast<int>(kTraceDepth));
    }
  }
  noting = false;
}

}  // namespace

namespace farpoint::test {

bool heap_is_watched() {
  return FARPOINT_WATCHES_HEAP != 0;
}

void watch_heap() {
  // The first backtrace() loads a library.
  void* frames[2];
  (void)backtrace(frames, 2);
  for (ThreadCount& thread : threads) thread.calls = 0;
  trace_count = 0;
  watching = true;
}

void stop_watching_heap() {
  watching = false;
}

std::uint64_t heap_calls(const std::string& thread_name) {
  std::uint64_t sum = 0;
  for (const ThreadCount& thread : threads)
    if (thread_name == thread.name) sum += thread.calls;
  return sum;
}

void print_heap_calls() {
  for (std::size_t i = 0; i < std::min(kTraces, trace_count.load()); ++i) {
    dprintf(STDERR_FILENO, "heap call on %s:\n", traces[i].name);
    backtrace_symbols_fd(traces[i].frames, traces[i].depth, STDERR_FILENO);
  }
}

}  // namespace farpoint::test

#if FARPOINT_WATCHES_HEAP
// The program's own functions, by glibc's names, go before glibc's for every library in the process.
// NOLINTBEGIN(readability-identifier-naming,readability-inconsistent-declaration-parameter-name)
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* block, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* block);

void* malloc(std::size_t size) noexcept {
  note();
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) noexcept {
  note();
  return __libc_calloc(count, size);
}
void* realloc(void* block, std::size_t size) noexcept {
  note();
  return __libc_realloc(block, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  note();
  return __libc_memalign(alignment, size);
}
void* memalign(std::size_t alignment, std::size_t size) noexcept {
  note();
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** block, std::size_t alignment, std::size_t size) noexcept {
  note();
  *block = __libc_memalign(alignment, size);
  return *block == nullptr ? ENOMEM : 0;
}
void free(void* block) noexcept {
  if (block != nullptr) note();
  __libc_free(block);
}
void* mmap(void* address, std::size_t length, int protection, int flags, int fd, off_t offset) noexcept {
  note();
  return reinterpret_cast<void*>(syscall(SYS_mmap, address, length, protection, flags, fd, offset));
}
}
// NOLINTEND(readability-identifier-naming,readability-inconsistent-declaration-parameter-name)
#endif
