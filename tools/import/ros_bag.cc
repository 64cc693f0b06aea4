// SPDX-License-Identifier: Apache-2.0
#include "tools/import/ros_bag.h"

#include <map>
#include <optional>
#include <set>
#include <string_view>

#include "ipc/file_kind.h"
#include "tools/common/errors.h"

namespace farpoint::tools {
namespace {

constexpr std::string_view kMagic = "#ROSBAG V2.0\n";
constexpr std::uint64_t kMaxHeaderBytes = 64 << 10;     // of a record
constexpr std::uint64_t kMaxDefinitionBytes = 4 << 20;  // of a connection, with its message definition
constexpr std::size_t kMaxConnections = 10'000;
constexpr std::size_t kMaxNameBytes = 1024;
constexpr std::uint8_t kMessage = 2, kBagHeader = 3, kIndex = 4, kChunk = 5, kChunkInfo = 6, kConnection = 7;

using Fields = std::map<std::string, std::string>;

// Fields of a record's header: length, name=value.
Fields fields_of(const ByteFile& file, std::uint64_t offset, const std::string& bytes) {
  Fields fields;
  std::size_t at = 0;
  while (at < bytes.size()) {
    if (bytes.size() - at < 4) file.fail(offset + at, "a header's field is cut off");
    std::uint32_t length = 0;
    for (std::size_t i = 4; i-- > 0;) length = length << 8 | static_cast<std::uint8_t>(bytes[at + i]);
    at += 4;
    if (length > bytes.size() - at) file.fail(offset + at, "a header's field is longer than the header");
    const std::string field = bytes.substr(at, length);
    const std::size_t equals = field.find('=');
    if (equals == std::string::npos) file.fail(offset + at, "expected name=value in a header");
    fields[field.substr(0, equals)] = field.substr(equals + 1);
    at += length;
  }
  return fields;
}

// One record. `header` is parsed, the data stays in the file.
struct Record {
  Fields header;
  std::uint64_t offset = 0;  // of the record
  std::uint64_t data = 0, data_bytes = 0;
  [[nodiscard]] std::uint64_t end() const { return data + data_bytes; }
};

class Reader {
 public:
  Reader(const ByteFile& file, const std::function<void(const BagConnection&)>& on_connection,
         const std::function<void(const BagMessage&)>& on_message)
      : file_(file), on_connection_(on_connection), on_message_(on_message) {}

  void read_all() {
    if (file_.size() < kMagic.size() || file_.read(0, kMagic.size()) != kMagic) refuse_kind();
    std::uint64_t at = kMagic.size();
    while (at < file_.size()) {
      const Record record = record_at(at, file_.size());
      if (op_of(record) == kChunk) {
        read_chunk(record);
      } else {
        take(record);
      }
      at = record.end();
    }
  }

 private:
  [[noreturn]] void refuse_kind() const {
    const std::string wrong = ipc::wrong_kind(file_.path().string(), "a ROS 1 bag or an MCAP recording");
    if (!wrong.empty() && wrong.find("a ROS 1 bag,") == std::string::npos) throw InputError(wrong);
    throw InputError(file_.path().string() +
                     ": expected a ROS 1 bag (it begins with #ROSBAG V2.0) or an MCAP recording");
  }

  [[nodiscard]] Record record_at(std::uint64_t at, std::uint64_t end) const {
    Record record;
    record.offset = at;
    const std::uint64_t header = require_length(at, kMaxHeaderBytes, end, "header");
    record.header = fields_of(file_, at + 4, file_.read(at + 4, header));
    const std::uint64_t data_at = at + 4 + header;
    record.data_bytes = require_length(data_at, UINT32_MAX, end, "data");
    record.data = data_at + 4;
    return record;
  }

