// SPDX-License-Identifier: Apache-2.0
// A recording of ROS in one file, whatever its container: connections and messages in the order of the file.
// Messages stay in the file. Nothing of its content is trusted.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "tools/import/byte_file.h"
#include "tools/import/chunk.h"
#include "tools/import/ros_message.h"

namespace farpoint::tools {

struct BagConnection {
  std::uint32_t id = 0;
  std::string topic, type;  // "/camera/image_raw", "sensor_msgs/Image"
  RosPacking packing = RosPacking::kRos1;
};

// A byte of a bag. Its parts are compressed chunks, named by the byte at which their record begins, or rows
// of a database, named by their id; part 0 is the file itself.
struct BagPlace {
  std::uint64_t part = 0, offset = 0;
};

struct BagMessage {
  std::uint32_t connection = 0;
  std::int64_t received_ns = 0;
  BagPlace place;  // of its content
  std::uint64_t bytes = 0;
};

using OnConnection = std::function<void(const BagConnection&)>;
using OnMessage = std::function<void(const BagMessage&)>;

class BagFile {
 public:
  BagFile() = default;
  virtual ~BagFile() = default;
  BagFile(const BagFile&) = delete;
  BagFile& operator=(const BagFile&) = delete;

  [[nodiscard]] virtual const std::filesystem::path& path() const = 0;
  // Calls back for each connection once, before its messages, and for each message. A bag's own index is not
  // used. Types have no "/msg"; those of other encodings than ROS's have the encoding before their name.
  // Throws InputError naming the place: damage, a cut off end, lengths beyond their limits.
  virtual void read_all(const OnConnection& on_connection, const OnMessage& on_message) = 0;
  // Bytes from `place` on. Throws InputError, before any memory is taken, where there are fewer.
  [[nodiscard]] virtual std::string read(const BagPlace& place, std::uint64_t bytes) = 0;
  // Throws InputError "FILE: byte 12: message".
  [[noreturn]] virtual void fail(const BagPlace& place, const std::string& message) const = 0;
};

// One record of a container.
struct BagRecord {
  BagPlace place, data;  // of the whole record, of its data
  std::uint64_t data_bytes = 0;
  [[nodiscard]] std::uint64_t end() const { return data.offset + data_bytes; }
};

// A bag whose messages lie in the file or in compressed chunks of it. Two chunks are held in memory.
class ChunkedBag : public BagFile {
 public:
  explicit ChunkedBag(const std::filesystem::path& path) : file_(path) {}

  [[nodiscard]] const std::filesystem::path& path() const override { return file_.path(); }
  [[nodiscard]] std::string read(const BagPlace& place, std::uint64_t bytes) override;
  [[noreturn]] void fail(const BagPlace& place, const std::string& message) const override;

 protected:
  // Content of the chunk whose record begins at byte `part`.
  [[nodiscard]] virtual Chunk load_chunk(std::uint64_t part) = 0;

  [[nodiscard]] const ByteFile& file() const { return file_; }
  [[nodiscard]] std::uint64_t size_of(std::uint64_t part);
  // Decompresses bytes of the file. Throws InputError for a chunk beyond the limits or a damaged one.
  [[nodiscard]] Chunk unpack(Compression compression, std::uint64_t offset, std::uint64_t bytes,
                             std::uint64_t content_bytes) const;

 private:
  struct Held {
    std::uint64_t part = 0;  // 0: none
    Chunk content;
  };
  const Chunk& chunk(std::uint64_t part);

  ByteFile file_;
  std::array<Held, 2> held_;  // the one used last first
};

// ROS 2's names of types as ROS 1 has them: "sensor_msgs/msg/Image" -> "sensor_msgs/Image".
[[nodiscard]] std::string without_msg(std::string type);

// A ROS 1 bag (2.0), an MCAP recording or a ROS 2 bag in SQLite (.db3), chosen by the first bytes. Throws
// InputError for other files.
[[nodiscard]] std::unique_ptr<BagFile> open_bag(const std::filesystem::path& path);

}  // namespace farpoint::tools
