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

  [[nodiscard]] const CalibrationDelta& delta() const { return delta_; }
  // 1 sigma of delta.
  [[nodiscard]] CalibrationDelta sigma() const;
  // How far what the images alone want lies from the given calibration, in standard deviations (Mahalanobis):
  // of the images' information and the prior's together. A tight prior hides nothing from it, as it does from
  // delta(), which hardly moves then.
  [[nodiscard]] double surprise() const;
  // What the images alone want, without the prior.
  [[nodiscard]] CalibrationDelta wanted_by_images() const;
  // True where the images say that the given calibration is of another camera, focus or resolution: what is
  // that far off has not been refined, only bent towards what fits. From 5 sigma, and until 3: the
  // recordings' right calibrations were never further off than 1.8, a focal length that is 10 % wrong is 8
  // off.
  [[nodiscard]] bool contradicts_given() const { return contradicts_given_; }
  [[nodiscard]] const Camera& camera() const { return camera_; }
  [[nodiscard]] int camera_index() const { return index_; }

 private:
  struct Quadratic {
    Eigen::Matrix4d H = Eigen::Matrix4d::Zero();
    Eigen::Vector4d g = Eigen::Vector4d::Zero();  // gradient at the present delta
    bool usable = false;
  };
  [[nodiscard]] Quadratic window_information(const BundleProblem& problem,
                                             const std::vector<Eigen::Matrix<double, 3, 2>>& d_bearing) const;

  CalibrationConfig config_;
  Camera given_;
  int index_;  // in the rig
  CalibrationDelta delta_ = CalibrationDelta::Zero();
  Camera camera_;  // given_ changed by delta_
  bool contradicts_given_ = false;
  // What is kept: information matrix and vector, the prior included.
  Eigen::Matrix4d prior_, information_;
  Eigen::Vector4d information_vector_ = Eigen::Vector4d::Zero();
};

}  // namespace farpoint::slam
