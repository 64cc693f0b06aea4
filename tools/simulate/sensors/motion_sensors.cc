// SPDX-License-Identifier: Apache-2.0
#include "tools/simulate/sensors/motion_sensors.h"

#include <cmath>
#include <limits>

namespace farpoint::tools::simulate {
namespace {

std::int64_t to_utime(double time_s) {
  return std::llround(time_s * 1e6);
}

}  // namespace

InertialTruth inertial_truth(const BodyPath& body, const slam::SE3& T_body_imu, double time_s) {
  constexpr double kStep_s = 1e-4;
  const Motion motion = body.at(time_s);
  const Eigen::Vector3d turn = motion.angular_velocity_b;
  const Eigen::Vector3d turn_rate =
      (body.at(time_s + kStep_s).angular_velocity_b - body.at(time_s - kStep_s).angular_velocity_b) /
      (2.0 * kStep_s);
  const Eigen::Vector3d up(0, 0, kGravity_mps2), lever = T_body_imu.t;
  const Eigen::Vector3d force_b = motion.T_world_body.q.conjugate() * (motion.acceleration_w + up) +
                                  turn_rate.cross(lever) + turn.cross(turn.cross(lever));
  return {T_body_imu.q.conjugate() * turn, T_body_imu.q.conjugate() * force_b};
}

ImuSensor::ImuSensor(const ImuDescription& description, std::uint64_t seed)
    : d_(description), random_(seed_of(seed, "imu")) {
  gyro_bias_ = normal3(d_.gyro_bias_sigma);
  accel_bias_ = normal3(d_.accel_bias_sigma);
}

Eigen::Vector3d ImuSensor::normal3(double sigma) {
  const double x = random_.normal(), y = random_.normal(), z = random_.normal();
  return sigma * Eigen::Vector3d(x, y, z);
}

imu_t ImuSensor::sample(const BodyPath& body, double time_s) {
  const InertialTruth truth = inertial_truth(body, d_.T_body_imu, time_s);
  // White noise of a density becomes a deviation by the bandwidth; a random walk grows with the time between.
  const double root_rate = std::sqrt(d_.rate_hz);
  gyro_bias_ += normal3(d_.gyro_random_walk / root_rate);
  accel_bias_ += normal3(d_.accel_random_walk / root_rate);
  const Eigen::Vector3d turn =
      truth.angular_velocity + gyro_bias_ + normal3(d_.gyro_noise_density * root_rate);
  const Eigen::Vector3d force =
      truth.specific_force + accel_bias_ + normal3(d_.accel_noise_density * root_rate);
  imu_t message{};
  message.utime = to_utime(time_s);
  for (int i = 0; i < 3; ++i) {
    message.angular_velocity[i] = turn[i];
    message.acceleration[i] = force[i];
  }
  message.temperature = std::numeric_limits<double>::quiet_NaN();
  return message;
}

WheelSensor::WheelSensor(const WheelsDescription& description, std::uint64_t seed)
    : d_(description),
      random_(seed_of(seed, "wheels")),
      scale_(1.0 + description.scale_error * random_.normal()) {}

wheels_t WheelSensor::sample(const BodyPath& body, double time_s) {
  const Motion motion = body.at(time_s);
  const Eigen::Vector3d velocity_b = motion.T_world_body.q.conjugate() * motion.velocity_w;
  const double acceleration = (motion.T_world_body.q.conjugate() * motion.acceleration_w).x();
  const double turn = motion.angular_velocity_b.z();
  // Driven and braked wheels turn faster and slower than the road passes below.
  const double slipping = scale_ * (1.0 + d_.slip * acceleration);
  wheels_t message{};
  message.utime = to_utime(time_s);
  message.steering_angle = motion.steering_rad;
  message.yaw_rate = std::numeric_limits<double>::quiet_NaN();
  message.nwheels = 4;
  for (int i = 0; i < 4; ++i) {
    const double side = i % 2 == 0 ? -0.5 : 0.5;  // left wheels turn slower in a left bend
    const double rear = velocity_b.x() + side * d_.track_m * turn;
    const double speed = i < 2 ? std::copysign(std::hypot(rear, d_.wheelbase_m * turn), rear) : rear;
    message.wheel_speed.push_back(slipping * speed + d_.noise_mps * random_.normal());
  }
  message.speed = 0.5 * (message.wheel_speed[2] + message.wheel_speed[3]);
  message.speed_sigma = std::hypot(d_.noise_mps / std::sqrt(2.0), (d_.scale_error + d_.slip) * message.speed);
  return message;
}

}  // namespace farpoint::tools::simulate
