// SPDX-License-Identifier: Apache-2.0
// Attitudes and velocities as curves.
#include "tools/report/motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "slam/geometry/se3.h"
#include "tests/tools/tool_support.h"

namespace farpoint::tools::report {
namespace {

Eigen::Quaterniond turned(double roll_deg, double pitch_deg, double yaw_deg) {
  const double rad = std::numbers::pi / 180.0;
  return Eigen::AngleAxisd(yaw_deg * rad, Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(pitch_deg * rad, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(roll_deg * rad, Eigen::Vector3d::UnitX());
}

// A body that drives a circle to the left, 2 m/s ahead and 0.5 m/s to its left, at a rate in Hz.
Trajectory circle(double rate_hz) {
  Trajectory path;
  slam::SE3 pose;
  slam::Vector6d step;
  step << 2.0, 0.5, 0.0, 0.0, 0.0, 0.2;
  for (int i = 0; i < 200; ++i) {
    path.poses.push_back({i / rate_hz, pose, 0});
    // Small steps, so that the chord is the arc.
    for (int k = 0; k < 20; ++k) pose = pose.boxplus(step / (20.0 * rate_hz));
  }
  return path;
}

std::size_t breaks_in(const std::vector<Eigen::Vector2d>& points) {
  return static_cast<std::size_t>(
      std::count_if(points.begin(), points.end(), [](const Eigen::Vector2d& p) { return !p.allFinite(); }));
}

TEST(Motion, RollPitchAndYawAreThoseThatTurnedIt) {
  for (const auto& [roll, pitch, yaw] :
       {std::tuple(0.0, 0.0, 0.0), {10.0, -20.0, 170.0}, {-170.0, 5.0, -30.0}, {0.0, 89.0, 45.0}})
    EXPECT_TRUE(
        roll_pitch_yaw_deg(turned(roll, pitch, yaw)).isApprox(Eigen::Vector3d(roll, pitch, yaw), 1e-6));
}

TEST(Motion, AnglesAboutHalfATurnStayTogether) {
  const std::vector<TimedVector> angles = {
      {0.0, {179.0, 1.0, 0.0}}, {0.1, {-179.0, -1.0, 90.0}}, {0.2, {-178.0, 0.0, 0.0}}};
  const Eigen::Vector3d centre = mean_angles_deg(angles);
  EXPECT_NEAR(std::abs(centre.x()), 179.33, 0.01);
  EXPECT_NEAR(centre.y(), 0.0, 1e-9);
  const std::vector<TimedVector> together = angles_around(centre, angles);
  EXPECT_NEAR(std::abs(together[0].value.x() - together[1].value.x()), 2.0, 1e-9);
  EXPECT_NEAR(together[1].value.z(), 90.0, 1e-9);
}

TEST(Motion, AttitudeErrorIsAboutTheBodysAxes) {
  Trajectory truth, estimate;
  for (int i = 0; i < 10; ++i) {
    const Eigen::Quaterniond q = turned(0.0, 0.0, 90.0 + 3.0 * i);
    truth.poses.push_back({0.1 * i, {q, {0, 0, 0}}, 0});
    estimate.poses.push_back({0.1 * i, {q * turned(0.5, 0.0, 0.0), {0, 0, 0}}, 0});
  }
  const std::vector<TimedVector> errors = attitude_errors_deg(truth, estimate);
  ASSERT_EQ(errors.size(), 10U);
  for (const TimedVector& e : errors)
    EXPECT_TRUE(e.value.isApprox(Eigen::Vector3d(0.5, 0, 0), 1e-6)) << e.value;
}

TEST(Motion, VelocityIsInTheBodysAxesWhateverTheRate) {
  for (const double rate_hz : {10.0, 20.0, 200.0}) {
    const std::vector<TimedVector> velocities = velocities_of(circle(rate_hz));
    ASSERT_GT(velocities.size(), 150U);
    const TimedVector& middle = velocities[velocities.size() / 2];
    EXPECT_NEAR(middle.value.x(), 2.0, 0.01) << rate_hz;
    EXPECT_NEAR(middle.value.y(), 0.5, 0.01) << rate_hz;
  }
}

TEST(Motion, PosesFarApartHaveNoVelocity) {
  EXPECT_TRUE(velocities_of(circle(0.2)).empty());
  EXPECT_TRUE(velocities_of({}).empty());
}

TEST(Motion, DifferencesNeedTruthOfTheSameTime) {
  const std::vector<TimedVector> truth = {{1.0, {1, 0, 0}}, {2.0, {2, 0, 0}}};
  const std::vector<TimedVector> estimate = {
      {0.5, {5, 0, 0}}, {1.005, {5, 0, 0}}, {1.99, {5, 0, 0}}, {2.5, {5, 0, 0}}};
  const std::vector<TimedVector> errors = differences(truth, estimate);
  ASSERT_EQ(errors.size(), 2U);
  EXPECT_EQ(errors[0].value.x(), 4.0);
  EXPECT_EQ(errors[1].value.x(), 3.0);
  EXPECT_TRUE(differences({}, estimate).empty());
}

TEST(Motion, CurvesBreakWherePosesAreMissingAndAnglesWrap) {
  std::vector<TimedVector> angles;
  for (int i = 0; i < 100; ++i)
    if (i < 40 || i >= 50) angles.push_back({0.1 * i, {0, 0, i < 70 ? 179.0 : -179.0}});
  const std::vector<Eigen::Vector2d> points = component_over_time(angles, 2, 1.0, 8.0);
  EXPECT_EQ(breaks_in(points), 2U);
  EXPECT_NEAR(points.front().x(), 0.0, 1e-9);  // since start_s
  EXPECT_NEAR(points.back().x(), 7.0, 1e-9);

  Trajectory path = circle(10.0);
  EXPECT_EQ(breaks_in(plan_of(path)), 0U);
  path.poses.erase(path.poses.begin() + 50, path.poses.begin() + 80);
  for (std::size_t i = 100; i < path.poses.size(); ++i) path.poses[i].map_id = 2;
  EXPECT_EQ(breaks_in(plan_of(path)), 2U);
  EXPECT_EQ(of_map(2, path).poses.size(), 70U);
}

TEST(Motion, SimilarityMovesEveryPose) {
  const slam::Sim3 twice{2.0, turned(0, 0, 90), {1, 0, 0}};
  const Trajectory moved = moved_by(twice, circle(10.0));
  EXPECT_TRUE(moved.poses[0].pose.t.isApprox(Eigen::Vector3d(1, 0, 0), 1e-9));
  EXPECT_NEAR(way_along(moved).back(), 2.0 * way_along(circle(10.0)).back(), 1e-6);
}

}  // namespace
}  // namespace farpoint::tools::report
