// LCM logs: reading that survives damage, writing that leaves a whole file or none.
//
// Event format (LCM's, big-endian): sync word 0xEDA1DA01, event number (8 bytes), receive time in us (8),
// length of the channel name (4), length of the data (4), name, data. LCM's own reader asserts on damaged
// lengths and cannot read a pipe, so the reader here is our own; a test shows that both agree on an intact
// log. Writing uses LCM's.
#pragma once

#include <lcm/eventlog.h>

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "ipc/message.h"
#include "ipc/output_file.h"

namespace farpoint::ipc {

// One event. Views are valid until the reader's next call.
struct LogEvent {
  std::int64_t number = 0;        // as written; not necessarily consecutive after damage
  std::int64_t timestamp_us = 0;  // when it was received; a frame's time is its message's utime instead
  std::uint64_t offset = 0;       // of the sync word in the file, bytes
  std::string_view channel;
  std::span<const std::uint8_t> data;
};

// What could not be read.
struct LogDamage {
  std::uint64_t places = 0;        // connected stretches that were skipped, a cut-off end included
  std::uint64_t bytes = 0;         // skipped in all
  std::uint64_t first_offset = 0;  // of the first place
  bool cut_off = false;            // known at the end: the last place reaches it
  std::string read_error;          // errno's text where the disk or pipe itself failed, else empty
};

class LogReader {
 public:
  // "-" is standard input. Throws std::runtime_error naming the file where it cannot be opened.
  explicit LogReader(const std::string& path);
  ~LogReader();
  LogReader(const LogReader&) = delete;
  LogReader& operator=(const LogReader&) = delete;

  // The next event that can be read; false at the end. Damaged stretches are skipped and counted in damage().
  [[nodiscard]] bool next(LogEvent* event);

  [[nodiscard]] const LogDamage& damage() const { return damage_; }
  [[nodiscard]] std::uint64_t events() const { return events_; }  // given out so far

  static constexpr std::uint32_t kSyncWord = 0xEDA1DA01;
  static constexpr std::size_t kHeaderBytes = 28;
  static constexpr std::size_t kMaxChannelBytes = 255;
  // Longer is taken for a damaged length: far beyond any image here.
  static constexpr std::size_t kMaxDataBytes = std::size_t{64} << 20;

 private:
  struct Header;
  // Makes `bytes` bytes available from the present position, where the file has them.
  bool available(std::size_t bytes);
  [[nodiscard]] const std::uint8_t* here() const { return buffer_.data() + begin_; }
  bool read_header(std::size_t ahead, Header* header);
  bool whole_event_here(Header* header);
  bool header_within(std::size_t from, std::size_t to);
  void skip(std::size_t bytes);
  void skip_to_sync();

  int fd_ = -1;
  bool owns_fd_ = false;
  bool at_end_ = false;  // nothing more to read from fd_
  std::vector<std::uint8_t> buffer_;
  std::size_t begin_ = 0, end_ = 0;  // unread bytes within buffer_
  std::size_t consumed_ = 0;         // of the event given out last
  std::uint64_t offset_ = 0;         // of begin_ in the file
  std::uint64_t damage_end_ = 0;     // where the last damaged stretch ended
  std::uint64_t events_ = 0;
  LogDamage damage_;
};

class LogWriter {
 public:
  // "-" is standard output. Throws std::runtime_error naming the file where it cannot be written.
  explicit LogWriter(const std::string& path);
  // Without close(): nothing is left behind.
  ~LogWriter();
  LogWriter(const LogWriter&) = delete;
  LogWriter& operator=(const LogWriter&) = delete;

  // Appends one event. False where it was not stored; error() says why, and close() will throw.
  bool write(std::string_view channel, std::int64_t timestamp_us, std::span<const std::uint8_t> data);
  // The same for an LCM message. Precondition: its vectors are as long as its counts say.
  template <typename Message>
  bool write_message(std::string_view channel, std::int64_t timestamp_us, const Message& message) {
    encode(message, &scratch_);
    return write(channel, timestamp_us, scratch_);
  }

  // Flushes, and puts the file in its place. Throws std::runtime_error where anything was not stored (disk
  // full): the target is then as it was before.
  void close();

  // Hands what was written so far to the system, so that a killed program leaves it. False as for write().
  bool flush();
  // Ends a log that could not be completed, and keeps it beside the target as <target>.incomplete; the target
  // stays as it was. Empty where there is nothing to keep (a device or a pipe), else the kept file's path.
  std::string keep_incomplete();

  [[nodiscard]] const std::string& error() const { return error_; }
  [[nodiscard]] std::uint64_t events() const { return events_; }

 private:
  ReplacedPath path_;
  lcm_eventlog_t* log_ = nullptr;
  std::string channel_, error_;
  std::vector<std::uint8_t> scratch_;
  std::uint64_t events_ = 0;
};

}  // namespace farpoint::ipc
