// SPDX-License-Identifier: Apache-2.0
// The wheels on tracking's thread: the body's motion between two times, and whether it stands.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>

#include "slam/config.h"
#include "slam/fusion/wheel_track.h"
#include "slam/geometry/se3.h"
#include "slam/solver/motion_factors.h"

namespace farpoint::slam {

// Points of the vehicle, from the body that tracking and map use, body axes. One camera's map has its body at
// the camera: lever arms are in metres, which it lacks at first.
struct VehiclePoints {
  Eigen::Vector3d wheels_m = Eigen::Vector3d::Zero();  // where the wheels measure
  Eigen::Vector3d body_m = Eigen::Vector3d::Zero();    // the calibration's body
};

// One thread. No heap call after the constructor.
class WheelMotionModel {
 public:
  // Below both the wheels stand, as means over kStanding_s: a sensor that counts teeth reads zero from
  // walking pace on, and noise of a running one averages out.
  static constexpr double kStanding_mps = 0.02, kStanding_radps = 0.01;
  static constexpr double kStanding_s = 0.3;

  // `point_m`: where the wheels measure, from the tracked body, body axes.
  WheelMotionModel(const WheelConfig& config, const Eigen::Vector3d& point_m);

  // A sample as it left the sensor, in the order of time.
  void add(WheelSample sample);
  // What mapping found out: contradicted wheels measure nothing, others by their factor.
  void trust(WheelTrust trust, double factor);

  // The body's motion in metres, planar, T_from_to. The newest reading holds for max_gap_s at most. Empty
  // where the wheels do not tell it, or no yaw rate.
  [[nodiscard]] std::optional<SE3> motion(std::int64_t from_utime, std::int64_t to_utime) const;
  // The wheels stood over the last kStanding_s.
  [[nodiscard]] bool stands(std::int64_t utime) const;
  [[nodiscard]] bool trusted() const { return trust_ == WheelTrust::kTrusted; }

 private:
  const WheelConfig config_;
  const Eigen::Vector3d point_m_;
  WheelTrack track_;
  WheelTrust trust_ = WheelTrust::kNone;
  double factor_;
};

// A sample as a track takes it: its time that of the motion, an unknown yaw rate with a wide sigma. Empty
// without a speed.
[[nodiscard]] std::optional<WheelSample> usable_sample(WheelSample sample, const WheelConfig& config);
[[nodiscard]] WheelOptions track_options(const WheelConfig& config);

}  // namespace farpoint::slam
