// SPDX-License-Identifier: Apache-2.0
// The files of one recording. Without limits one file; with them a ring of numbered files, each of which
// begins with the calibration and can be replayed by itself. What was written is kept, whatever happens: a
// full disk leaves out events until there is room again, and what a killed run left is finished.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/config/config.h"
#include "daemon/input/recording_folder.h"
#include "ipc/event_file.h"
#include "ipc/message.h"
#include "ipc/output_file.h"

namespace farpoint::daemon {

class Recording {
 public:
  // Opens the first file. "-" is standard output; that, pipes and devices are one file whatever the limits.
  // Throws std::runtime_error naming a file that cannot be written.
  Recording(const std::string& target, const RecordConfig& limits, const calibration_t& calibration);
  // Finishes the present file, as close() does.
  ~Recording();
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;

  // One thread makes all calls below. They wait for the disk.
  // Appends an event, after beginning a new file and removing old ones where a limit asks for it. Returns
  // false if it was not stored; problem() then holds the reason.
  bool write(std::string_view channel, std::int64_t utime, std::span<const std::uint8_t> data);
  // Does a slice of the work on what earlier runs left: measures numbered files, finishes parts. Returns
  // false once all of it is done. Logs one line for each finished part.
  bool tidy();
  // Finishes the present file: flushes it and gives it its name. Returns the last failure of the run, empty
  // without one. Never throws; later calls have no effect.
  std::string close();

  // Finished files of this run, without those that the ring has removed.
  [[nodiscard]] std::vector<std::string> files() const;
  // Last failure, empty without one.
  [[nodiscard]] const std::string& problem() const { return problem_; }
  // For tests: in place of the disk's.
  void take_free_share_from(std::function<double()> free_share) { free_share_ = std::move(free_share); }

  // Numbered files are at most this part of max_size_mb or max_minutes.
  static constexpr int kFilesOfALimit = 10;

 private:
  struct Finished {
    std::string path;
    std::uint64_t bytes = 0;
    std::int64_t duration_us = 0;
    bool of_this_run = false;
    bool measured = false;
  };
  struct Present {
    explicit Present(const std::string& target) : path(target), events(path.writable()) {}
    ipc::ReplacedPath path;
    ipc::EventFile events;
    std::optional<std::int64_t> first_utime;
    std::int64_t last_utime = 0;

    [[nodiscard]] std::int64_t duration_us(std::int64_t until) const {
      return first_utime ? until - *first_utime : 0;
    }
  };

  void begin_file();
  void finish_file();
  [[nodiscard]] bool is_full(std::uint64_t more_bytes, std::int64_t utime) const;
  [[nodiscard]] bool make_room(std::uint64_t more_bytes, std::int64_t utime);
  bool remove_oldest();
  bool measure_one();
  bool finish_one_part();
  bool fail(const std::string& what);

  const std::string target_;
  const RecordConfig limits_;
  const bool is_ring_;
  const RecordingFolder folder_;
  std::function<double()> free_share_;
  std::vector<std::uint8_t> calibration_;  // encoded
  std::int64_t calibration_utime_ = 0;
  std::unique_ptr<Present> present_;  // null: closed, or none could be begun
  std::int64_t next_number_ = 1;
  std::deque<Finished> finished_;  // the oldest first
  std::string problem_;
  bool closed_ = false;
  double next_try_s_ = 0;  // steady clock; after a failure
  // Of tidy().
  std::deque<std::string> orphans_;
  std::unique_ptr<ipc::EventWalk> walk_;
};

}  // namespace farpoint::daemon
