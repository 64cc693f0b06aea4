// SPDX-License-Identifier: Apache-2.0
#include "tools/import/bag_file.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "ipc/file_kind.h"
#include "tools/common/errors.h"
#include "tools/import/mcap.h"
#include "tools/import/ros_bag.h"
#include "tools/import/sqlite_bag.h"

namespace farpoint::tools {

std::string ChunkedBag::read(const BagPlace& place, std::uint64_t bytes) {
  if (place.part == 0) return file_.read(place.offset, bytes);
  const std::string_view content = chunk(place.part).view();
  if (place.offset > content.size() || bytes > content.size() - place.offset)
    fail(place, "cut off, expected " + std::to_string(bytes) + " bytes");
  return std::string(content.substr(place.offset, bytes));
}

void ChunkedBag::fail(const BagPlace& place, const std::string& message) const {
  if (place.part == 0) file_.fail(place.offset, message);
  file_.fail(place.part, "compressed chunk, its byte " + std::to_string(place.offset) + ": " + message);
}

std::uint64_t ChunkedBag::size_of(std::uint64_t part) {
  return part == 0 ? file_.size() : chunk(part).size;
}

Chunk ChunkedBag::unpack(Compression compression, std::uint64_t offset, std::uint64_t bytes,
                         std::uint64_t content_bytes) const {
  if (content_bytes > kMaxChunkBytes || bytes > kMaxChunkBytes)
    file_.fail(offset, "a chunk of " + std::to_string(std::max(bytes, content_bytes)) +
                           " bytes, expected at most 128 MiB");
  std::optional<Chunk> content = decompress(compression, file_.read(offset, bytes), content_bytes);
  if (!content)
    file_.fail(offset,
               "a damaged chunk, expected one that holds " + std::to_string(content_bytes) + " bytes");
  return std::move(*content);
}

const Chunk& ChunkedBag::chunk(std::uint64_t part) {
  if (held_[0].part == part) return held_[0].content;
  std::swap(held_[0], held_[1]);
  if (held_[0].part == part) return held_[0].content;
  held_[0] = {};  // its memory is free before the next takes its own
  held_[0].content = load_chunk(part);
  held_[0].part = part;
  return held_[0].content;
}

std::string without_msg(std::string type) {
  const std::size_t middle = type.find("/msg/");
  if (middle != std::string::npos) type.erase(middle, 4);
  return type;
}

std::unique_ptr<BagFile> open_bag(const std::filesystem::path& path) {
  const ByteFile file(path);
  const auto begins_with = [&](std::string_view magic) {
    return file.size() >= magic.size() && file.read(0, magic.size()) == magic;
  };
  if (begins_with(kRosBagMagic)) return std::make_unique<RosBag>(path);
  if (begins_with(kMcapMagic)) return std::make_unique<McapFile>(path);
  if (begins_with(kSqliteMagic)) return std::make_unique<SqliteBag>(path);
  const std::string wrong = ipc::wrong_kind(path.string(), "a ROS 1 or ROS 2 bag");
  if (!wrong.empty() && wrong.find("a ROS 1 bag,") == std::string::npos) throw InputError(wrong);
  throw InputError(path.string() +
                   ": expected a ROS 1 bag (it begins with #ROSBAG V2.0), an MCAP recording or a ROS 2 bag "
                   "(.db3)");
}

}  // namespace farpoint::tools
