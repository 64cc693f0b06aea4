// SPDX-License-Identifier: Apache-2.0
#include "slam/odometry.h"

#include <algorithm>
#include <cmath>

namespace farpoint::slam {

namespace {

// Motion that is certainly none of the noise, in sigmas of the position.
constexpr double kMoving_sigmas = 5.0;
// Longest time whose turn a correction may take at once: a gap allows no step.
constexpr double kLongestStep_s = 0.25;

SE3 in_unit(SE3 T, double factor) {
  T.t *= factor;
  return T;
}

// Of a length of 1 whose part is taken: root of the change of its square.
double square_taken(double part) {
  return std::sqrt(1.0 - (1.0 - part) * (1.0 - part));
}

double shortened(double length, double most) {
  return length > most ? most / length : 1.0;
}

}  // namespace

void Odometry::begin_map() {
  ++resets_;
  has_last_ = false;
  follows_ = false;
  map_units_ = 1.0;
}

void Odometry::begin_unit(const SE3& T_map_body) {
  ++resets_;
  T_odom_body_.t *= map_units_;
  map_units_ = 1.0;
  aim_at(T_odom_body_, T_map_body);
  T_odom_body_corrected_ = T_odom_body_;
}

SE3 Odometry::target(const SE3& T_map_body) const {
  return T_odom_map_ * in_unit(T_map_body, 1.0 / map_units_);
}

void Odometry::aim_at(const SE3& T_odom_body, const SE3& T_map_body) {
  T_odom_map_ = T_odom_body * in_unit(T_map_body, 1.0 / map_units_).inverse();
}

void Odometry::advance(const SE3& T_map_body, std::int64_t utime, double sigma) {
  correction_.setZero();
  if (has_last_)
    T_odom_body_ = T_odom_body_ * in_unit(T_map_body_last_.inverse() * T_map_body, 1.0 / map_units_);
  T_map_body_last_ = T_map_body;
  if (!has_last_ || !follows_) {
    aim_at(T_odom_body_, T_map_body);
    T_odom_body_corrected_ = T_odom_body_;
    corrected_utime_ = utime;
  } else {
    take_corrections(T_map_body, utime, sigma / map_units_);
  }
  has_last_ = true;
}

void Odometry::carry(const SE3& T_from_to) {
  T_odom_body_ = T_odom_body_ * T_from_to;
  T_odom_body_corrected_ = T_odom_body_;  // unseen way allows no correction: it would come at once
  T_map_body_last_ = T_map_body_last_ * in_unit(T_from_to, map_units_);
}

void Odometry::take_corrections(const SE3& T_map_body, std::int64_t utime, double sigma) {
  const double way = (T_odom_body_.t - T_odom_body_corrected_.t).norm();
  if (way <= kMoving_sigmas * sigma) {
    corrected_utime_ = utime;  // time that the vehicle stands allows no turn
    return;
  }
  const double time_s = std::min(1e-6 * static_cast<double>(utime - corrected_utime_), kLongestStep_s);
  const SE3 missing = T_odom_body_.inverse() * target(T_map_body);
  const Eigen::AngleAxisd turn(missing.q);
  const double share = shortened(missing.t.norm(), config_.correction_share * way);
  const double turn_share = shortened(turn.angle(), config_.correction_rad_per_s * time_s);
  SE3 step;
  step.t = share * missing.t;
  step.q = Eigen::AngleAxisd(turn.angle() * turn_share, turn.axis());
  correction_ << square_taken(share) * missing.t, square_taken(turn_share) * turn.angle() * turn.axis();
  T_odom_body_ = T_odom_body_ * step;
  T_odom_body_corrected_ = T_odom_body_;
  corrected_utime_ = utime;
}

void Odometry::correct(const SE3& T_map_body_before, const SE3& T_map_body_after, double scale) {
  const SE3 before = target(T_map_body_before);
  map_units_ *= scale;
  // Another unit moves the map as a whole.
  if (scale != 1.0) aim_at(before, T_map_body_after);
  if (!has_last_) return;
  SE3 T_before_last = T_map_body_before.inverse() * T_map_body_last_;
  T_before_last.t *= scale;
  T_map_body_last_ = T_map_body_after * T_before_last;
}

Sim3 Odometry::map_from_odom(const SE3& T_map_body) const {
  SE3 T_body_odom = T_odom_body_.inverse();
  T_body_odom.t *= map_units_;
  const SE3 map_from_odom = T_map_body * T_body_odom;
  return Sim3{map_units_, map_from_odom.q, map_from_odom.t};
}

}  // namespace farpoint::slam
