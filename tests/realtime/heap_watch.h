// SPDX-License-Identifier: Apache-2.0
// Counts this program's heap calls by thread, those of C libraries included.
#pragma once

#include <cstdint>
#include <string>

namespace farpoint::test {

// Counts from now on, from zero, where counts_allocations() (tests/ipc/allocations.h); a thread is identified
// by its name at its first call.
void watch_heap();
void stop_watching_heap();
// malloc, calloc, realloc, aligned allocation, free and mmap by threads of this name while watched.
[[nodiscard]] std::uint64_t heap_calls(const std::string& thread_name);
// Where the first of them came from, to standard error.
void print_heap_calls();

}  // namespace farpoint::test
