// SPDX-License-Identifier: Apache-2.0
#include "slam/odometry.h"

#include <gtest/gtest.h>

namespace farpoint::slam {
namespace {

SE3 pose(double x, double y, double heading) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ())), {x, y, 0.0}};
}

double difference(const SE3& a, const SE3& b) {
  return a.q.angularDistance(b.q) + (a.t - b.t).norm();
}

constexpr std::int64_t kFrame_us = 100'000;

// Counts time on with each pose.
class TimedOdometry : public Odometry {
 public:
  explicit TimedOdometry(const OdometryConfig& config = {}) : Odometry(config) {}
  void advance(const SE3& T_map_body, double sigma = 0.0) {
    Odometry::advance(T_map_body, utime_ += kFrame_us, sigma);
  }

 private:
  std::int64_t utime_ = 0;
};

SE3 as_se3(const Sim3& S) {
  return {S.q, S.t};
}

TEST(Odometry, BeginsAtItsOriginWhereverTheMapHasTheBody) {
  TimedOdometry odometry;
  odometry.advance(pose(7, 3, 1.0));
  EXPECT_LT(difference(odometry.T_odom_body(), SE3{}), 1e-12);
}

TEST(Odometry, AddsEachMotionInTheBodysAxes) {
  TimedOdometry odometry;
  const SE3 start = pose(7, 3, 1.0), turn = pose(2, 0, 0.5), straight = pose(1, 0, 0.0);
  odometry.advance(start);
  odometry.advance(start * turn);
  odometry.advance(start * turn * straight);
  EXPECT_LT(difference(odometry.T_odom_body(), turn * straight), 1e-12);
}

// Frames are lost between two poses: a map that has both tells the motion, also where it moved meanwhile.
TEST(Odometry, CarriesTheMotionOfAGapThatTheMapTellsAfterwards) {
  TimedOdometry odometry;
  odometry.advance(pose(0, 0, 0));
  odometry.advance(pose(1, 0, 0));
  const SE3 correction = pose(0.3, -0.2, 0.1);
  odometry.correct(pose(1, 0, 0), correction * pose(1, 0, 0));
  odometry.advance(correction * pose(50, 0, 0));
  EXPECT_LT(difference(odometry.T_odom_body(), pose(50, 0, 0)), 1e-9);
}

TEST(Odometry, ANewMapAddsNoMotionFromTheOldOneAndRaisesTheCounter) {
  TimedOdometry odometry;
  odometry.advance(pose(0, 0, 0));
  odometry.advance(pose(1, 0, 0));
  const std::uint32_t before = odometry.reset_counter();
  odometry.begin_map();
  odometry.advance(pose(50, 0, 0));
  EXPECT_LT(difference(odometry.T_odom_body(), pose(1, 0, 0)), 1e-12);
  EXPECT_GT(odometry.reset_counter(), before);
}

TEST(Odometry, IsNotMovedByACorrectionOfTheMap) {
  TimedOdometry odometry;
  odometry.advance(pose(0, 0, 0));
  odometry.advance(pose(1, 0, 0));
  const SE3 correction = pose(0.3, -0.2, 0.1);
  odometry.correct(pose(1, 0, 0), correction * pose(1, 0, 0));
  EXPECT_LT(difference(odometry.T_odom_body(), pose(1, 0, 0)), 1e-12);
  odometry.advance(correction * pose(2, 0, 0));
  EXPECT_LT(difference(odometry.T_odom_body(), pose(2, 0, 0)), 1e-12);
}

// The pose corrected need not be the one added last: the correction is that of its keyframe.
TEST(Odometry, CarriesACorrectionOverToThePoseAddedLast) {
  TimedOdometry odometry;
  odometry.advance(pose(1, 2, 0.3));
  const SE3 correction = pose(0.3, -0.2, 0.1), other = pose(0, 1, 0.7);
  odometry.correct(other, correction * other);
  odometry.advance(correction * pose(1, 2, 0.3));
  EXPECT_LT(difference(odometry.T_odom_body(), SE3{}), 1e-12);
}

TEST(Odometry, MapFromOdomTakesTheBodyFromOdomToTheMap) {
  TimedOdometry odometry;
  odometry.advance(pose(7, 3, 1.0));
  const SE3 T_map_body = pose(7, 3, 1.0) * pose(2, 0, 0.5);
  odometry.advance(T_map_body);
  const Sim3 map_from_odom = odometry.map_from_odom(T_map_body);
  EXPECT_EQ(map_from_odom.scale, 1.0);
  EXPECT_LT(difference(as_se3(map_from_odom) * odometry.T_odom_body(), T_map_body), 1e-12);
  EXPECT_GT(difference(as_se3(map_from_odom), SE3{}), 1.0);
}

// The map doubles and turns: another unit, other axes, the same body.
class OdometryOfARescaledMap : public ::testing::Test {
 protected:
  OdometryOfARescaledMap() {
    odometry.advance(start);
    odometry.advance(start * step);
    odometry.correct(start * step, S * (start * step), S.scale);
  }
  const SE3 start = pose(7, 3, 1.0), step = pose(2, 1, 0.5);
  const Sim3 S{2.0, pose(0, 0, 0.7).q, {1, -4, 0}};
  TimedOdometry odometry;
};

TEST_F(OdometryOfARescaledMap, KeepsItsPoseAndItsUnit) {
  EXPECT_LT(difference(odometry.T_odom_body(), step), 1e-12);
  odometry.advance(S * (start * step * step));
  EXPECT_LT(difference(odometry.T_odom_body(), step * step), 1e-12);
  EXPECT_EQ(odometry.reset_counter(), 0U);
}

