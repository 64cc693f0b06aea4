// SPDX-License-Identifier: Apache-2.0
#include "slam/uncertainty.h"

#include <algorithm>
#include <cmath>

namespace farpoint::slam {

namespace {

// Error that all alignments between the images of a pair have in common: of interpolation, and of the
// calibration's field, which differs over the image. Level-0 pixels, 1 sigma.
constexpr double kPairBias_px = 0.01;
// Of the baseline as calibrated, relative: half a millimetre a metre.
constexpr double kBaselineSigma = 0.0005;
// The map's corrections swing to and fro: a part of each is drift, the rest takes an earlier one back.
constexpr double kLastingCorrection = 0.15;

}  // namespace

Matrix6d OdometryErrors::since_reset(const SE3& T_odom_body) const {
  Matrix6d covariance = without_scale(T_odom_body);
  if (!std::isfinite(scale_sigma)) return covariance;
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

void Uncertainty::begin() {
  errors_ = {};
  begun_ = false;
}

// A common error of the pair's angles is a common error of all inverse depths: the further landmarks the
// translation hangs on, the larger a part of it.
double Uncertainty::scale_sigma(const OdometryStep& step, double holding_distance_m) const {
  if (!step.metric) return std::numeric_limits<double>::infinity();
  if (step.unit_sigma > 0.0) return step.unit_sigma;
  return std::hypot(kBaselineSigma, pair_sigma_per_m_ * holding_distance_m);
}

void Uncertainty::advance(const OdometryStep& step, const PoseErrors& errors) {
  if (!errors.known) return;
  const double unit = 1.0 / step.map_units;
  errors_.noise = in_unit(errors.noise, unit);
  errors_.scale_sigma = scale_sigma(step, errors.holding_distance * unit);
  if (begun_)
    grow(step, in_unit(errors.exchanged, unit));
  else
    begin_drift(step);
  view_sequence_ = step.view_sequence;
  utime_ = step.utime;
}

void Uncertainty::carry(const SE3& T_odom_body, std::int64_t utime, const Matrix6d& covariance) {
  if (!begun_) return;
  add_drift(carried(T_odom_body, covariance), utime);
  utime_ = utime;
}

void Uncertainty::begin_drift(const OdometryStep& step) {
  errors_.drift = carried(step.T_odom_body, errors_.noise);
  errors_.drift_of_second.setZero();
  waiting_.setZero();
  begun_ = true;
}

void Uncertainty::grow(const OdometryStep& step, const Matrix6d& exchanged) {
  const Matrix6d correction = kLastingCorrection * step.correction * step.correction.transpose();
  waiting_ += carried(step.T_odom_body, exchanged);
  Matrix6d growth = carried(step.T_odom_body, correction);
  if (step.view_sequence != view_sequence_) {
    growth += waiting_;
    waiting_.setZero();
  }
  add_drift(growth, step.utime);
}

void Uncertainty::add_drift(const Matrix6d& growth, std::int64_t utime) {
  constexpr double kSecond_s = 1.0;
  errors_.drift += growth;
  const double time_s = 1e-6 * static_cast<double>(utime - utime_);
  errors_.drift_of_second *= 1.0 - std::clamp(time_s / kSecond_s, 0.0, 1.0);
  errors_.drift_of_second += growth;
}

}  // namespace farpoint::slam
