// SPDX-License-Identifier: Apache-2.0
#include "slam/fusion/wheel_track.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace farpoint::slam {

namespace {

constexpr double kSeconds = 1e-6;

bool is_valid(const WheelSample& s) {
  return std::isfinite(s.speed_m_per_s) && std::isfinite(s.yaw_rate_rad_per_s) &&
         std::isfinite(s.sigma_speed_m_per_s) && std::isfinite(s.sigma_yaw_rate_rad_per_s) &&
         s.sigma_speed_m_per_s >= 0.0 && s.sigma_yaw_rate_rad_per_s >= 0.0;
}

// Reading at a time between two samples.
WheelSample interpolated(const WheelSample& a, const WheelSample& b, std::int64_t utime) {
  const double share = static_cast<double>(utime - a.utime) / static_cast<double>(b.utime - a.utime);
  const auto mix = [share](double from, double to) { return from + share * (to - from); };
  return {utime, mix(a.speed_m_per_s, b.speed_m_per_s), mix(a.yaw_rate_rad_per_s, b.yaw_rate_rad_per_s),
          mix(a.sigma_speed_m_per_s, b.sigma_speed_m_per_s),
          mix(a.sigma_yaw_rate_rad_per_s, b.sigma_yaw_rate_rad_per_s)};
}

// Displacement along an arc of constant turn, in the axes of its start.
Eigen::Vector2d arc(double length_m, double turn_rad) {
  const double half = 0.5 * turn_rad;
  const double chord = std::fabs(half) < 1e-6 ? 1.0 : std::sin(half) / half;
  return length_m * chord * Eigen::Vector2d(std::cos(half), std::sin(half));
}

// Appends the motion from one reading to the next. Errors of readings are independent of one another.
void append(const WheelSample& a, const WheelSample& b, double sigma_slip_m_per_s, WheelMotion* motion) {
  const double dt_s = static_cast<double>(b.utime - a.utime) * kSeconds;
  const double speed = 0.5 * (a.speed_m_per_s + b.speed_m_per_s);
  const double turn = 0.5 * (a.yaw_rate_rad_per_s + b.yaw_rate_rad_per_s) * dt_s;
  const Eigen::Matrix2d R = Eigen::Rotation2Dd(motion->yaw_rad).toRotationMatrix();
  const Eigen::Vector2d step = R * arc(speed * dt_s, turn);

  Eigen::Matrix3d carry = Eigen::Matrix3d::Identity();  // of the errors so far
  carry.topRightCorner<2, 1>() = Eigen::Vector2d(-step.y(), step.x());
  Eigen::Matrix3d enter = Eigen::Matrix3d::Identity();  // of this stretch's: along, across, turn
  enter.topLeftCorner<2, 2>() = R;
  enter.topRightCorner<2, 1>() = 0.5 * Eigen::Vector2d(-step.y(), step.x());
  const Eigen::Vector3d sigma =
      dt_s * Eigen::Vector3d(0.5 * (a.sigma_speed_m_per_s + b.sigma_speed_m_per_s), sigma_slip_m_per_s,
                             0.5 * (a.sigma_yaw_rate_rad_per_s + b.sigma_yaw_rate_rad_per_s));
  motion->covariance = carry * motion->covariance * carry.transpose() +
                       enter * sigma.cwiseAbs2().asDiagonal() * enter.transpose();
  motion->displacement_m += step;
  motion->yaw_rad += turn;
}

}  // namespace

WheelTrack::WheelTrack(const WheelOptions& options)
    : options_(options), ring_(std::max<std::size_t>(options.capacity, 2)) {}

bool WheelTrack::add(const WheelSample& given) {
  if (!is_valid(given)) {
    ++counts_.invalid;
    return false;
  }
  if (size_ > 0 && given.utime <= sample(size_ - 1).utime) {
    ++counts_.late;
    return false;
  }
  if (size_ == ring_.size()) {
    first_ = (first_ + 1) % ring_.size();
    --size_;
  }
  ring_[(first_ + size_) % ring_.size()] = with_sigmas(given);
  ++size_;
  ++counts_.taken;
  return true;
}

WheelSample WheelTrack::with_sigmas(WheelSample s) const {
  if (s.sigma_speed_m_per_s == 0.0) s.sigma_speed_m_per_s = options_.sigma_speed_m_per_s;
  if (s.sigma_yaw_rate_rad_per_s == 0.0) s.sigma_yaw_rate_rad_per_s = options_.sigma_yaw_rate_rad_per_s;
  return s;
}

bool WheelTrack::is_gap(std::int64_t from_utime, std::int64_t to_utime) const {
  return static_cast<double>(to_utime - from_utime) * kSeconds > options_.max_gap_s;
}

// Index of the first sample later than a time; size() where there is none.
std::size_t WheelTrack::first_after(std::int64_t utime) const {
  std::size_t low = 0, high = size_;
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    if (sample(middle).utime <= utime)
      low = middle + 1;
    else
      high = middle;
  }
  return low;
}

std::optional<WheelMotion> WheelTrack::between(std::int64_t from_utime, std::int64_t to_utime) const {
  if (size_ < 2 || from_utime >= to_utime || from_utime < sample(0).utime ||
      to_utime > sample(size_ - 1).utime)
    return std::nullopt;
  WheelMotion motion;
  motion.from_utime = from_utime;
  motion.to_utime = to_utime;
  std::size_t next = first_after(from_utime);
  WheelSample at = interpolated(sample(next - 1), sample(next), from_utime);
  for (;; ++next) {
    const WheelSample& before = sample(next - 1);
    const WheelSample& after = sample(next);
    if (is_gap(before.utime, after.utime)) return std::nullopt;
    const bool last = after.utime >= to_utime;
    const WheelSample end = last ? interpolated(before, after, to_utime) : after;
    append(at, end, options_.sigma_slip_m_per_s, &motion);
    if (last) return motion;
    at = end;
  }
}

std::optional<WheelMotion> WheelTrack::up_to(std::int64_t from_utime, std::int64_t to_utime) const {
  if (size_ == 0 || from_utime >= to_utime) return std::nullopt;
  const WheelSample& newest = sample(size_ - 1);
  if (to_utime <= newest.utime) return between(from_utime, to_utime);
  if (is_gap(newest.utime, to_utime)) return std::nullopt;
  WheelMotion motion;
  motion.from_utime = from_utime;
  if (from_utime < newest.utime) {
    const std::optional<WheelMotion> known = between(from_utime, newest.utime);
    if (!known) return std::nullopt;
    motion = *known;
  }
  WheelSample start = newest, end = newest;
  start.utime = std::max(from_utime, newest.utime);
  end.utime = motion.to_utime = to_utime;
  append(start, end, options_.sigma_slip_m_per_s, &motion);
  return motion;
}

}  // namespace farpoint::slam
