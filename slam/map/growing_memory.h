// SPDX-License-Identifier: Apache-2.0
// Memory for lists that grow through a whole run (std::pmr::deque): in slabs of their own. Block by block
// from the heap they would lie between what comes and goes there, and keep its holes from ever closing.
#pragma once

#include <cstddef>
#include <memory_resource>

namespace farpoint::slam {

class GrowingMemory {
 public:
  [[nodiscard]] std::pmr::memory_resource* resource() { return &slabs_; }

 private:
  // A deque's blocks have 512 bytes; so many of them at once, in the end: 256 kB.
  static constexpr std::size_t kBlock_bytes = 512, kBlocksAtOnce = 512;
  std::pmr::unsynchronized_pool_resource slabs_{{kBlocksAtOnce, kBlock_bytes}};
};

}  // namespace farpoint::slam
