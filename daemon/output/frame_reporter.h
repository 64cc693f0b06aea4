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
  // Before the first frame. Where the estimator's body stands in maps of unknown unit; make_frame_output().
  void set_lever(const Eigen::Vector3d& lever_m) { lever_m_ = lever_m; }
  // Metres a unit of the map of this number, by scale.assumed: that of the first map with a valid pose, since
  // another map's unit is another. 0: none is assumed.
  [[nodiscard]] double assumed_scale_of(std::int32_t map_id) const {
    return assumed_map_ < 0 || map_id == assumed_map_ ? assumed_scale_ : 0.0;
  }
  // A valid pose in units of scale.assumed went out.
  [[nodiscard]] bool assumes_scale() const { return assumed_map_ >= 0; }
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
  [[nodiscard]] FrameOutput make_output(const slam::FrameResult& result);

  std::atomic<double> status_rate_hz_;
  const double assumed_scale_;
  std::int32_t assumed_map_ = -1;  // -1: no valid pose yet
  Eigen::Vector3d lever_m_ = Eigen::Vector3d::Zero();
  double deadline_ms_;
  const int features_;  // as configured
  const bool with_schedule_;
  std::vector<PoseSink*> sinks_;
  Publisher* publisher_;
  MapBoard* maps_;

  FrameOutput frame_;
  std::atomic<bool> reset_odom_{false};
  slam::SE3 T_odom_start_;                               // of the last reset
  slam::Matrix6d drift_start_ = slam::Matrix6d::Zero();  // until it, of the map of the counter below
  std::uint32_t drift_resets_ = 0;
  std::uint32_t odom_resets_ = 0;
  FramePackage silence_;  // what the last frame said, without its pose
  status_t status_{};     // its texts are set once
  slam::State last_state_ = slam::State::kStarting;
  std::int64_t next_status_utime_;
};

}  // namespace farpoint::daemon
