// SPDX-License-Identifier: Apache-2.0
// Where the second camera of a stereo pair stands, from the rectification of a stereo calibration.
#pragma once

#include <optional>
#include <span>

#include "slam/geometry/se3.h"

namespace farpoint::tools {

// The rectified cameras of a pair have parallel axes. R turns the raw camera's axes into theirs; the camera
// stands `right_m` to the right of the pair's first.
struct Rectification {
  Eigen::Matrix3d R = Eigen::Matrix3d::Zero();
  double right_m = 0.0;
};

// From R (9 numbers) and P (12), both by rows: P(0, 3) is minus the focal length times right_m.
[[nodiscard]] Rectification rectification_of(std::span<const double, 9> r, std::span<const double, 12> p);

// T_first_second of the raw cameras. Empty where R is no rotation or the cameras stand at one place, as of
// cameras that were calibrated one by one.
[[nodiscard]] std::optional<slam::SE3> second_camera(const Rectification& first, const Rectification& second);

}  // namespace farpoint::tools
