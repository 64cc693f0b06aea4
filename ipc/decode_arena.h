// SPDX-License-Identifier: Apache-2.0
// Memory for the image libraries, which allocate and free for every image. Blocks are kept from image to
// image.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace farpoint::ipc {

// A bump allocator: allocates in sequence, frees all at once, up to a limit. It makes no heap call after the
// first image of the largest size. Not thread-safe.
class DecodeArena {
 public:
  // libjpeg-turbo's SIMD rows require 32.
  static constexpr std::size_t kAlignment = 64;

  // Allocates and touches the first block: enough for the images of most cameras.
  DecodeArena();
  // Returns null without memory, or beyond the limit.
  [[nodiscard]] void* allocate(std::size_t bytes) noexcept;
  // Frees all allocations. After an image beyond its limit the blocks go back to the heap, except the first.
  void reset() noexcept;
  // Frees all allocations and limits the next ones to `most_bytes`.
  void reset(std::size_t most_bytes) noexcept {
    reset();
    most_bytes_ = most_bytes;
  }
  // True where an allocation since the last reset was beyond the limit.
  [[nodiscard]] bool has_refused() const { return refused_; }
  // Memory of all blocks.
  [[nodiscard]] std::size_t bytes() const { return block_bytes_; }

 private:
  static constexpr std::size_t kBlockBytes = std::size_t{1} << 20;
  struct Block {
    std::unique_ptr<std::uint8_t[]> memory;
    std::uint8_t* begin = nullptr;  // aligned
    std::size_t bytes = 0;
  };
  bool add_block(std::size_t bytes) noexcept;

  std::vector<Block> blocks_;
  std::size_t block_ = 0, used_ = 0;  // the current block, and its used bytes
  std::size_t block_bytes_ = 0;
  std::size_t most_bytes_ = SIZE_MAX;
  bool refused_ = false;  // an allocation since the last reset
};

}  // namespace farpoint::ipc
