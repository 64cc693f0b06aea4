// SPDX-License-Identifier: Apache-2.0
// A bag of ROS 2 in an SQLite database (.db3): the tables `topics` and `messages`, CDR messages in blobs.
#pragma once

#include <string_view>

#include "tools/import/bag_file.h"

struct sqlite3;
struct sqlite3_blob;
struct sqlite3_stmt;

namespace farpoint::tools {

inline constexpr std::string_view kSqliteMagic{"SQLite format 3\0", 16};

// Messages that rosbag2 packed one by one (compression_mode message, zstd) are unpacked: CDR never begins as
// a zstd frame does.
//
// A topic is a connection, a row of `messages` a part. The file is opened for reading only; no other file is
// opened, whatever the database says.
class SqliteBag : public BagFile {
 public:
  // Throws InputError for a database that SQLite cannot read, and one whose recorder did not close it.
  explicit SqliteBag(std::filesystem::path path);
  ~SqliteBag() override;

  [[nodiscard]] const std::filesystem::path& path() const override { return path_; }
  void read_all(const OnConnection& on_connection, const OnMessage& on_message) override;
  [[nodiscard]] std::string read(const BagPlace& place, std::uint64_t bytes) override;
  [[noreturn]] void fail(const BagPlace& place, const std::string& message) const override;

 private:
  class Statement;
  void limit_work();
  void require_table(const std::string& name);
  void read_topics(const OnConnection& on_connection);
  void read_messages(const OnMessage& on_message);
  void open_blob(const BagPlace& place);
  [[nodiscard]] std::string read_blob(const BagPlace& place, std::uint64_t bytes);
  [[nodiscard]] bool is_packed(const BagPlace& place);
  [[nodiscard]] std::uint64_t content_bytes(const BagPlace& place);
  [[nodiscard]] const Chunk& unpacked(const BagPlace& place);

  std::filesystem::path path_;
  sqlite3* database_ = nullptr;
  sqlite3_blob* blob_ = nullptr;  // of row blob_row_
  std::uint64_t blob_row_ = 0;    // 0: none
  Chunk unpacked_;                // content of row unpacked_row_
  std::uint64_t unpacked_row_ = 0;
};

}  // namespace farpoint::tools
