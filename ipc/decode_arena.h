// SPDX-License-Identifier: Apache-2.0
// Memory for the image libraries, which allocate and free for every image. Blocks are kept from image to
// image.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace farpoint::ipc {

// A bump allocator: allocates in sequence, frees all at once. It makes no heap call after the first image of
// the largest size. Not thread-safe.
class DecodeArena {
 public:
  // libjpeg-turbo's SIMD rows require 32.
  static constexpr std::size_t kAlignment = 64;

  // Allocates and touches the first block: enough for the images of most cameras.
  DecodeArena();
  // Returns null without memory.
  [[nodiscard]] void* allocate(std::size_t bytes) noexcept;
  // Frees all allocations.
  void reset() noexcept {
    block_ = 0;
    used_ = 0;
  }

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
};

}  // namespace farpoint::ipc
