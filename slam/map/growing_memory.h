// SPDX-License-Identifier: Apache-2.0
// Memory for lists that grow through a whole run (std::pmr::deque): in slabs of their own. Single blocks
// from the heap would fragment it.
#pragma once

#include <cstddef>
#include <memory_resource>

namespace farpoint::slam {

class GrowingMemory {
 public:
  [[nodiscard]] std::pmr::memory_resource* resource() { return &slabs_; }

 private:
  // A deque's block, and the blocks of the largest slab (256 kB).
  static constexpr std::size_t kBlock_bytes = 512, kBlocksAtOnce = 512;
  std::pmr::unsynchronized_pool_resource slabs_{{kBlocksAtOnce, kBlock_bytes}};
};

}  // namespace farpoint::slam
