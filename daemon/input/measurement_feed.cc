// SPDX-License-Identifier: Apache-2.0
#include "daemon/input/measurement_feed.h"

#include <cmath>
#include <limits>
#include <optional>
#include <utility>

namespace farpoint::daemon {

namespace {

// Left and right wheel of one axle: the rear one of four wheels, since steering turns the front ones.
std::optional<std::pair<double, double>> axle_of(const wheels_t& message) {
  const auto wheel = [&](std::size_t i) { return message.wheel_speed[i]; };
  std::size_t left = 0;
  if (message.wheel_speed.size() == 4)
    left = 2;
  else if (message.wheel_speed.size() != 2)
    return std::nullopt;
  if (!std::isfinite(wheel(left)) || !std::isfinite(wheel(left + 1))) return std::nullopt;
  return std::pair{wheel(left), wheel(left + 1)};
}

void set_yaw_rate(const wheels_t& message, const slam::WheelConfig& config, slam::WheelSample* sample) {
  constexpr double kNoInformation = std::numeric_limits<double>::infinity();
  // Rolling radii of one axle's tyres differ by a few thousandths, by wear and pressure.
  constexpr double kRadii = 0.003;
  if (!std::isnan(message.yaw_rate)) {
    sample->yaw_rate_rad_per_s = message.yaw_rate;
    return;
  }
  const auto axle = axle_of(message);
  if (!axle || config.track_m <= 0.0) {
    sample->sigma_yaw_rate_rad_per_s = kNoInformation;
    return;
  }
  const auto [left, right] = *axle;
  sample->yaw_rate_rad_per_s = (right - left) / config.track_m;
  sample->sigma_yaw_rate_rad_per_s =
      std::hypot(config.yaw_rate_sigma_radps, kRadii * 0.5 * (left + right) / config.track_m);
}

}  // namespace

slam::ImuSample make_sample(const imu_t& message) {
  slam::ImuSample sample;
  sample.utime = message.utime;
  sample.gyro_rad_per_s = Eigen::Map<const Eigen::Vector3d>(message.angular_velocity);
  sample.accel_m_per_s2 = Eigen::Map<const Eigen::Vector3d>(message.acceleration);
  return sample;
}

slam::WheelSample make_sample(const wheels_t& message, const slam::WheelConfig& config) {
  constexpr double kNoInformation = std::numeric_limits<double>::infinity();
  slam::WheelSample sample;
  sample.utime = message.utime;
  if (std::isnan(message.speed)) {
    sample.sigma_speed_m_per_s = kNoInformation;
  } else {
    sample.speed_m_per_s = message.speed;
    sample.sigma_speed_m_per_s = message.speed_sigma > 0.0 ? message.speed_sigma : 0.0;
  }
  set_yaw_rate(message, config, &sample);
  return sample;
}

void MeasurementFeed::add(const imu_t& message) {
  (void)estimator_.add(make_sample(message));
}

void MeasurementFeed::add(const wheels_t& message) {
  const slam::WheelSample sample = make_sample(message, wheels_);
  if (std::isinf(sample.sigma_speed_m_per_s) && std::isinf(sample.sigma_yaw_rate_rad_per_s)) {
    ++wheels_without_value_;
    return;
  }
  (void)estimator_.add(sample);
}

}  // namespace farpoint::daemon
