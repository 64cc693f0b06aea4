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

SE3 as_se3(const Sim3& S) {
  return {S.q, S.t};
}

TEST(Odometry, BeginsAtItsOriginWhereverTheMapHasTheBody) {
  Odometry odometry;
  odometry.advance(pose(7, 3, 1.0));
  EXPECT_LT(difference(odometry.T_odom_body(), SE3{}), 1e-12);
}

TEST(Odometry, AddsEachMotionInTheBodysAxes) {
  Odometry odometry;
  const SE3 start = pose(7, 3, 1.0), turn = pose(2, 0, 0.5), straight = pose(1, 0, 0.0);
  odometry.advance(start);
  odometry.advance(start * turn);
  odometry.advance(start * turn * straight);
  EXPECT_LT(difference(odometry.T_odom_body(), turn * straight), 1e-12);
}

// Frames are lost between two poses: a map that has both tells the motion, also where it moved meanwhile.
TEST(Odometry, CarriesTheMotionOfAGapThatTheMapTellsAfterwards) {
  Odometry odometry;
  odometry.advance(pose(0, 0, 0));
  odometry.advance(pose(1, 0, 0));
  const SE3 correction = pose(0.3, -0.2, 0.1);
  odometry.correct(pose(1, 0, 0), correction * pose(1, 0, 0));
  odometry.advance(correction * pose(50, 0, 0));
  EXPECT_LT(difference(odometry.T_odom_body(), pose(50, 0, 0)), 1e-9);
}

TEST(Odometry, ANewMapAddsNoMotionFromTheOldOneAndRaisesTheCounter) {
  Odometry odometry;
  odometry.advance(pose(0, 0, 0));
  odometry.advance(pose(1, 0, 0));
  const std::uint32_t before = odometry.reset_counter();
  odometry.begin_map();
  odometry.advance(pose(50, 0, 0));
  EXPECT_LT(difference(odometry.T_odom_body(), pose(1, 0, 0)), 1e-12);
  EXPECT_GT(odometry.reset_counter(), before);
}

TEST(Odometry, IsNotMovedByACorrectionOfTheMap) {
  Odometry odometry;
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
  Odometry odometry;
  odometry.advance(pose(1, 2, 0.3));
  const SE3 correction = pose(0.3, -0.2, 0.1), other = pose(0, 1, 0.7);
  odometry.correct(other, correction * other);
  odometry.advance(correction * pose(1, 2, 0.3));
  EXPECT_LT(difference(odometry.T_odom_body(), SE3{}), 1e-12);
}

TEST(Odometry, MapFromOdomTakesTheBodyFromOdomToTheMap) {
  Odometry odometry;
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
  Odometry odometry;
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
  Odometry other;
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

TEST(Odometry, RaisesTheResetCounterWithEachMap) {
  Odometry odometry;
  EXPECT_EQ(odometry.reset_counter(), 0U);
  odometry.begin_map();
  odometry.begin_map();
  EXPECT_EQ(odometry.reset_counter(), 2U);
}

}  // namespace
}  // namespace farpoint::slam
