// SPDX-License-Identifier: Apache-2.0
// IMU and wheel encoders: measurements of the true motion.
#pragma once

#include <cstdint>

#include "farpoint/imu_t.hpp"
#include "farpoint/wheels_t.hpp"
#include "tools/simulate/sensors/vehicle_motion.h"
#include "tools/simulate/world/random.h"

namespace farpoint::tools::simulate {

constexpr double kGravity_mps2 = 9.80665;

// Exact angular velocity and specific force in the axes of an IMU that is fixed to the body.
struct InertialTruth {
  Eigen::Vector3d angular_velocity, specific_force;
};
[[nodiscard]] InertialTruth inertial_truth(const BodyPath& body, const slam::SE3& T_body_imu, double time_s);

class ImuSensor {
 public:
  ImuSensor(const ImuDescription& description, std::uint64_t seed);
  // Samples must be taken in order, since the biases walk.
  [[nodiscard]] imu_t sample(const BodyPath& body, double time_s);

 private:
  [[nodiscard]] Eigen::Vector3d normal3(double sigma);

  ImuDescription d_;
  Random random_;
  Eigen::Vector3d gyro_bias_, accel_bias_;
};

class WheelSensor {
 public:
  WheelSensor(const WheelsDescription& description, std::uint64_t seed);
  [[nodiscard]] wheels_t sample(const BodyPath& body, double time_s);

 private:
  WheelsDescription d_;
  Random random_;
  double scale_;
};

}  // namespace farpoint::tools::simulate
