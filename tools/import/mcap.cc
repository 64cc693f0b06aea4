// SPDX-License-Identifier: Apache-2.0
#include "tools/import/mcap.h"

#include <map>
#include <set>
#include <string_view>

namespace farpoint::tools {
namespace {

constexpr std::string_view kMagic = "\x89MCAP0\r\n";
constexpr std::uint64_t kMaxDescriptionBytes = 4 << 20;  // of a schema or channel
constexpr std::uint64_t kRecordHeadBytes = 9;            // kind and length
constexpr std::uint64_t kMessageHeadBytes = 22;          // channel, sequence, two times
constexpr std::size_t kMaxNameBytes = 1024;
constexpr std::uint8_t kFooter = 2, kSchema = 3, kChannel = 4, kMessage = 5, kChunk = 6;

std::uint64_t little_endian(std::string_view bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = bytes.size(); i-- > 0;) value = value << 8 | static_cast<std::uint8_t>(bytes[i]);
  return value;
}

// Fields of one record, one after another.
class Fields {
 public:
  Fields(const ByteFile& file, std::uint64_t offset, std::string bytes)
      : file_(file), offset_(offset), bytes_(std::move(bytes)) {}

  std::uint64_t number(std::size_t size) { return little_endian(take(size)); }
  std::string text() {
    const std::uint64_t length = number(4);
    if (length > kMaxNameBytes) file_.fail(offset_ + at_, "a name of more than 1024 bytes");
    return std::string(take(length));
  }
  [[nodiscard]] std::uint64_t position() const { return offset_ + at_; }

 private:
  std::string_view take(std::uint64_t size) {
    if (size > bytes_.size() - at_) file_.fail(offset_ + at_, "a record's field is longer than the record");
    const std::string_view bytes{bytes_}, field = bytes.substr(at_, size);
    at_ += size;
    return field;
  }

  const ByteFile& file_;
  std::uint64_t offset_;
  std::string bytes_;
  std::size_t at_ = 0;
};

struct Record {
  std::uint8_t kind = 0;
  std::uint64_t offset = 0, data = 0, data_bytes = 0;
  [[nodiscard]] std::uint64_t end() const { return data + data_bytes; }
};

class Reader {
 public:
  Reader(const ByteFile& file, const std::function<void(const BagConnection&)>& on_connection,
         const std::function<void(const BagMessage&)>& on_message)
      : file_(file), on_connection_(on_connection), on_message_(on_message) {}

  void read_all() {
    if (file_.size() < kMagic.size() || file_.read(0, kMagic.size()) != kMagic)
      file_.fail(0, "expected an MCAP recording");
    std::uint64_t at = kMagic.size();
    while (true) {
      const Record record = record_at(at, file_.size());
      if (record.kind == kFooter) return;
      if (record.kind == kChunk) {
        read_chunk(record);
      } else {
        take(record);
      }
      at = record.end();
    }
  }

 private:
  [[nodiscard]] Record record_at(std::uint64_t at, std::uint64_t end) const {
    constexpr const char* kRepair = "; 'mcap recover' repairs a recording that was not closed";
    if (end - at < kRecordHeadBytes) file_.fail(at, std::string("cut off") + kRepair);
    const std::string head = file_.read(at, kRecordHeadBytes);
    Record record;
    record.offset = at;
    record.kind = static_cast<std::uint8_t>(head[0]);
    record.data = at + kRecordHeadBytes;
    const std::string_view behind_kind{head.data() + 1, head.size() - 1};
    record.data_bytes = little_endian(behind_kind);
    if (record.data_bytes > end - record.data)
      file_.fail(at, "a record of " + std::to_string(record.data_bytes) + " bytes, where " +
                         std::to_string(end - record.data) + " are left" + kRepair);
    return record;
  }

  [[nodiscard]] Fields fields_of(const Record& record, std::uint64_t most) const {
    return {file_, record.data, file_.read(record.data, std::min(record.data_bytes, most))};
  }

