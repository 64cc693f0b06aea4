// Counts this program's heap calls, those of C libraries included.
#pragma once

#include <cstdint>

namespace farpoint::test {

// False where a sanitizer owns the heap: then allocations() stays 0.
[[nodiscard]] bool counts_allocations();
// malloc, calloc, realloc and aligned allocation so far.
[[nodiscard]] std::uint64_t allocations();
// Told of each of them from now on, and of free and mmap, by the thread that calls; null: nobody is. What it
// calls itself it is told of too.
void on_heap_call(void (*listener)());

}  // namespace farpoint::test
