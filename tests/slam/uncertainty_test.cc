// SPDX-License-Identifier: Apache-2.0
#include "slam/uncertainty.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

namespace farpoint::slam {
namespace {

Camera camera() {
  Camera::Parameters p;
  p.width_px = 640, p.height_px = 480;
  p.fx_px = 400, p.fy_px = 400, p.cx_px = 320, p.cy_px = 240;
  return Camera(p);
}

Rig rig(double baseline_m) {
  Rig rig;
  rig.cameras.push_back({"left", camera(), SE3{}});
  if (baseline_m > 0.0)
    rig.cameras.push_back({"right", camera(), SE3{Eigen::Quaterniond::Identity(), {0, -baseline_m, 0}}});
  return rig;
}

PoseErrors errors(double noise, double exchanged) {
  PoseErrors e;
  e.noise = noise * Matrix6d::Identity();
  e.exchanged = exchanged * Matrix6d::Identity();
  e.holding_distance = 20.0;
  e.known = true;
  return e;
}

OdometryStep step(int frame, std::uint64_t view) {
  OdometryStep s;
  s.T_odom_body = {so3_exp({0, 0, 0.1 * frame}), {1.0 * frame, 0, 0}};
  s.utime = 100'000 * frame;
  s.view_sequence = view;
  s.metric = true;
  return s;
}

double least_eigenvalue(const Matrix6d& m) {
  return Eigen::SelfAdjointEigenSolver<Matrix6d>(m).eigenvalues().minCoeff();
}

class UncertaintyTest : public testing::Test {
 protected:
  Uncertainty uncertainty{rig(0.5)};
  [[nodiscard]] const Matrix6d& drift() const { return uncertainty.errors().drift; }
};

TEST_F(UncertaintyTest, ANewMapsIsUnknownUntilAPoseSaysIt) {
  EXPECT_TRUE(drift().array().isNaN().all());
  uncertainty.advance(step(1, 1), PoseErrors{});
  EXPECT_TRUE(uncertainty.errors().noise.array().isNaN().all());
  uncertainty.advance(step(2, 1), errors(0.01, 0.5));
  EXPECT_TRUE(drift().allFinite());
  uncertainty.begin();
  EXPECT_TRUE(drift().array().isNaN().all());
}

TEST_F(UncertaintyTest, TheFirstPoseHasItsNoiseTwiceAndNothingDriftedYet) {
  const OdometryStep first = step(3, 1);
  uncertainty.advance(first, errors(0.01, 0.5));
  const Matrix6d body = carried(first.T_odom_body.inverse(), drift());
  EXPECT_TRUE(body.isApprox(0.01 * Matrix6d::Identity(), 1e-9));
  EXPECT_TRUE(uncertainty.errors().drift_of_second.isZero());
}

TEST_F(UncertaintyTest, NothingDriftsWhileFramesHangOnTheSameView) {
  uncertainty.advance(step(0, 1), errors(0.01, 0.0));
  const Matrix6d before = drift();
  for (int i = 1; i < 5; ++i) uncertainty.advance(step(i, 1), errors(0.01, 0.02));
  EXPECT_EQ(drift(), before);
  // The next view brings what four frames and its own exchanged.
  uncertainty.advance(step(5, 2), errors(0.01, 0.02));
  Matrix6d expected = before;
  for (int i = 1; i <= 5; ++i) expected += carried(step(i, 1).T_odom_body, 0.02 * Matrix6d::Identity());
  EXPECT_TRUE(drift().isApprox(expected, 1e-9));
}

// The rule that receivers apply gives what was exchanged, in the axes of the later pose.
TEST_F(UncertaintyTest, TheDriftOfAMotionIsWhatWasExchangedInTheAxesOfItsEnd) {
  uncertainty.advance(step(40, 1), errors(0.01, 0.0));
  const Matrix6d a = drift();
  uncertainty.advance(step(41, 2), errors(0.01, 0.02));
  const Matrix6d of_motion = carried(step(41, 2).T_odom_body.inverse(), drift() - a);
  EXPECT_TRUE(of_motion.isApprox(0.02 * Matrix6d::Identity(), 1e-6));
}

TEST_F(UncertaintyTest, AWayByAnotherSensorAddsItsCovarianceToTheDriftAtOnce) {
  const Matrix6d of_way = 0.05 * Matrix6d::Identity();
  uncertainty.carry(step(39, 1).T_odom_body, step(39, 1).utime, of_way);
  EXPECT_TRUE(drift().array().isNaN().all()) << "no pose has begun it";
  uncertainty.advance(step(40, 1), errors(0.01, 0.0));
  const Matrix6d a = drift();
  uncertainty.carry(step(41, 1).T_odom_body, step(41, 1).utime, of_way);
  const Matrix6d of_motion = carried(step(41, 1).T_odom_body.inverse(), drift() - a);
  EXPECT_TRUE(of_motion.isApprox(of_way, 1e-6));
  EXPECT_TRUE(uncertainty.errors().drift_of_second.isApprox(drift() - a, 1e-6));
}

TEST_F(UncertaintyTest, TheScalesSigmaIsThatOfWhatGaveTheMetre) {
  OdometryStep s = step(0, 1);
  s.metric = true;
  uncertainty.advance(s, errors(0.01, 0.0));
  EXPECT_LT(uncertainty.errors().scale_sigma, 0.01) << "the pair's";
  s.unit_sigma = 0.03;
  uncertainty.advance(s, errors(0.01, 0.0));
  EXPECT_EQ(uncertainty.errors().scale_sigma, 0.03) << "the wheels'";
  s.metric = false;
  uncertainty.advance(s, errors(0.01, 0.0));
  EXPECT_TRUE(std::isinf(uncertainty.errors().scale_sigma));
}

TEST_F(UncertaintyTest, DriftNeverFalls) {
  uncertainty.advance(step(0, 1), errors(0.01, 0.0));
  Matrix6d before = drift();
  for (int i = 1; i < 50; ++i) {
    OdometryStep s = step(i, static_cast<std::uint64_t>(i) / 3);
    if (i % 7 == 0) s.correction << 0.1, -0.2, 0, 0, 0, 0.01;
    uncertainty.advance(s, errors(0.01 + 0.001 * (i % 5), i % 4 == 0 ? 0.0 : 0.02));
    EXPECT_GT(least_eigenvalue(drift() - before), -1e-9) << i;
    before = drift();
  }
}

TEST_F(UncertaintyTest, ACorrectionOfTheMapIsDriftAlongItsDirection) {
  uncertainty.advance(step(0, 1), errors(0.01, 0.0));
  const Matrix6d before = drift();
  OdometryStep s = step(0, 1);
  s.correction << 0.2, 0, 0, 0, 0, 0;
  uncertainty.advance(s, errors(0.01, 0.0));
  const Matrix6d grown = drift() - before;
  EXPECT_GT(grown(0, 0), 0.1 * 0.2 * 0.2);
  EXPECT_LE(grown(0, 0), 0.2 * 0.2);
  EXPECT_NEAR(grown.trace(), grown(0, 0), 1e-12);
}

TEST_F(UncertaintyTest, TheDriftOfASecondForgetsWhatIsOlder) {
  uncertainty.advance(step(0, 1), errors(0.01, 0.0));
  for (int i = 1; i <= 100; ++i)
    uncertainty.advance(step(0, static_cast<std::uint64_t>(i) + 1), errors(0.01, 0.02));
  OdometryStep s = step(0, 200);
  for (int i = 1; i <= 60; ++i) {
    s.utime = 100'000 * i;
    s.view_sequence = 200 + static_cast<std::uint64_t>(i);
    uncertainty.advance(s, errors(0.01, 0.02));
  }
  EXPECT_NEAR(uncertainty.errors().drift_of_second(0, 0), 10 * 0.02, 0.01);
  EXPECT_GT(drift()(0, 0), 100 * 0.02);
}

TEST_F(UncertaintyTest, LengthsAreInOdomsUnit) {
  OdometryStep s = step(0, 1);
  s.T_odom_body = SE3{};
  s.map_units = 4.0;
  uncertainty.advance(s, errors(0.16, 0.0));
  EXPECT_NEAR(uncertainty.errors().noise(0, 0), 0.01, 1e-12);
  EXPECT_NEAR(uncertainty.errors().noise(5, 5), 0.16, 1e-12);
}

// The same error of an angle between the pair's images is a larger part of a smaller parallax.
TEST_F(UncertaintyTest, TheScaleIsLessKnownTheFurtherTheLandmarksAndTheShorterTheBaseline) {
  const auto sigma = [](double baseline_m, double distance_m) {
    Uncertainty u(rig(baseline_m));
    PoseErrors e = errors(0.01, 0.0);
    e.holding_distance = distance_m;
    u.advance(step(0, 1), e);
    return u.errors().scale_sigma;
  };
  EXPECT_LT(sigma(0.5, 10.0), sigma(0.5, 100.0));
  EXPECT_LT(sigma(0.5, 100.0), sigma(0.1, 100.0));
  EXPECT_GT(sigma(0.5, 0.1), 1e-4);  // no baseline is exact
  EXPECT_LT(sigma(0.1, 10.0), 0.05);
}

TEST_F(UncertaintyTest, AMapWithoutScaleHasNoSigmaOfItAndAMarginalAllTheSame) {
  OdometryStep s = step(5, 1);
  s.metric = false;
  uncertainty.advance(s, errors(0.01, 0.0));
  EXPECT_TRUE(std::isinf(uncertainty.errors().scale_sigma));
  EXPECT_TRUE(uncertainty.errors().since_reset(s.T_odom_body).allFinite());
}

TEST(OdometryErrors, TheMarginalHasTheScalesPartAlongTheWay) {
  OdometryErrors e;
  e.noise = e.drift = e.drift_of_second = Matrix6d::Zero();
  e.scale_sigma = 0.01;
  const SE3 T{so3_exp({0, 0, 0.5 * 3.14159265358979}), {100.0, 0, 0}};  // looks left, went ahead
  const Matrix6d marginal = e.since_reset(T);
  EXPECT_NEAR(marginal(1, 1), 1.0, 1e-6);  // along its right side
  EXPECT_NEAR(marginal(0, 0), 0.0, 1e-6);
  EXPECT_TRUE(e.without_scale(T).isZero());
}

}  // namespace
}  // namespace farpoint::slam
