// SPDX-License-Identifier: Apache-2.0
#include "tools/import/chunk.h"

#include <bzlib.h>
#include <lz4frame.h>
#include <zstd.h>

#include <string>

namespace farpoint::tools {
namespace {

bool unpack_bz2(std::string_view packed, const Chunk& content) {
  constexpr int kFast = 0, kQuiet = 0;
  std::string source(packed);  // bzip2 takes no constant bytes
  auto size = static_cast<unsigned>(content.size);
  const int status = BZ2_bzBuffToBuffDecompress(content.bytes.get(), &size, source.data(),
                                                static_cast<unsigned>(source.size()), kFast, kQuiet);
  return status == BZ_OK && size == content.size;
}

bool unpack_lz4(std::string_view packed, const Chunk& content) {
  LZ4F_dctx* context = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) != 0) return false;
  std::size_t taken = 0, written = 0, expected = 1;  // expected: 0 at the end of the frame
  while (expected != 0) {
    std::size_t room = content.size - written, left = packed.size() - taken;
    expected =
        LZ4F_decompress(context, content.bytes.get() + written, &room, packed.data() + taken, &left, nullptr);
    if (LZ4F_isError(expected) != 0 || (room == 0 && left == 0)) break;
    written += room;
    taken += left;
  }
  LZ4F_freeDecompressionContext(context);
  return expected == 0 && written == content.size;
}

bool unpack_zstd(std::string_view packed, const Chunk& content) {
  const std::size_t size = ZSTD_decompress(content.bytes.get(), content.size, packed.data(), packed.size());
  return ZSTD_isError(size) == 0 && size == content.size;
}

}  // namespace

std::optional<Chunk> decompress(Compression compression, std::string_view packed,
                                std::uint64_t content_bytes) {
  // Uninitialised: pages that are not written take no memory.
  Chunk content{std::make_unique_for_overwrite<char[]>(content_bytes), content_bytes};
  if (content_bytes == 0) return content;
  bool good = false;
  switch (compression) {
    case Compression::kBz2:
      good = unpack_bz2(packed, content);
      break;
    case Compression::kLz4:
      good = unpack_lz4(packed, content);
      break;
    case Compression::kZstd:
      good = unpack_zstd(packed, content);
      break;
  }
  if (!good) return {};
  return content;
}

}  // namespace farpoint::tools
