// SPDX-License-Identifier: Apache-2.0
#include "ipc/decode_arena.h"

#include <algorithm>
#include <new>

namespace farpoint::ipc {

DecodeArena::DecodeArena() {
  constexpr std::size_t kMostBlocks = 64;
  blocks_.reserve(kMostBlocks);
  if (!add_block(kBlockBytes)) throw std::bad_alloc();
}

bool DecodeArena::add_block(std::size_t bytes) noexcept {
  try {
    Block block;
    block.memory = std::make_unique<std::uint8_t[]>(bytes + kAlignment);  // zeroed: touched
    const auto address = reinterpret_cast<std::uintptr_t>(block.memory.get());
    block.begin = block.memory.get() + (kAlignment - address % kAlignment) % kAlignment;
    block.bytes = bytes;
    blocks_.push_back(std::move(block));
    block_bytes_ += bytes;
    return true;
  } catch (const std::bad_alloc&) {
    return false;
  }
}

void DecodeArena::reset() noexcept {
  if (refused_) {
    blocks_.resize(1);
    block_bytes_ = blocks_.front().bytes;
  }
  refused_ = false;
  block_ = 0;
  used_ = 0;
}

void* DecodeArena::allocate(std::size_t bytes) noexcept {
  if (bytes > SIZE_MAX / 2) return nullptr;
  bytes = (std::max<std::size_t>(bytes, 1) + kAlignment - 1) / kAlignment * kAlignment;
  // A block that is too small for this piece is left as it is: sizes repeat from image to image.
  while (block_ < blocks_.size() && blocks_[block_].bytes - used_ < bytes) {
    ++block_;
    used_ = 0;
  }
  if (block_ == blocks_.size()) {
    const std::size_t wanted = std::max(bytes, kBlockBytes);
    const bool fits = block_bytes_ <= most_bytes_ && wanted <= most_bytes_ - block_bytes_;
    if (!fits || !add_block(wanted)) {
      refused_ = true;
      return nullptr;
    }
  }
  void* piece = blocks_[block_].begin + used_;
  used_ += bytes;
  return piece;
}

}  // namespace farpoint::ipc