TEST_F(OdometryOfARescaledMap, MapFromOdomTakesUpScaleAndCorrection) {
  const SE3 T_map_body = S * (start * step * step);
  odometry.advance(T_map_body);
  const Sim3 map_from_odom = odometry.map_from_odom(T_map_body);
  EXPECT_EQ(map_from_odom.scale, 2.0);
  EXPECT_LT(difference(map_from_odom * odometry.T_odom_body(), T_map_body), 1e-12);
  // The body's first pose too, which is odom's origin.
  EXPECT_LT(difference(map_from_odom * SE3{}, S * start), 1e-12);
}

TEST_F(OdometryOfARescaledMap, PoseAddedLastMayBeAnotherThanTheOneCorrected) {
  TimedOdometry other;
  other.advance(start);
  other.correct(start * step, S * (start * step), S.scale);
  other.advance(S * start);
  EXPECT_LT(difference(other.T_odom_body(), SE3{}), 1e-12);
}

TEST_F(OdometryOfARescaledMap, ANewMapHasOdomsUnit) {
  odometry.begin_map();
  odometry.advance(start);
  odometry.advance(start * step);
  EXPECT_EQ(odometry.map_from_odom(start * step).scale, 1.0);
  EXPECT_LT(difference(odometry.T_odom_body(), step * step), 1e-12);
}

// A settled map moves by a little under a vehicle that drives straight on at a metre a frame.
class OdometryOfASettledMap : public ::testing::Test {
 protected:
  OdometryOfASettledMap() {
    odometry.follow_map();
    odometry.advance(pose(0, 0, 0));
    odometry.advance(pose(1, 0, 0));
    odometry.correct(pose(1, 0, 0), moved * pose(1, 0, 0));
  }
  // Where odom would be had it followed the map at once.
  [[nodiscard]] double missing(double x) const {
    return difference(odometry.T_odom_body(), moved * pose(x, 0, 0));
  }

  const OdometryConfig config{.correction_share = 0.1, .correction_rad_per_s = 0.02};
  const SE3 moved = pose(0.0, 0.35, 0.005);
  TimedOdometry odometry{config};
};

TEST_F(OdometryOfASettledMap, ACorrectionIsNoStep) {
  EXPECT_LT(difference(odometry.T_odom_body(), pose(1, 0, 0)), 1e-12);
}

TEST_F(OdometryOfASettledMap, ACorrectionFlowsInByAShareOfTheWayAndARateOfTurn) {
  SE3 before = odometry.T_odom_body();
  for (int x = 2; x < 10; ++x) {
    odometry.advance(moved * pose(x, 0, 0));
    const SE3 motion = before.inverse() * odometry.T_odom_body();
    EXPECT_LE((motion.t - Eigen::Vector3d::UnitX()).norm(), 0.1 + 1e-3) << x;
    EXPECT_LE(motion.q.angularDistance(Eigen::Quaterniond::Identity()), 0.02 * 0.1 + 1e-9) << x;
    before = odometry.T_odom_body();
  }
  EXPECT_LT(missing(9), 1e-6);
}

TEST_F(OdometryOfASettledMap, AVehicleThatStandsTakesNone) {
  odometry.advance(moved * pose(1.001, 0, 0), 0.01);
  const SE3 stood = odometry.T_odom_body();
  for (int i = 0; i < 50; ++i) odometry.advance(moved * pose(1.001, 0, 0), 0.01);
  EXPECT_LT(difference(odometry.T_odom_body(), stood), 1e-12);
  // Nor the turn of all that time at once when it drives on.
  odometry.advance(moved * pose(2, 0, 0), 0.01);
  EXPECT_LE(odometry.T_odom_body().q.angularDistance(stood.q), 0.02 * 0.25 + 1e-9);
}

TEST_F(OdometryOfASettledMap, AGapAllowsNoStepOfTheHeading) {
  odometry.Odometry::advance(moved * pose(40, 0, 0), 5'000'000, 0.0);
  EXPECT_LE(odometry.T_odom_body().q.angularDistance(Eigen::Quaterniond::Identity()), 0.02 * 0.25 + 1e-9);
}

TEST_F(OdometryOfASettledMap, AChangeOfUnitGoesIntoMapFromOdomAlone) {
  for (int x = 2; x < 10; ++x) odometry.advance(moved * pose(x, 0, 0));
  const SE3 at = odometry.T_odom_body();
  const Sim3 S{2.0, Eigen::Quaterniond::Identity(), {0, 0, 0}};
  odometry.correct(moved * pose(9, 0, 0), S * (moved * pose(9, 0, 0)), 2.0);
  odometry.advance(S * (moved * pose(10, 0, 0)));
  EXPECT_LT(difference(odometry.T_odom_body(), at * pose(1, 0, 0)), 1e-9);
}

TEST(Odometry, AMapThatHasNotSettledCorrectsNothing) {
  TimedOdometry odometry;
  odometry.advance(pose(0, 0, 0));
  odometry.correct(pose(0, 0, 0), pose(0, 1, 0.1));
  for (int x = 1; x < 30; ++x) odometry.advance(pose(0, 1, 0.1) * pose(x, 0, 0));
  EXPECT_LT(difference(odometry.T_odom_body(), pose(29, 0, 0)), 1e-9);
}

TEST(Odometry, RaisesTheResetCounterWithEachMap) {
  TimedOdometry odometry;
  EXPECT_EQ(odometry.reset_counter(), 0U);
  odometry.begin_map();
  odometry.begin_map();
  EXPECT_EQ(odometry.reset_counter(), 2U);
}

}  // namespace
}  // namespace farpoint::slam