  void read_chunk(const Record& chunk) {
    constexpr std::uint64_t kHead = 8 + 8 + 8 + 4 + 4 + kMaxNameBytes + 8;
    Fields fields = fields_of(chunk, kHead);
    for (int i = 0; i < 3; ++i) (void)fields.number(8);  // times and size
    (void)fields.number(4);                              // CRC
    const std::string compression = fields.text();
    if (!compression.empty())
      file_.fail(chunk.offset, "chunks compressed by " + compression +
                                   ", expected none; 'mcap decompress FILE -o OUT' writes such a recording");
    const std::uint64_t bytes = fields.number(8);
    std::uint64_t at = fields.position();
    if (bytes > chunk.end() - at) file_.fail(at, "a chunk's records are longer than the chunk");
    const std::uint64_t end = at + bytes;
    while (at < end) {
      const Record record = record_at(at, end);
      take(record);
      at = record.end();
    }
  }

  void take(const Record& record) {
    if (record.kind == kSchema) take_schema(record);
    if (record.kind == kChannel) take_channel(record);
    if (record.kind == kMessage) take_message(record);
  }

  void require_short(const Record& record) const {
    if (record.data_bytes > kMaxDescriptionBytes)
      file_.fail(record.offset, "a schema or channel of more than 4 MiB");
  }

  void take_schema(const Record& record) {
    require_short(record);
    Fields fields = fields_of(record, kMaxDescriptionBytes);
    const std::uint64_t id = fields.number(2);
    schemas_[id] = fields.text();
  }

  // Repeated in the summary at the end.
  void take_channel(const Record& record) {
    require_short(record);
    Fields fields = fields_of(record, kMaxDescriptionBytes);
    BagConnection connection;
    connection.id = static_cast<std::uint32_t>(fields.number(2));
    if (!channels_.insert(connection.id).second) return;
    const std::uint64_t schema = fields.number(2);
    connection.topic = fields.text();
    const std::string encoding = fields.text();
    connection.type = schemas_[schema];
    const std::size_t message = connection.type.find("/msg/");  // ROS 2's names
    if (message != std::string::npos) connection.type.erase(message, 4);
    if (encoding != "cdr" && encoding != "ros1") connection.type = encoding + " " + connection.type;
    connection.packing = encoding == "cdr" ? RosPacking::kCdr : RosPacking::kRos1;
    on_connection_(connection);
  }

  void take_message(const Record& record) const {
    Fields fields = fields_of(record, kMessageHeadBytes);
    BagMessage message;
    message.connection = static_cast<std::uint32_t>(fields.number(2));
    (void)fields.number(4);  // sequence
    const std::uint64_t log_time = fields.number(8);
    (void)fields.number(8);  // time of publishing
    if (!channels_.contains(message.connection)) file_.fail(record.offset, "a message of an unknown channel");
    if (log_time > static_cast<std::uint64_t>(INT64_MAX) / 2)
      file_.fail(record.offset, "a time beyond any date");
    message.received_ns = static_cast<std::int64_t>(log_time);
    message.offset = record.data + kMessageHeadBytes;
    message.bytes = record.data_bytes - kMessageHeadBytes;
    on_message_(message);
  }

  const ByteFile& file_;
  const std::function<void(const BagConnection&)>& on_connection_;
  const std::function<void(const BagMessage&)>& on_message_;
  std::map<std::uint64_t, std::string> schemas_;
  std::set<std::uint32_t> channels_;
};

}  // namespace

void read_mcap(const ByteFile& file, const std::function<void(const BagConnection&)>& on_connection,
               const std::function<void(const BagMessage&)>& on_message) {
  Reader(file, on_connection, on_message).read_all();
}

void read_bag_file(const ByteFile& file, const std::function<void(const BagConnection&)>& on_connection,
                   const std::function<void(const BagMessage&)>& on_message) {
  const bool mcap = file.size() >= kMagic.size() && file.read(0, kMagic.size()) == kMagic;
  (mcap ? read_mcap : read_ros_bag)(file, on_connection, on_message);
}

}  // namespace farpoint::tools
