// SPDX-License-Identifier: Apache-2.0
#include "slam/fusion/wheel_way.h"

namespace farpoint::slam {

namespace {

// Height, roll and pitch of a road vehicle: hills of a few percent, springs of a few degrees within half a
// second.
constexpr double kSlope = 0.05, kTilt_rad = 0.05, kTiltRate_rad_per_s = 0.1;
// Between the body's x axis and the direction in which the wheels roll: three degrees of mounting and slip.
constexpr double kMounting_rad = 0.05;

}  // namespace

void WheelWay::add(const SE3& T_from_to, double dt_s) {
  way_m_ += T_from_to.t.norm();
  time_s_ += dt_s;
}

Vector6d WheelWay::variances() const {
  if (empty()) return Vector6d::Zero();
  const double along_m = config_.scale_sigma * way_m_ + config_.speed_sigma_mps * time_s_;
  const double yaw_rad = config_.yaw_rate_sigma_radps * time_s_;
  const double aside_m = along_m + (kMounting_rad + 0.5 * yaw_rad) * way_m_;
  Vector6d sigma;
  sigma << along_m, aside_m, kSlope * way_m_, kTilt_rad, kTilt_rad, yaw_rad;
  return sigma.cwiseAbs2();
}

Vector6d WheelWay::variances_of(const Vector6d& velocity_body) const {
  const double speed_mps = velocity_body.head<3>().norm();
  const double along_mps = config_.speed_sigma_mps + (config_.scale_sigma + config_.slip_sigma) * speed_mps;
  Vector6d sigma;
  sigma << along_mps, along_mps + kMounting_rad * speed_mps, kSlope * speed_mps, kTiltRate_rad_per_s,
      kTiltRate_rad_per_s, config_.yaw_rate_sigma_radps;
  return sigma.cwiseAbs2();
}

}  // namespace farpoint::slam
