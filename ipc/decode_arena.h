// Memory for the image libraries, which allocate and free anew for every image: taken from blocks that stay.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace farpoint::ipc {

// Hands out pieces one after the other and takes them back all at once. After the largest image has passed
// once it makes no heap call.
class DecodeArena {
 public:
  // For SIMD rows of libjpeg-turbo, which asks for 32.
  static constexpr std::size_t kAlignment = 64;

  // Allocates and touches the first block: enough for the images of most cameras.
  DecodeArena();
  // Null where there is no memory.
  [[nodiscard]] void* allocate(std::size_t bytes) noexcept;
  // Everything handed out is free again.
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
  std::size_t block_ = 0, used_ = 0;  // the present block, and what is gone of it
};

}  // namespace farpoint::ipc
