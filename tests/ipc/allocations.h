// SPDX-License-Identifier: Apache-2.0
// Counts this program's heap calls, those of C libraries included.
#pragma once

#include <cstdint>

namespace farpoint::test {

// False where a sanitizer owns the heap: then allocations() stays 0.
[[nodiscard]] bool counts_allocations();
// malloc, calloc, realloc and aligned allocation so far.
[[nodiscard]] std::uint64_t allocations();
// Sets a listener for these calls, and for free and mmap, on the calling thread; null removes it. The
// listener's own calls reach it too.
void on_heap_call(void (*listener)());

}  // namespace farpoint::test
