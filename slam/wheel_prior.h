// SPDX-License-Identifier: Apache-2.0
// The motion model of frames and wheels: over a short time the body goes on as it moved between the last two
// frames, over a longer one as the wheels say.
#pragma once

#include "slam/fusion/wheel_motion_model.h"
#include "slam/tracking/tracker.h"

namespace farpoint::slam {

class WheelPrior final : public MotionModel {
 public:
  // Braking at 3 m/s^2 leads a constant velocity astray by 6 cm in this time, more than wheels err.
  static constexpr double kLongStep_s = 0.2;

  // Both must outlive this.
  WheelPrior(const Tracker* tracker, const WheelMotionModel* wheels) : tracker_(*tracker), wheels_(*wheels) {}

  [[nodiscard]] PosePrior predict(std::int64_t utime) const override;
  [[nodiscard]] Vector6d velocity_body() const override { return tracker_.motion().velocity_body(); }

 private:
  const Tracker& tracker_;
  const WheelMotionModel& wheels_;
};

}  // namespace farpoint::slam
