// SPDX-License-Identifier: Apache-2.0
// The container of ROS 1, bag format 2.0, with chunks that are plain or compressed by bz2 or lz4.
#pragma once

#include <map>
#include <string>
#include <string_view>

#include "tools/import/bag_file.h"

namespace farpoint::tools {

inline constexpr std::string_view kRosBagMagic = "#ROSBAG V2.0\n";

class RosBag : public ChunkedBag {
 public:
  using ChunkedBag::ChunkedBag;
  void read_all(const OnConnection& on_connection, const OnMessage& on_message) override;

 protected:
  [[nodiscard]] Chunk load_chunk(std::uint64_t part) override;

 private:
  class Walk;
  using Fields = std::map<std::string, std::string>;  // of a record's header
  // The header is parsed, the data stays where it is.
  struct Record : BagRecord {
    Fields header;
  };

  // The record at `place`, which ends before byte `end` of its part.
  [[nodiscard]] Record record_at(const BagPlace& place, std::uint64_t end);
  [[nodiscard]] Fields fields_at(const BagPlace& place, std::uint64_t bytes);
  // The length at `place`, checked to lie within its limit and before `end`.
  [[nodiscard]] std::uint64_t length_at(const BagPlace& place, std::uint64_t most, std::uint64_t end,
                                        const char* what);
  // A field of the header of exactly `bytes`, and one of 4 as a number.
  [[nodiscard]] std::string field(const Record& record, const std::string& name, std::size_t bytes) const;
  [[nodiscard]] std::uint32_t number(const Record& record, const std::string& name) const;
};

}  // namespace farpoint::tools
