// SPDX-License-Identifier: Apache-2.0
// Refines the calibration of two cameras and the rotation between them from the map.
//
// Rectified pairs leave tenths of a pixel: a lens whose distortion is not quite gone, rows that tilt. Between
// the cameras that is a false parallax, and as large as the true one of distant points. The same measurements
// that local BA uses also say what the rig is; gathered as in Calibrator, with the given rig as prior. The
// baseline stays: it is what makes the map metric.
//
// State, relative to the given rig: CalibrationDelta of the first camera, of the second, and the rotation
// vector of the second in its own axes, rad.
#pragma once

#include <vector>

#include "slam/config.h"
#include "slam/mapping/calibrator.h"
#include "slam/solver/bundle_problem.h"

namespace farpoint::slam {

class RigCalibrator {
 public:
  static constexpr int kSize = 11;
  using Delta = Eigen::Matrix<double, kSize, 1>;

  // Precondition: the rig has at least two cameras. Further ones are taken as right.
  RigCalibrator(const CalibrationConfig& config, const Rig& given);

  // Uses a window at the optimum of its poses and inverse depths. d_bearing_d_pixel: as Calibrator::update.
  // True where the estimate moved noticeably and rig() should be used from now on.
  bool update(const BundleProblem& problem,
              const std::vector<Eigen::Matrix<double, 3, 2>>& d_bearing_d_pixel);

  [[nodiscard]] const Rig& rig() const { return rig_; }
  [[nodiscard]] const Delta& delta() const { return delta_; }
  // 1 sigma of delta.
  [[nodiscard]] Delta sigma() const;

 private:
  using Square = Eigen::Matrix<double, kSize, kSize>;

  [[nodiscard]] Rig changed(const Delta& delta) const;

  CalibrationConfig config_;
  Rig given_, rig_;  // rig_: given_ changed by delta_
  Delta delta_ = Delta::Zero();
  Square prior_, information_;  // what is kept, the prior included
  Delta information_vector_ = Delta::Zero();
};

}  // namespace farpoint::slam
