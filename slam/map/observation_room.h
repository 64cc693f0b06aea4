// SPDX-License-Identifier: Apache-2.0
// Memory for the landmarks' observations: allocated and touched at the start, lent in pieces of a few sizes,
// and reused. More comes from the heap once all of it is lent.
#pragma once

#include <cstddef>
#include <memory_resource>
#include <vector>

#include "slam/map/landmark.h"

namespace farpoint::slam {

// One block, lent from its beginning to its end, once. Requests beyond its end go to the heap.
class BlockThenHeap final : public std::pmr::memory_resource {
 public:
  explicit BlockThenHeap(std::size_t bytes) : block_(bytes) {}  // zeroed, hence touched

  [[nodiscard]] std::size_t bytes() const { return block_.size(); }
  [[nodiscard]] std::size_t heap_bytes() const { return heap_bytes_; }  // lent now

 private:
  void* do_allocate(std::size_t bytes, std::size_t alignment) override;
  void do_deallocate(void* memory, std::size_t bytes, std::size_t alignment) override;
  [[nodiscard]] bool do_is_equal(const memory_resource& other) const noexcept override {
    return this == &other;
  }

  std::vector<std::byte> block_;
  std::size_t given_ = 0, heap_bytes_ = 0;
};

class ObservationRoom {
 public:
  // `observations`: of all lists together. `longest_list`: most of one list.
  ObservationRoom(std::size_t observations, std::size_t longest_list)
      : whole_(observations * sizeof(Observation)),
        pieces_({kPiecesAtOnce, longest_list * sizeof(Observation)}, &whole_) {}

  [[nodiscard]] std::pmr::memory_resource* resource() { return &pieces_; }
  [[nodiscard]] std::size_t bytes() const { return whole_.bytes(); }
  [[nodiscard]] std::size_t heap_bytes() const { return whole_.heap_bytes(); }

 private:
  // Pieces of one size that are allocated together: few, so that none stays unused for long.
  static constexpr std::size_t kPiecesAtOnce = 64;

  BlockThenHeap whole_;
  std::pmr::unsynchronized_pool_resource pieces_;
};

}  // namespace farpoint::slam
