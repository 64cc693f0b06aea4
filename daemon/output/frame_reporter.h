// SPDX-License-Identifier: Apache-2.0
// Everything that is published of a frame, in one order, on one thread; no heap call after the first frames.
#pragma once

#include <atomic>
#include <string>
#include <vector>

#include "daemon/config/config.h"
#include "daemon/output/frame_package.h"
#include "daemon/output/map_board.h"
#include "daemon/output/messages.h"
#include "daemon/output/pose_sink.h"
#include "daemon/output/publisher.h"

namespace farpoint::daemon {

class FrameReporter {
 public:
  struct Names {
    std::string build, configuration_hash, calibration_hash;
    std::int32_t boot_counter = 0;
  };
  // `sinks` get each frame in their order, then the publisher; all must outlive the reporter. with_schedule:
  // FARPOINT_SCHEDULE is published too.
  FrameReporter(const Config& config, const Names& names, std::vector<PoseSink*> sinks, Publisher* publisher,
                MapBoard* maps, std::int64_t pool_bytes, bool with_schedule);

  // Hands the frame to every sink. `package->clock` gets the time of the output.
  const FrameOutput& report(FramePackage* package, const OutputCounts& out);
  // The camera is away: tells every sink that there is no pose now, and why. utime: now, on the steady clock;
  // age_us: since the last frame.
  const FrameOutput& report_silence(std::int64_t utime, std::int64_t age_us, const InputCounts& in,
                                    const OutputCounts& out);
  // Before the first frame. See realtime.deadline_ms.
  void set_deadline(double deadline_ms) { deadline_ms_ = deadline_ms; }
  // Before the first frame, live: the tracked camera's name.
  void set_camera(const std::string& name) { status_.camera = name; }
  // Any thread. The next pose becomes the origin of odom, and the reset counter goes up.
  void reset_odom() { reset_odom_.store(true, std::memory_order_relaxed); }
  // Any thread.
  void set_status_rate(double rate_hz) { status_rate_hz_.store(rate_hz, std::memory_order_relaxed); }
  [[nodiscard]] double status_rate_hz() const { return status_rate_hz_.load(std::memory_order_relaxed); }

 private:
  void publish_status(const FramePackage& package, const OutputCounts& out);
  void publish_schedule(const FramePackage& package);
  [[nodiscard]] slam::FrameResult since_odom_reset(const slam::FrameResult& result);
  void fill_status(const FramePackage& package, const OutputCounts& out);
  void note_state(const slam::FrameResult& result);

  std::atomic<double> status_rate_hz_;
  const double assumed_scale_;
  double deadline_ms_;
  const int features_;  // as configured
  const bool with_schedule_;
  std::vector<PoseSink*> sinks_;
  Publisher* publisher_;
  MapBoard* maps_;

  FrameOutput frame_;
  std::atomic<bool> reset_odom_{false};
  slam::SE3 T_odom_start_;  // of the last reset
  std::uint32_t odom_resets_ = 0;
  FramePackage silence_;  // what the last frame said, without its pose
  status_t status_{};     // its texts are set once
  slam::State last_state_ = slam::State::kStarting;
  std::int64_t next_status_utime_;
};

}  // namespace farpoint::daemon
