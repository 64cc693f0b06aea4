// SPDX-License-Identifier: Apache-2.0
// Files of LCM log events (format: log.h): appends each event whole or not at all, and walks over them by
// their headers alone.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace farpoint::ipc {

// Not buffered: what append() has stored survives a kill of the program. One thread; append() makes no heap
// call and waits for the disk.
class EventFile {
 public:
  // Creates or empties the file. A regular file is locked (flock) until close(), which marks it as in use.
  // Throws std::runtime_error with errno's text.
  explicit EventFile(const std::string& path);
  ~EventFile() { close(); }
  EventFile(const EventFile&) = delete;
  EventFile& operator=(const EventFile&) = delete;

  // Returns 0, or errno. After a failure the file ends with the event before, and a later event may succeed.
  // Exception: a pipe or device that took part of an event refuses all later ones.
  [[nodiscard]] int append(std::string_view channel, std::int64_t timestamp_us,
                           std::span<const std::uint8_t> data);
  // Flushes to the disk. Returns 0, or errno; 0 for pipes and devices, which cannot be flushed.
  [[nodiscard]] int sync();
  void close();

  [[nodiscard]] std::uint64_t events() const { return events_; }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }  // of whole events
  // Size of one event in the file.
  [[nodiscard]] static std::uint64_t event_bytes(std::string_view channel,
                                                 std::span<const std::uint8_t> data);

 private:
  void cut_off_rest();

  int fd_ = -1;
  int error_ = 0;  // of a pipe or device that took part of an event
  bool is_regular_ = false;
  std::uint64_t events_ = 0, bytes_ = 0;
};

// Walks from header to header of a file's events, some at a time. Reads no data.
class EventWalk {
 public:
  // A file that cannot be read has no events.
  explicit EventWalk(const std::string& path);
  ~EventWalk();
  EventWalk(const EventWalk&) = delete;
  EventWalk& operator=(const EventWalk&) = delete;

  // Passes at most `events` events. Returns false at the end of the whole events.
  [[nodiscard]] bool step(int events);

  [[nodiscard]] std::uint64_t events() const { return events_; }
  [[nodiscard]] std::uint64_t end() const { return end_; }                // of the last whole event, bytes
  [[nodiscard]] std::uint64_t file_bytes() const { return file_bytes_; }  // when the walk began
  // From the second event to the last; 0 with fewer. The first one of a recording is its calibration.
  [[nodiscard]] std::int64_t duration_us() const;

 private:
  [[nodiscard]] bool pass_one();

  int fd_ = -1;
  std::uint64_t events_ = 0, end_ = 0, file_bytes_ = 0;
  std::int64_t first_us_ = 0, last_us_ = 0;
};

}  // namespace farpoint::ipc
