// SPDX-License-Identifier: Apache-2.0
// The true motion and what the inertial and wheel sensors make of it.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/simulate/small_worlds.h"
#include "tools/simulate/sensors/motion_sensors.h"

namespace farpoint::tools::simulate {
namespace {

class MotionOf : public testing::TestWithParam<const char*> {};

TEST_P(MotionOf, IntegratedInertialTruthGivesTheTrajectoryBack) {
  const Simulation simulation(request_for(GetParam(), 64, 48, 40.0));
  const BodyPath& body = simulation.body();
  const slam::SE3 T_body_imu{Eigen::Quaterniond::Identity(), {0.3, -0.2, 0.5}};
  constexpr double kStep_s = 1e-3;
  const Motion start = body.at(0.0);
  slam::SE3 imu = start.T_world_body * T_body_imu;
  Eigen::Vector3d velocity =
      start.velocity_w + start.T_world_body.q * start.angular_velocity_b.cross(T_body_imu.t);
  for (int i = 0; i < 30'000; ++i) {
    const double middle_s = (i + 0.5) * kStep_s;
    const InertialTruth truth = inertial_truth(body, T_body_imu, middle_s);
    const Eigen::Quaterniond q_middle = imu.q * slam::so3_exp(0.5 * kStep_s * truth.angular_velocity);
    const Eigen::Vector3d acceleration =
        q_middle * truth.specific_force - Eigen::Vector3d(0, 0, kGravity_mps2);
    imu.t += kStep_s * velocity + 0.5 * kStep_s * kStep_s * acceleration;
    velocity += kStep_s * acceleration;
    imu.q = (imu.q * slam::so3_exp(kStep_s * truth.angular_velocity)).normalized();
  }
  const slam::SE3 expected = body.pose_at(30.0) * T_body_imu;
  EXPECT_LT((imu.t - expected.t).norm(), 0.02) << "after 30 s";
  EXPECT_LT(imu.q.angularDistance(expected.q), 1e-4);
}

TEST_P(MotionOf, VelocityIsTheDerivativeOfThePosition) {
  const Simulation simulation(request_for(GetParam(), 64, 48, 40.0));
  constexpr double kStep_s = 1e-5;
  for (double t = 1.0; t < 38.0; t += 0.37) {
    const Motion motion = simulation.body().at(t);
    const slam::SE3 before = simulation.body().pose_at(t - kStep_s),
                    after = simulation.body().pose_at(t + kStep_s);
    EXPECT_LT(((after.t - before.t) / (2 * kStep_s) - motion.velocity_w).norm(), 1e-6);
    const Eigen::Vector3d turn = slam::so3_log(before.q.conjugate() * after.q) / (2 * kStep_s);
    EXPECT_LT((turn - motion.angular_velocity_b).norm(), 1e-6);
  }
}

INSTANTIATE_TEST_SUITE_P(Worlds, MotionOf, testing::Values("town", "highway", "valley", "hover", "yard"),
                         [](const testing::TestParamInfo<const char*>& info) {
                           return std::string(info.param);
                         });

TEST(Drive, KeepsToItsLimits) {
  const Simulation simulation(request_for("town", 64, 48, 120.0));
  const DriveDescription& drive = *simulation.description().drive;
  double path_m = 0.0;
  for (double t = 2.0; t < 120.0; t += 0.05) {
    const Motion motion = simulation.body().at(t);
    const Eigen::Vector3d a_b = motion.T_world_body.q.conjugate() * motion.acceleration_w;
    EXPECT_LT(motion.velocity_w.norm(), 1.05 * drive.speed_mps);
    EXPECT_LT(std::abs(a_b.x()), 2.0 * drive.acceleration_mps2 + 0.3);
    EXPECT_LT(std::abs(a_b.y()), 2.0 * drive.lateral_acceleration_mps2);
    path_m += 0.05 * motion.velocity_w.norm();
  }
  EXPECT_GT(path_m, 600.0);
}

TEST(ImuSensor, HasTheNoiseOfItsDataSheet) {
  const Simulation simulation(request_for("town", 64, 48, 20.0));
  ImuDescription imu = *simulation.description().imu;
  imu.gyro_random_walk = imu.accel_random_walk = imu.gyro_bias_sigma = imu.accel_bias_sigma = 0.0;
  ImuSensor sensor(imu, 3);
  double gyro2 = 0.0, accel2 = 0.0;
  constexpr int kSamples = 3000;
  for (int i = 0; i < kSamples; ++i) {
    const double t = i / imu.rate_hz;
    const InertialTruth truth = inertial_truth(simulation.body(), imu.T_body_imu, t);
    const imu_t sample = sensor.sample(simulation.body(), t);
    for (int k = 0; k < 3; ++k) {
      gyro2 += std::pow(sample.angular_velocity[k] - truth.angular_velocity[k], 2) / (3.0 * kSamples);
      accel2 += std::pow(sample.acceleration[k] - truth.specific_force[k], 2) / (3.0 * kSamples);
    }
  }
  EXPECT_NEAR(std::sqrt(gyro2) / (imu.gyro_noise_density * std::sqrt(imu.rate_hz)), 1.0, 0.05);
  EXPECT_NEAR(std::sqrt(accel2) / (imu.accel_noise_density * std::sqrt(imu.rate_hz)), 1.0, 0.05);
}

TEST(WheelSensor, FollowsTheSpeedWithinItsErrors) {
  const Simulation simulation(request_for("town", 64, 48, 60.0));
  WheelSensor sensor(*simulation.description().wheels, 5);
  for (double t = 0.0; t < 55.0; t += 0.02) {
    const wheels_t sample = sensor.sample(simulation.body(), t);
    const Motion motion = simulation.body().at(t);
    EXPECT_NEAR(sample.speed, motion.velocity_w.norm(), 0.08 * motion.velocity_w.norm() + 0.15);
    EXPECT_EQ(sample.wheel_speed.size(), 4U);
    const double turn =
        (sample.wheel_speed[3] - sample.wheel_speed[2]) / simulation.description().wheels->track_m;
    EXPECT_NEAR(turn, motion.angular_velocity_b.z(), 0.15);
  }
}

}  // namespace
}  // namespace farpoint::tools::simulate
