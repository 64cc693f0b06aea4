// SPDX-License-Identifier: Apache-2.0
#include "slam/uncertainty.h"

#include <cmath>

namespace farpoint::slam {

namespace {

// Error that all alignments between the images of a pair have in common: of interpolation, and of the
// calibration's field, which differs over the image. Level-0 pixels, 1 sigma.
constexpr double kPairBias_px = 0.02;
// Of the baseline as calibrated, relative: a millimetre a metre.
constexpr double kBaselineSigma = 0.001;

}  // namespace

Matrix6d OdometryErrors::since_reset(const SE3& T_odom_body) const {
  Matrix6d covariance = carried(T_odom_body.inverse(), drift) + noise;
  if (std::isnan(scale_sigma)) return covariance;
  Vector6d way = Vector6d::Zero();
  way.head<3>() = T_odom_body.q.conjugate() * T_odom_body.t;
  covariance += scale_sigma * scale_sigma * way * way.transpose();
  return covariance;
}

Uncertainty::Uncertainty(const Rig& rig) {
  if (rig.cameras.size() < 2) return;
  const double baseline_m = (rig.cameras[1].T_body_camera.t - rig.cameras[0].T_body_camera.t).norm();
  pair_sigma_per_m_ = kPairBias_px / (rig.cameras[0].camera.focal_px() * baseline_m);
}

void Uncertainty::begin_map() {
  errors_ = {};
  begun_ = false;
  waiting_.setZero();
}

// A common error of the pair's angles is a common error of all inverse depths: the further landmarks the
// translation hangs on, the larger a part of it.
double Uncertainty::scale_sigma(double holding_distance_m) const {
  return std::hypot(kBaselineSigma, pair_sigma_per_m_ * holding_distance_m);
}

void Uncertainty::advance(const SE3& T_odom_body, const PoseErrors& errors, double map_units,
                          std::uint64_t view_sequence, bool metric) {
  if (!errors.known) return;
  const double unit = 1.0 / map_units;
  errors_.noise = in_unit(errors.noise, unit);
  errors_.scale_sigma =
      metric ? scale_sigma(errors.holding_distance * unit) : std::numeric_limits<double>::infinity();
  if (!begun_) {
    errors_.drift = carried(T_odom_body, errors_.noise);
  } else {
    waiting_ += carried(T_odom_body, in_unit(errors.exchanged, unit));
    if (view_sequence != view_sequence_) {
      errors_.drift += waiting_;
      waiting_.setZero();
    }
  }
  begun_ = true;
  view_sequence_ = view_sequence;
}

}  // namespace farpoint::slam