  // The length at `at`, checked to lie within its limit and what contains it.
  [[nodiscard]] std::uint64_t require_length(std::uint64_t at, std::uint64_t most, std::uint64_t end,
                                             const char* what) const {
    if (end - at < 4) file_.fail(at, "cut off; 'rosbag reindex' repairs a bag that was not closed");
    const std::uint64_t length = file_.read_u32(at);
    if (length > most)
      file_.fail(at, std::string("a record's ") + what + " of " + std::to_string(length) +
                         " bytes, expected at most " + std::to_string(most));
    if (length > end - at - 4)
      file_.fail(at, std::string("a record's ") + what + " of " + std::to_string(length) + " bytes, where " +
                         std::to_string(end - at - 4) +
                         " are left; 'rosbag reindex' repairs a bag that was not closed");
    return length;
  }

  [[nodiscard]] std::string field(const Record& record, const std::string& name, std::size_t bytes) const {
    const auto found = record.header.find(name);
    if (found == record.header.end() || found->second.size() != bytes)
      file_.fail(record.offset, "expected a record with the field '" + name + "'");
    return found->second;
  }

  [[nodiscard]] std::uint32_t number(const Record& record, const std::string& name) const {
    const std::string bytes = field(record, name, 4);
    std::uint32_t value = 0;
    for (std::size_t i = 4; i-- > 0;) value = value << 8 | static_cast<std::uint8_t>(bytes[i]);
    return value;
  }

  [[nodiscard]] std::uint8_t op_of(const Record& record) const {
    return static_cast<std::uint8_t>(field(record, "op", 1)[0]);
  }

  void read_chunk(const Record& chunk) {
    const auto found = chunk.header.find("compression");
    const std::string compression = found != chunk.header.end() ? found->second : "";
    if (compression != "none") {
      const bool known = compression == "bz2" || compression == "lz4";
      file_.fail(chunk.offset,
                 (known ? "chunks compressed by " + compression : "chunks of an unknown compression") +
                     ", expected none; 'rosbag decompress FILE' writes such a bag");
    }
    std::uint64_t at = chunk.data;
    while (at < chunk.end()) {
      const Record record = record_at(at, chunk.end());
      take(record);
      at = record.end();
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
        file_.fail(record.offset, "a record of an unknown kind");
    }
  }

  void take_message(const Record& record) const {
    BagMessage message;
    message.connection = number(record, "conn");
    if (!known_.contains(message.connection)) file_.fail(record.offset, "a message of an unknown connection");
    const std::string time = field(record, "time", 8);
    std::uint64_t seconds = 0, nanoseconds = 0;
    for (std::size_t i = 4; i-- > 0;) {
      seconds = seconds << 8 | static_cast<std::uint8_t>(time[i]);
      nanoseconds = nanoseconds << 8 | static_cast<std::uint8_t>(time[4 + i]);
    }
    message.received_ns = static_cast<std::int64_t>(seconds * 1'000'000'000 + nanoseconds);
    message.offset = record.data;
    message.bytes = record.data_bytes;
    on_message_(message);
  }

  // Written twice: in the chunk that uses it first, and at the end.
  void take_connection(const Record& record) {
    BagConnection connection;
    connection.id = number(record, "conn");
    if (!known_.insert(connection.id).second) return;
    if (known_.size() > kMaxConnections) file_.fail(record.offset, "more than 10000 connections");
    if (record.data_bytes > kMaxDefinitionBytes) file_.fail(record.data, "a connection of more than 4 MiB");
    const auto topic = record.header.find("topic");
    const Fields details = fields_of(file_, record.data, file_.read(record.data, record.data_bytes));
    const auto type = details.find("type");
    if (topic == record.header.end() || type == details.end() || topic->second.size() > kMaxNameBytes ||
        type->second.size() > kMaxNameBytes)
      file_.fail(record.offset, "expected a connection with topic and type");
    connection.topic = topic->second;
    connection.type = type->second;
    on_connection_(connection);
  }

  const ByteFile& file_;
  const std::function<void(const BagConnection&)>& on_connection_;
  const std::function<void(const BagMessage&)>& on_message_;
  std::set<std::uint32_t> known_;
};

}  // namespace

void read_ros_bag(const ByteFile& file, const std::function<void(const BagConnection&)>& on_connection,
                  const std::function<void(const BagMessage&)>& on_message) {
  Reader(file, on_connection, on_message).read_all();
}

}  // namespace farpoint::tools
