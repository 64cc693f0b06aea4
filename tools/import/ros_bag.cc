// SPDX-License-Identifier: Apache-2.0
#include "tools/import/ros_bag.h"

#include <set>

namespace farpoint::tools {
namespace {

constexpr std::uint64_t kMaxHeaderBytes = 64 << 10;     // of a record
constexpr std::uint64_t kMaxDefinitionBytes = 4 << 20;  // of a connection, with its message definition
constexpr std::size_t kMaxConnections = 10'000;
constexpr std::size_t kMaxNameBytes = 1024;
constexpr std::uint8_t kMessage = 2, kBagHeader = 3, kIndex = 4, kChunk = 5, kChunkInfo = 6, kConnection = 7;

std::uint64_t little_endian(std::string_view bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = bytes.size(); i-- > 0;) value = value << 8 | static_cast<std::uint8_t>(bytes[i]);
  return value;
}

}  // namespace

// ---- records ----

RosBag::Fields RosBag::fields_at(const BagPlace& place, std::uint64_t bytes) {
  constexpr std::size_t kLengthBytes = 4;
  const std::string header = read(place, bytes);
  const std::string_view text(header);
  Fields fields;
  for (std::size_t at = 0; at < text.size();) {
    const BagPlace here{place.part, place.offset + at};
    if (text.size() - at < kLengthBytes) fail(here, "a header's field is cut off");
    const std::uint64_t length = little_endian(text.substr(at, kLengthBytes));
    at += kLengthBytes;
    if (length > text.size() - at) fail(here, "a header's field is longer than the header");
    const std::string_view field = text.substr(at, length);
    const std::size_t equals = field.find('=');
    if (equals == std::string_view::npos) fail(here, "expected name=value in a header");
    fields[std::string(field.substr(0, equals))] = field.substr(equals + 1);
    at += length;
  }
  return fields;
}

std::uint64_t RosBag::length_at(const BagPlace& place, std::uint64_t most, std::uint64_t end,
                                const char* what) {
  constexpr std::uint64_t kLengthBytes = 4;
  constexpr const char* kRepair = "; 'rosbag reindex' repairs a bag that was not closed";
  if (end - place.offset < kLengthBytes) fail(place, std::string("cut off") + kRepair);
  const std::uint64_t length = little_endian(read(place, kLengthBytes));
  if (length > most)
    fail(place, std::string("a record's ") + what + " of " + std::to_string(length) +
                    " bytes, expected at most " + std::to_string(most));
  const std::uint64_t left = end - place.offset - kLengthBytes;
  if (length > left)
    fail(place, std::string("a record's ") + what + " of " + std::to_string(length) + " bytes, where " +
                    std::to_string(left) + " are left" + kRepair);
  return length;
}

RosBag::Record RosBag::record_at(const BagPlace& place, std::uint64_t end) {
  Record record;
  record.place = place;
  const std::uint64_t header = length_at(place, kMaxHeaderBytes, end, "header");
  record.header = fields_at({place.part, place.offset + 4}, header);
  const BagPlace behind{place.part, place.offset + 4 + header};
  record.data_bytes = length_at(behind, UINT32_MAX, end, "data");
  record.data = {place.part, behind.offset + 4};
  return record;
}

std::string RosBag::field(const Record& record, const std::string& name, std::size_t bytes) const {
  const auto found = record.header.find(name);
  if (found == record.header.end() || found->second.size() != bytes)
    fail(record.place, "expected a record with the field '" + name + "'");
  return found->second;
}

std::uint32_t RosBag::number(const Record& record, const std::string& name) const {
  return static_cast<std::uint32_t>(little_endian(field(record, name, 4)));
}

Chunk RosBag::load_chunk(std::uint64_t part) {
  Record record = record_at({0, part}, file().size());
  const std::string& name = record.header["compression"];
  const Compression compression = name == "bz2" ? Compression::kBz2 : Compression::kLz4;
  return unpack(compression, record.data.offset, record.data_bytes, number(record, "size"));
}

// ---- one walk through the bag ----

class RosBag::Walk {
 public:
  Walk(RosBag* bag, const OnConnection& on_connection, const OnMessage& on_message)
      : bag_(*bag), on_connection_(on_connection), on_message_(on_message) {}

  void read_all() {
    for (std::uint64_t at = kRosBagMagic.size(); at < bag_.file().size();) {
      const Record record = bag_.record_at({0, at}, bag_.file().size());
      if (op_of(record) == kChunk) {
        read_chunk(record);
      } else {
        take(record);
      }
      at = record.end();
    }
  }

 private:
  [[nodiscard]] std::uint8_t op_of(const Record& record) const {
    return static_cast<std::uint8_t>(bag_.field(record, "op", 1)[0]);
  }

  void read_chunk(const Record& chunk) {
    const auto found = chunk.header.find("compression");
    const std::string compression = found != chunk.header.end() ? found->second : "";
    if (compression == "none") return read_records(chunk.data, chunk.end());
    if (compression != "bz2" && compression != "lz4")
      bag_.fail(chunk.place, "chunks of an unknown compression, expected none, bz2 or lz4");
    const std::uint64_t part = chunk.place.offset;
    read_records({part, 0}, bag_.size_of(part));
  }

  void read_records(BagPlace at, std::uint64_t end) {
    while (at.offset < end) {
      const Record record = bag_.record_at(at, end);
      take(record);
      at.offset = record.end();
    }
  }

  void take(const Record& record) {
    switch (op_of(record)) {
      case kMessage:
        return take_message(record);
      case kConnection:
        return take_connection(record);
      case kBagHeader:
      case kIndex:
      case kChunkInfo:
        return;
      default:
        bag_.fail(record.place, "a record of an unknown kind");
    }
  }

  void take_message(const Record& record) const {
    BagMessage message;
    message.connection = bag_.number(record, "conn");
    if (!known_.contains(message.connection)) bag_.fail(record.place, "a message of an unknown connection");
    const std::string time = bag_.field(record, "time", 8);
    const std::uint64_t seconds = little_endian(time.substr(0, 4)), rest = little_endian(time.substr(4));
    message.received_ns = static_cast<std::int64_t>(seconds * 1'000'000'000 + rest);
    message.place = record.data;
    message.bytes = record.data_bytes;
    on_message_(message);
  }

  // Written twice: in the chunk that uses it first, and at the end.
  void take_connection(const Record& record) {
    BagConnection connection;
    connection.id = bag_.number(record, "conn");
    if (!known_.insert(connection.id).second) return;
    if (known_.size() > kMaxConnections) bag_.fail(record.place, "more than 10000 connections");
    if (record.data_bytes > kMaxDefinitionBytes) bag_.fail(record.data, "a connection of more than 4 MiB");
    const auto topic = record.header.find("topic");
    const Fields details = bag_.fields_at(record.data, record.data_bytes);
    const auto type = details.find("type");
    if (topic == record.header.end() || type == details.end() || topic->second.size() > kMaxNameBytes ||
        type->second.size() > kMaxNameBytes)
      bag_.fail(record.place, "expected a connection with topic and type");
    connection.topic = topic->second;
    connection.type = type->second;
    on_connection_(connection);
  }

  RosBag& bag_;
  const OnConnection& on_connection_;
  const OnMessage& on_message_;
  std::set<std::uint32_t> known_;
};

void RosBag::read_all(const OnConnection& on_connection, const OnMessage& on_message) {
  Walk(this, on_connection, on_message).read_all();
}

}  // namespace farpoint::tools
