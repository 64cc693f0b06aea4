// SPDX-License-Identifier: Apache-2.0
#include "slam/map/observation_room.h"

#include <functional>
#include <memory>

namespace farpoint::slam {

void* BlockThenHeap::do_allocate(std::size_t bytes, std::size_t alignment) {
  void* next = block_.data() + given_;
  std::size_t left = block_.size() - given_;
  if (block_.empty() || std::align(alignment, bytes, next, left) == nullptr) {
    void* memory = std::pmr::new_delete_resource()->allocate(bytes, alignment);
    heap_bytes_ += bytes;
    return memory;
  }
  given_ = block_.size() - left + bytes;
  return next;
}

void BlockThenHeap::do_deallocate(void* memory, std::size_t bytes, std::size_t alignment) {
  const std::byte* piece = static_cast<const std::byte*>(memory);
  const std::byte* end = block_.data() + block_.size();
  if (!block_.empty() && !std::less<>{}(piece, block_.data()) && std::less<>{}(piece, end)) return;
  heap_bytes_ -= bytes;
  std::pmr::new_delete_resource()->deallocate(memory, bytes, alignment);
}

}  // namespace farpoint::slam
