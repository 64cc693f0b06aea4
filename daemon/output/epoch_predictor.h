// SPDX-License-Identifier: Apache-2.0
// Predicts the last frame's outcome to the time of sending.
#pragma once

#include <array>
#include <cstdint>

#include "daemon/config/config.h"
#include "daemon/output/pose_sink.h"
#include "ipc/can_codec.h"

namespace farpoint::daemon {

struct EpochOptions {
  CanPoseFrame pose_frame = CanPoseFrame::kOdom;
  double frame_period_s = 0.0;  // of the camera; 0: measured from the images' times
  std::uint8_t boot_counter = 0;
};

// Times are in microseconds of one clock: the steady clock live, the recording's in replay.
class EpochPredictor {
 public:
  // Greatest age of the image of a valid pose. No sensor has measured the motion since.
  static constexpr std::int64_t kLongest_us = 250'000;

  explicit EpochPredictor(const EpochOptions& options) : options_(options) {}

  // Takes the outcome of the image at image_us. The state no_camera brings no image, so the age keeps
  // growing.
  void take(const FrameOutput& frame, std::int64_t image_us);
  void set_body_is_camera(bool is_camera) {
    body_is_camera_ = is_camera ? ipc::CanYesNo::kYes : ipc::CanYesNo::kNo;
  }

  [[nodiscard]] ipc::OdometryEpoch at(std::int64_t now_us) const;
  // The last epoch before an orderly end: state 'stopped', no signal available.
  [[nodiscard]] ipc::OdometryEpoch farewell(std::int64_t now_us) const;

 private:
  [[nodiscard]] ipc::OdometryEpoch head(std::int64_t now_us) const;
  [[nodiscard]] ipc::Reason reason(bool in_time) const;
  [[nodiscard]] std::int64_t frame_period_us() const;
  void note_period(std::int64_t image_us);

  EpochOptions options_;
  ipc::CanYesNo body_is_camera_ = ipc::CanYesNo::kNotAvailable;
  FrameOutput last_;
  bool has_image_ = false;
  std::int64_t image_us_ = 0;
  std::array<std::int64_t, 3> periods_us_{};  // between the last images; 0: not known yet
  std::size_t next_period_ = 0;
};

}  // namespace farpoint::daemon
