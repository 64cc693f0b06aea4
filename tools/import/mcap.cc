// SPDX-License-Identifier: Apache-2.0
#include "tools/import/mcap.h"

#include <algorithm>
#include <map>
#include <set>

namespace farpoint::tools {
namespace {

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

}  // namespace

// ---- records ----

// Fields of one record, one after another.
class McapFile::Fields {
 public:
  Fields(const McapFile& file, const BagPlace& place, std::string bytes)
      : file_(file), place_(place), bytes_(std::move(bytes)) {}

  std::uint64_t number(std::size_t size) { return little_endian(take(size)); }
  std::string text() {
    const std::uint64_t length = number(4);
    if (length > kMaxNameBytes) file_.fail(place(), "a name of more than 1024 bytes");
    return std::string(take(length));
  }
  [[nodiscard]] BagPlace place() const { return {place_.part, place_.offset + at_}; }

 private:
  std::string_view take(std::uint64_t size) {
    if (size > bytes_.size() - at_) file_.fail(place(), "a record's field is longer than the record");
    const std::string_view bytes{bytes_}, field = bytes.substr(at_, size);
    at_ += size;
    return field;
  }

  const McapFile& file_;
  BagPlace place_;
  std::string bytes_;
  std::size_t at_ = 0;
};

McapFile::Record McapFile::record_at(const BagPlace& place, std::uint64_t end) {
  constexpr const char* kRepair = "; 'mcap recover' repairs a recording that was not closed";
  if (end - place.offset < kRecordHeadBytes) fail(place, std::string("cut off") + kRepair);
  const std::string head = read(place, kRecordHeadBytes);
  Record record;
  record.place = place;
  record.kind = static_cast<std::uint8_t>(head[0]);
  record.data = {place.part, place.offset + kRecordHeadBytes};
  const std::string_view behind_kind{head.data() + 1, head.size() - 1};
  record.data_bytes = little_endian(behind_kind);
  const std::uint64_t left = end - record.data.offset;
  if (record.data_bytes > left)
    fail(place, "a record of " + std::to_string(record.data_bytes) + " bytes, where " + std::to_string(left) +
                    " are left" + kRepair);
  return record;
}

McapFile::Fields McapFile::fields_of(const Record& record, std::uint64_t most) {
  return {*this, record.data, read(record.data, std::min(record.data_bytes, most))};
}

McapFile::ChunkHead McapFile::chunk_head_of(const Record& record) {
  constexpr std::uint64_t kMostBytes = 8 + 8 + 8 + 4 + 4 + kMaxNameBytes + 8;
  Fields fields = fields_of(record, kMostBytes);
  ChunkHead head;
  for (int i = 0; i < 2; ++i) (void)fields.number(8);  // times of the first and last message
  head.content_bytes = fields.number(8);
  (void)fields.number(4);  // CRC
  head.compression = fields.text();
  head.bytes = fields.number(8);
  head.offset = fields.place().offset;
  if (head.bytes > record.end() - head.offset)
    fail(fields.place(), "a chunk's records are longer than the chunk");
  return head;
}

Chunk McapFile::load_chunk(std::uint64_t part) {
  const ChunkHead head = chunk_head_of(record_at({0, part}, file().size()));
  const Compression compression = head.compression == "lz4" ? Compression::kLz4 : Compression::kZstd;
  return unpack(compression, head.offset, head.bytes, head.content_bytes);
}

// ---- one walk through the recording ----

class McapFile::Walk {
 public:
  Walk(McapFile* file, const OnConnection& on_connection, const OnMessage& on_message)
      : file_(*file), on_connection_(on_connection), on_message_(on_message) {}

  void read_all() {
    std::uint64_t at = kMcapMagic.size();
    while (true) {
      const Record record = file_.record_at({0, at}, file_.file().size());
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
  void read_chunk(const Record& chunk) {
    const ChunkHead head = file_.chunk_head_of(chunk);
    if (head.compression.empty()) return read_records({0, head.offset}, head.offset + head.bytes);
    if (head.compression != "lz4" && head.compression != "zstd")
      file_.fail(chunk.place, "chunks of an unknown compression, expected none, lz4 or zstd");
    const std::uint64_t part = chunk.place.offset;
    read_records({part, 0}, file_.size_of(part));
  }

  void read_records(BagPlace at, std::uint64_t end) {
    while (at.offset < end) {
      const Record record = file_.record_at(at, end);
      take(record);
      at.offset = record.end();
    }
  }

  void take(const Record& record) {
    if (record.kind == kSchema) take_schema(record);
    if (record.kind == kChannel) take_channel(record);
    if (record.kind == kMessage) take_message(record);
  }

  void require_short(const Record& record) const {
    if (record.data_bytes > kMaxDescriptionBytes)
      file_.fail(record.place, "a schema or channel of more than 4 MiB");
  }

  void take_schema(const Record& record) {
    require_short(record);
    Fields fields = file_.fields_of(record, kMaxDescriptionBytes);
    const std::uint64_t id = fields.number(2);
    schemas_[id] = fields.text();
  }

  // Repeated in the summary at the end.
  void take_channel(const Record& record) {
    require_short(record);
    Fields fields = file_.fields_of(record, kMaxDescriptionBytes);
    BagConnection connection;
    connection.id = static_cast<std::uint32_t>(fields.number(2));
    if (!channels_.insert(connection.id).second) return;
    const std::uint64_t schema = fields.number(2);
    connection.topic = fields.text();
    const std::string encoding = fields.text();
    connection.type = without_msg(schemas_[schema]);
    if (encoding != "cdr" && encoding != "ros1") connection.type = encoding + " " + connection.type;
    connection.packing = encoding == "cdr" ? RosPacking::kCdr : RosPacking::kRos1;
    on_connection_(connection);
  }

  void take_message(const Record& record) const {
    Fields fields = file_.fields_of(record, kMessageHeadBytes);
    BagMessage message;
    message.connection = static_cast<std::uint32_t>(fields.number(2));
    (void)fields.number(4);  // sequence
    const std::uint64_t log_time = fields.number(8);
    (void)fields.number(8);  // time of publishing
    if (!channels_.contains(message.connection)) file_.fail(record.place, "a message of an unknown channel");
    if (log_time > static_cast<std::uint64_t>(INT64_MAX) / 2)
      file_.fail(record.place, "a time beyond any date");
    message.received_ns = static_cast<std::int64_t>(log_time);
    message.place = {record.data.part, record.data.offset + kMessageHeadBytes};
    message.bytes = record.data_bytes - kMessageHeadBytes;
    on_message_(message);
  }

  McapFile& file_;
  const OnConnection& on_connection_;
  const OnMessage& on_message_;
  std::map<std::uint64_t, std::string> schemas_;
  std::set<std::uint32_t> channels_;
};

void McapFile::read_all(const OnConnection& on_connection, const OnMessage& on_message) {
  Walk(this, on_connection, on_message).read_all();
}

}  // namespace farpoint::tools
