// SPDX-License-Identifier: Apache-2.0
#include "slam/tracking/velocity_filter.h"

#include <cmath>

namespace farpoint::slam {

namespace {

// Of vehicles. Spectral density of the jerk: brakes and steering change an acceleration by 1 to 2 m/s^2, or
// 0.3 to 0.7 rad/s^2, in half a second.
constexpr double kJerk_m2_per_s5 = 5.0, kAngularJerk_rad2_per_s5 = 0.5;
// Before the first motions: 1 sigma.
constexpr double kAcceleration_m_per_s2 = 4.0, kAngularAcceleration_rad_per_s2 = 1.0;

constexpr std::size_t kTranslations = 3;

// The velocity times the time that leads along an arc to this motion: the translation turned back by half of
// the turn.
Vector6d arc_of(const SE3& T_before_now) {
  Vector6d moved;
  moved.tail<3>() = so3_log(T_before_now.q);
  moved.head<3>() = so3_exp(-0.5 * moved.tail<3>()) * T_before_now.t;
  return moved;
}

Eigen::Matrix3d transition(double dt_s) {
  Eigen::Matrix3d F = Eigen::Matrix3d::Identity();
  F(0, 1) = F(1, 2) = dt_s;
  F(0, 2) = 0.5 * dt_s * dt_s;
  return F;
}

// Of white jerk of unit density.
Eigen::Matrix3d process_noise(double dt_s) {
  const double t2 = dt_s * dt_s, t3 = t2 * dt_s;
  Eigen::Matrix3d Q;
  Q << t3 * t2 / 20.0, t2 * t2 / 8.0, t3 / 6.0,  //
      t2 * t2 / 8.0, t3 / 3.0, t2 / 2.0,         //
      t3 / 6.0, t2 / 2.0, dt_s;
  return Q;
}

}  // namespace

void VelocityFilter::clear() {
  begun_ = false;
}

void VelocityFilter::begin(const Vector6d& moved, double dt_s, const Vector6d& noise, double metre) {
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    const double acceleration =
        i < kTranslations ? kAcceleration_m_per_s2 * metre : kAngularAcceleration_rad_per_s2;
    const double change = 0.5 * acceleration * dt_s;
    axes_[i].x = {0.0, moved[axis] / dt_s, 0.0};
    axes_[i].P = Eigen::Vector3d(noise[axis], 2.0 * noise[axis] / (dt_s * dt_s) + change * change,
                                 acceleration * acceleration)
                     .asDiagonal();
  }
  begun_ = true;
}

void VelocityFilter::advance(const SE3& T_before_now, double dt_s, const Vector6d& noise, double metre) {
  if (!(dt_s > 0.0) || dt_s > kLongest_s || !noise.allFinite()) {
    clear();
    return;
  }
  const Vector6d moved = arc_of(T_before_now);
  if (!begun_) {
    begin(moved, dt_s, noise, metre);
    return;
  }
  const Eigen::Matrix3d F = transition(dt_s), Q = process_noise(dt_s);
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    const double density = i < kTranslations ? kJerk_m2_per_s5 * metre * metre : kAngularJerk_rad2_per_s5;
    Axis& a = axes_[i];
    a.x = F * a.x;
    a.P = F * a.P * F.transpose() + density * Q;
    const Eigen::Vector3d gain = a.P.col(0) / (a.P(0, 0) + noise[axis]);
    a.x += gain * (moved[axis] - a.x[0]);
    const Eigen::Matrix3d P = a.P - gain * a.P.row(0);
    a.P = 0.5 * (P + P.transpose());
    a.x[0] -= moved[axis];  // against the newest pose as measured
  }
}

void VelocityFilter::change_unit(double factor) {
  for (std::size_t i = 0; i < kTranslations; ++i) {
    axes_[i].x *= factor;
    axes_[i].P *= factor * factor;
  }
}

Vector6d VelocityFilter::velocity() const {
  Vector6d v = Vector6d::Zero();
  if (!begun_) return v;
  for (std::size_t i = 0; i < axes_.size(); ++i) v[static_cast<Eigen::Index>(i)] = axes_[i].x[1];
  return v;
}

Matrix6d VelocityFilter::covariance() const {
  if (!begun_) return unknown_covariance();
  Matrix6d c = Matrix6d::Zero();
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    const auto axis = static_cast<Eigen::Index>(i);
    c(axis, axis) = axes_[i].P(1, 1);
  }
  return c;
}

}  // namespace farpoint::slam
