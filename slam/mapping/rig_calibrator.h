// SPDX-License-Identifier: Apache-2.0
// Refines two cameras' distortion and the rotation between them from the map.
//
// Rectified pairs leave tenths of a pixel: a lens whose distortion is not quite gone, a camera that was
// turned since. Between the cameras that is a false parallax, and as large as the true one of distant points.
// The same measurements that local BA uses also show the rig's error; gathered as in Calibrator, with the
// given rig as prior.
//
// Baseline and focal lengths stay: they make the map metric. Centres stay: the images hardly tell them from a
// rotation. With centres and focal lengths free the scale of KITTI raw 0039 is off by 0.7 %, without by 0.1
// %.
//
// State, relative to the given rig: first radial coefficient of each camera, and the rotation vector of the
// second camera in its own axes, rad.
#pragma once

#include <vector>

#include "slam/config.h"
#include "slam/mapping/calibrator.h"
#include "slam/solver/bundle_problem.h"

namespace farpoint::slam {

class RigCalibrator {
 public:
  static constexpr int kSize = 5;
  using Delta = Eigen::Matrix<double, kSize, 1>;

  // Precondition: the rig has at least two cameras. Further ones are taken as right.
  RigCalibrator(const CalibrationConfig& config, const Rig& given);

  // Uses a window at the optimum of its poses and inverse depths. d_bearing_d_pixel: as Calibrator::update.
  // True where the estimate moved noticeably and rig() should be used from now on.
  bool update(const BundleProblem& problem,
              const std::vector<Eigen::Matrix<double, 3, 2>>& d_bearing_d_pixel);

  [[nodiscard]] const Rig& rig() const { return rig_; }
  // As CalibrationEstimate.
  [[nodiscard]] const Delta& delta() const { return estimate_.delta(); }
  [[nodiscard]] Delta sigma() const { return estimate_.sigma(); }
  [[nodiscard]] double surprise() const { return estimate_.surprise(); }
  [[nodiscard]] bool contradicts_given() const { return estimate_.contradicts_given(); }

 private:
  [[nodiscard]] Rig changed(const Delta& delta) const;

  CalibrationConfig config_;
  Rig given_, rig_;  // rig_: given_ changed by the estimate
  CalibrationEstimate<kSize> estimate_;
};

}  // namespace farpoint::slam
