// SPDX-License-Identifier: Apache-2.0
// Compressed chunks of recordings: bz2 and lz4 of ROS 1 bags, lz4 and zstd of MCAP. Both lz4 are LZ4's frame
// format.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>

namespace farpoint::tools {

// Longer chunks are refused before memory is taken.
inline constexpr std::uint64_t kMaxChunkBytes = std::uint64_t{128} << 20;

enum class Compression : std::uint8_t { kBz2, kLz4, kZstd };

// Content of a chunk. Moved, never copied.
struct Chunk {
  std::unique_ptr<char[]> bytes;
  std::size_t size = 0;
  [[nodiscard]] std::string_view view() const { return {bytes.get(), size}; }
};

// Empty where `packed` is damaged or holds another number of bytes than `content_bytes`. Takes memory for the
// content and at most 16 MiB more. Precondition: content_bytes is at most kMaxChunkBytes.
[[nodiscard]] std::optional<Chunk> decompress(Compression compression, std::string_view packed,
                                              std::uint64_t content_bytes);

}  // namespace farpoint::tools
