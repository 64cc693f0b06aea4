// SPDX-License-Identifier: Apache-2.0
// Refines a camera's calibration from the map (ours; not in the paper).
//
// A rectified or factory calibration is good to about a pixel, and a small bias of it is the same in every
// frame: a slow turn adds it up into a loss of scale. The same measurements that local BA uses also say what
// the calibration is; this estimator gathers that, with the given calibration as prior.
//
// State: delta = (log focal scale, cx, cy, k1), relative to the given calibration; k1 is the first radial
// coefficient of either camera model. Every local BA leaves a quadratic in delta after poses and inverse
// depths are eliminated. Windows overlap, so a measurement would be counted once a window: of each quadratic
// one part in `keyframes of the window` is kept, and fades as the map gets better.
#pragma once

#include <vector>

#include "slam/config.h"
#include "slam/mapping/calibration_estimate.h"
#include "slam/solver/bundle_problem.h"

namespace farpoint::slam {

using CalibrationDelta = Eigen::Vector4d;

// d(pixel)/d(delta) at a point, camera axes, that projects to `pixel`.
using CameraDerivative = Eigen::Matrix<double, 2, 4>;
[[nodiscard]] CameraDerivative camera_derivative(const Camera& camera, const Eigen::Vector3d& point_c,
                                                 const Eigen::Vector2d& pixel);
// Largest move of a ray's pixel over the image's edge between two calibrations of one camera.
[[nodiscard]] double image_change_px(const Camera& from, const Camera& to);
// The given camera changed by delta.
[[nodiscard]] Camera refined_camera(const Camera& given, const CalibrationDelta& delta);

class Calibrator {
 public:
  // Refines camera `index` of the rig; the other cameras are taken as right.
  Calibrator(const CalibrationConfig& config, const Camera& given, int index = 0);

  // Uses a window at the optimum of its poses and inverse depths. d_bearing_d_pixel: of every point, at its
  // host pixel, anchor axes; zero where another camera is the anchor. True where the estimate moved
  // noticeably and camera() should be used from now on.
  bool update(const BundleProblem& problem,
              const std::vector<Eigen::Matrix<double, 3, 2>>& d_bearing_d_pixel);

  // As CalibrationEstimate.
  [[nodiscard]] const CalibrationDelta& delta() const { return estimate_.delta(); }
  [[nodiscard]] CalibrationDelta sigma() const { return estimate_.sigma(); }
  [[nodiscard]] double surprise() const { return estimate_.surprise(); }
  [[nodiscard]] CalibrationDelta wanted_by_images() const { return estimate_.wanted_by_images(); }
  [[nodiscard]] bool contradicts_given() const { return estimate_.contradicts_given(); }
  [[nodiscard]] const Camera& camera() const { return camera_; }
  [[nodiscard]] int camera_index() const { return index_; }

 private:
  CalibrationConfig config_;
  Camera given_;
  int index_;  // in the rig
  CalibrationEstimate<4> estimate_;
  Camera camera_;  // given_ changed by the estimate
};

}  // namespace farpoint::slam
