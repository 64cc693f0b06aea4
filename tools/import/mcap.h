// SPDX-License-Identifier: Apache-2.0
// The container MCAP, as ROS 2 records it, with chunks that are plain or compressed by lz4 or zstd.
#pragma once

#include <string_view>

#include "tools/import/bag_file.h"

namespace farpoint::tools {

inline constexpr std::string_view kMcapMagic = "\x89MCAP0\r\n";

// A channel is a connection.
class McapFile : public ChunkedBag {
 public:
  using ChunkedBag::ChunkedBag;
  void read_all(const OnConnection& on_connection, const OnMessage& on_message) override;

 protected:
  [[nodiscard]] Chunk load_chunk(std::uint64_t part) override;

 private:
  class Fields;
  class Walk;
  struct Record : BagRecord {
    std::uint8_t kind = 0;
  };
  struct ChunkHead {
    std::string compression;              // empty: none
    std::uint64_t content_bytes = 0;      // decompressed
    std::uint64_t offset = 0, bytes = 0;  // of its records in the file, as they are stored
  };

  // The record at `place`, which ends before byte `end` of its part.
  [[nodiscard]] Record record_at(const BagPlace& place, std::uint64_t end);
  // The first bytes of a record's data, at most `most`.
  [[nodiscard]] Fields fields_of(const Record& record, std::uint64_t most);
  [[nodiscard]] ChunkHead chunk_head_of(const Record& record);
};

}  // namespace farpoint::tools
