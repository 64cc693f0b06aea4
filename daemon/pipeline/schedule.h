// SPDX-License-Identifier: Apache-2.0
// The recorded schedule of a threaded run, to be repeated.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "daemon/pipeline/session.h"

namespace farpoint::daemon {

class Schedule {
 public:
  // Reads FARPOINT_SCHEDULE of the log. Throws InputError where there is none.
  explicit Schedule(const std::string& log);

  // What this frame met; null where it was dropped. Frames come in the order of the log. Throws InputError
  // where the schedule is of another recording.
  [[nodiscard]] const RecordedChance* take(std::int64_t utime);
  // Throws InputError where the frame taken last did not do what it did then: another configuration, or
  // another program.
  void check(const slam::FrameResult& result) const;
  // Of the recorded run, so that what is published again is the same.
  [[nodiscard]] std::int32_t boot_counter() const { return boot_counter_; }
  // Throws InputError where frames of the schedule have not come.
  void check_end() const;

 private:
  struct Entry {
    std::int64_t utime = 0;
    std::uint64_t job = 0;
    RecordedChance recorded;
  };
  std::string log_;
  std::vector<Entry> entries_;
  std::size_t next_ = 0;
  std::int32_t boot_counter_ = 0;
};

}  // namespace farpoint::daemon
