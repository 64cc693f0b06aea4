// SPDX-License-Identifier: Apache-2.0
#include "daemon/pipeline/schedule.h"

#include <spdlog/fmt/fmt.h>

#include "daemon/config/rig.h"
#include "ipc/channels.h"
#include "ipc/log.h"

namespace farpoint::daemon {

Schedule::Schedule(const std::string& log) : log_(log) {
  if (log == "-")
    throw InputError("standard input cannot be read twice, expected the schedule's log with --schedule-log");
  try {
    ipc::LogReader reader(log);
    ipc::LogEvent event;
    while (reader.next(&event)) {
      odometry_t odometry;
      if (event.channel == ipc::kOdometryChannel && ipc::decode(event.data, &odometry))
        boot_counter_ = odometry.boot_counter;
      schedule_t m;
      if (event.channel != ipc::kScheduleChannel || !ipc::decode(event.data, &m)) continue;
      const FrameChance chance{m.frames_dropped, m.age_us, m.capture_queue, m.publish_queue,
                               m.features_asked};
      const slam::FrameTaken taken{static_cast<std::uint64_t>(m.replies_taken),
                                   static_cast<std::uint64_t>(m.imu_taken),
                                   static_cast<std::uint64_t>(m.wheels_taken)};
      if (m.samples_dropped > 0) {
        throw InputError(fmt::format(
            "{}: the recorded run dropped {} sensor samples until {:.6f} s and cannot be repeated, "
            "expected a run that dropped none",
            log, m.samples_dropped, 1e-6 * static_cast<double>(m.utime)));
      }
      entries_.push_back({m.utime, static_cast<std::uint64_t>(m.job), {chance, taken}});
    }
  } catch (const std::runtime_error& error) {
    throw InputError(error.what());
  }
  if (entries_.empty()) {
    throw InputError(log_ + ": no FARPOINT_SCHEDULE message, expected the output log of a threaded run" +
                     " (--speed X --output LOG), named with --schedule-log");
  }
}

const RecordedChance* Schedule::take(std::int64_t utime) {
  if (next_ == entries_.size() || utime < entries_[next_].utime) return nullptr;
  if (utime > entries_[next_].utime) {
    throw InputError(
        fmt::format("{}: the schedule has a frame at {:.6f} s, the replayed log has none there; "
                    "expected the log of the recorded run",
                    log_, 1e-6 * static_cast<double>(entries_[next_].utime)));
  }
  return &entries_[next_++].recorded;
}

void Schedule::check(const slam::FrameResult& result) const {
  const Entry& entry = entries_[next_ - 1];
  const slam::FrameTaken &then = entry.recorded.taken, &now = result.taken;
  if (now.imu != then.imu || now.wheels != then.wheels) {
    throw InputError(fmt::format(
        "{}: the frame at {:.6f} s had taken {} IMU and {} wheel samples, now {} and {}; expected the log of "
        "the "
        "recorded run",
        log_, 1e-6 * static_cast<double>(entry.utime), then.imu, then.wheels, now.imu, now.wheels));
  }
  if (now.replies == then.replies && result.job == entry.job) return;
  throw InputError(fmt::format(
      "{}: the frame at {:.6f} s knew {} results of mapping and gave job {}, now {} "
      "and {}; expected the configuration and the build of the recorded run",
      log_, 1e-6 * static_cast<double>(entry.utime), then.replies, entry.job, now.replies, result.job));
}

void Schedule::check_end() const {
  if (next_ == entries_.size()) return;
  throw InputError(
      fmt::format("{}: {} frames of the schedule are not in the replayed log, expected the log "
                  "of the recorded run",
                  log_, entries_.size() - next_));
}

}  // namespace farpoint::daemon
