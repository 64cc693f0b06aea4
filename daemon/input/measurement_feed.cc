// SPDX-License-Identifier: Apache-2.0
#include "daemon/input/measurement_feed.h"

#include <cmath>
#include <limits>

namespace farpoint::daemon {

slam::ImuSample make_sample(const imu_t& message) {
  slam::ImuSample sample;
  sample.utime = message.utime;
  sample.gyro_rad_per_s = Eigen::Map<const Eigen::Vector3d>(message.angular_velocity);
  sample.accel_m_per_s2 = Eigen::Map<const Eigen::Vector3d>(message.acceleration);
  return sample;
}

slam::WheelSample make_sample(const wheels_t& message) {
  constexpr double kNoInformation = std::numeric_limits<double>::infinity();
  slam::WheelSample sample;
  sample.utime = message.utime;
  if (std::isnan(message.speed)) {
    sample.sigma_speed_m_per_s = kNoInformation;
  } else {
    sample.speed_m_per_s = message.speed;
    sample.sigma_speed_m_per_s = message.speed_sigma > 0.0 ? message.speed_sigma : 0.0;
  }
  if (std::isnan(message.yaw_rate))
    sample.sigma_yaw_rate_rad_per_s = kNoInformation;
  else
    sample.yaw_rate_rad_per_s = message.yaw_rate;
  return sample;
}

void MeasurementFeed::add(const imu_t& message) {
  (void)estimator_.add(make_sample(message));
}

void MeasurementFeed::add(const wheels_t& message) {
  if (std::isnan(message.speed) && std::isnan(message.yaw_rate)) {
    ++wheels_without_value_;
    return;
  }
  (void)estimator_.add(make_sample(message));
}

}  // namespace farpoint::daemon
