// SPDX-License-Identifier: Apache-2.0
#include "tests/realtime/heap_watch.h"

#include <execinfo.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstring>

#include "tests/ipc/allocations.h"

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

std::array<ThreadCount, kThreads> threads;
std::atomic<std::size_t> thread_count{0};
std::array<Trace, kTraces> traces;
std::atomic<std::size_t> trace_count{0};
thread_local ThreadCount* own = nullptr;
thread_local bool noting = false;  // what is done to note a call may call the heap itself

void note() {
  if (noting) return;
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

void watch_heap() {
  // The first backtrace() loads a library.
  void* frames[2];
  (void)backtrace(frames, 2);
  for (ThreadCount& thread : threads) thread.calls = 0;
  trace_count = 0;
  on_heap_call(&note);
}

void stop_watching_heap() {
  on_heap_call(nullptr);
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
