// SPDX-License-Identifier: Apache-2.0
// Reads LCM logs through damage, and writes them whole or not at all.
//
// Event format (LCM's, big-endian): sync word 0xEDA1DA01, event number (8 bytes), receive time in us (8),
// length of the channel name (4), length of the data (4), name, data. The reader is Farpoint's, since LCM's
// asserts on damaged lengths and cannot read a pipe; a test shows that both agree on an intact log.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "ipc/event_file.h"
#include "ipc/message.h"
#include "ipc/output_file.h"

namespace farpoint::ipc {

// One event. Views are valid until the reader's next call.
struct LogEvent {
  std::int64_t number = 0;        // as written; may skip after damage
  std::int64_t timestamp_us = 0;  // time of reception; a frame's time is its message's utime
  std::uint64_t offset = 0;       // of the sync word in the file, bytes
  std::string_view channel;
  std::span<const std::uint8_t> data;
};

// The part of a log that could not be read.
struct LogDamage {
  std::uint64_t places = 0;        // skipped stretches, a cut-off end included
  std::uint64_t bytes = 0;         // skipped in total
  std::uint64_t first_offset = 0;  // of the first place
  bool cut_off = false;            // the last place reaches the end; valid at the end only
  std::string read_error;          // errno's text after a failure of disk or pipe, else empty
};

class LogReader {
 public:
  // "-" is standard input. A length above `most_data_bytes` counts as damage. Throws std::runtime_error
  // naming a file that cannot be opened, or whose first bytes are those of another kind of file.
  explicit LogReader(const std::string& path, std::size_t most_data_bytes = kMaxDataBytes);
  ~LogReader();
  LogReader(const LogReader&) = delete;
  LogReader& operator=(const LogReader&) = delete;

  // Returns the next readable event; false at the end. Damaged stretches are skipped and counted in damage().
  [[nodiscard]] bool next(LogEvent* event);

  [[nodiscard]] const LogDamage& damage() const { return damage_; }
  [[nodiscard]] std::uint64_t events() const { return events_; }  // returned so far

  static constexpr std::uint32_t kSyncWord = 0xEDA1DA01;
  static constexpr std::size_t kHeaderBytes = 28;
  static constexpr std::size_t kMaxChannelBytes = 255;
  // Far above any image.
  static constexpr std::size_t kMaxDataBytes = std::size_t{64} << 20;

 private:
  struct Header;
  // Loads `bytes` bytes from the current position, if the file has them.
  bool available(std::size_t bytes);
  void grow(std::size_t bytes);
  [[nodiscard]] const std::uint8_t* here() const { return buffer_.data() + begin_; }
  bool read_header(std::size_t ahead, Header* header);
  bool whole_event_here(Header* header);
  bool header_within(std::size_t from, std::size_t to);
  void skip(std::size_t bytes);
  void skip_to_sync();

  std::size_t most_data_bytes_;
  int fd_ = -1;
  bool owns_fd_ = false;
  bool at_end_ = false;  // fd_ is at its end
  std::vector<std::uint8_t> buffer_;
  std::size_t begin_ = 0, end_ = 0;  // unread bytes within buffer_
  std::size_t consumed_ = 0;         // of the event returned last
  std::uint64_t offset_ = 0;         // of begin_ in the file
  std::uint64_t damage_end_ = 0;     // end of the last damaged stretch
  std::uint64_t events_ = 0;
  LogDamage damage_;
};

class LogWriter {
 public:
  // "-" is standard output. Throws std::runtime_error naming a file that cannot be written. Without close()
  // no file remains.
  explicit LogWriter(const std::string& path);
  // Appends one event. Returns false if it was not stored; error() holds the reason, and close() throws.
  bool write(std::string_view channel, std::int64_t timestamp_us, std::span<const std::uint8_t> data);
  // Appends an LCM message. Precondition: its vectors have the lengths of its counts.
  template <typename Message>
  bool write_message(std::string_view channel, std::int64_t timestamp_us, const Message& message) {
    encode(message, &scratch_);
    return write(channel, timestamp_us, scratch_);
  }

  // Flushes and renames the file to its target. Throws std::runtime_error if anything was not stored (disk
  // full); the target is then unchanged, and what was written is kept as <target>.incomplete.
  void close();

  // Ends an incomplete log and keeps it as <target>.incomplete; the target stays unchanged. Returns the kept
  // file's path, empty for a device or a pipe.
  std::string keep_incomplete();

  [[nodiscard]] const std::string& error() const { return error_; }
  [[nodiscard]] std::uint64_t events() const { return file_ ? file_->events() : 0; }

 private:
  ReplacedPath path_;
  std::optional<EventFile> file_;  // empty after its end
  std::string error_;
  std::vector<std::uint8_t> scratch_;
};

}  // namespace farpoint::ipc
