// SPDX-License-Identifier: Apache-2.0
// The way by wheels alone since the last pose by images, and how far it may be off.
#pragma once

#include "slam/config.h"
#include "slam/geometry/se3.h"

namespace farpoint::slam {

// One thread; makes no heap call. Variances have the order (translation, rotation), body axes, metres.
class WheelWay {
 public:
  explicit WheelWay(const WheelConfig& config) : config_(config) {}

  void clear() { way_m_ = time_s_ = 0; }
  // The body moved on by T_from_to in `dt_s`.
  void add(const SE3& T_from_to, double dt_s);
  [[nodiscard]] bool empty() const { return time_s_ == 0.0; }
  // Of the whole way. The readings' errors count as one error, so that variances grow by the way's square.
  [[nodiscard]] Vector6d variances() const;
  // Of a velocity that the wheels tell.
  [[nodiscard]] Vector6d variances_of(const Vector6d& velocity_body) const;

 private:
  const WheelConfig config_;
  double way_m_ = 0, time_s_ = 0;
};

}  // namespace farpoint::slam
