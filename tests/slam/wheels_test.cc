// SPDX-License-Identifier: Apache-2.0
// The estimator with one camera and wheels, at the level of features.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <vector>

#include "slam/estimator.h"
#include "tests/scenes/simulator.h"

namespace farpoint::slam {
namespace {

constexpr double kFrame_s = 0.1;

sim::Scene small_scene() {
  sim::Scene scene = sim::make_scene("straight");
  scene.features = 500;
  return scene;
}

// A drive frame by frame; the vehicle may stand, the camera may be blind, and the wheels may tell anything.
class WheeledDrive {
 public:
  explicit WheeledDrive(const WheelConfig& wheels = {}) : scene_(small_scene()), simulator_(scene_, 3) {
    EstimatorConfig config = scene_.estimator(LandmarkMode::kVmp);
    config.wheels = wheels;
    estimator_.emplace(config, scene_.believed_rig());
  }

  struct Step {
    bool moves = true, blind = false;
    double wheel_factor = 1.0;  // of what the wheels say of the speed
  };
  FrameResult step(const Step& s) {
    const SE3 before = simulator_.truth(place_);
    if (s.moves) ++place_;
    const SE3 now = simulator_.truth(place_);
    const SE3 moved = before.inverse() * now;
    WheelSample sample{simulator_.utime(frame_) - static_cast<std::int64_t>(0.5e6 * kFrame_s),
                       moved.t.x() / kFrame_s, so3_log(moved.q).z() / kFrame_s, 0, 0};
    sample.speed_m_per_s *= s.wheel_factor;
    (void)estimator_->add(sample);
    FeatureInput input = simulator_.look(frame_, now, (now.t - simulator_.truth(0).t).norm()).input;
    if (s.blind) input.features = {};
    ++frame_;
    return estimator_->process(std::move(input));
  }
  FrameResult drive(int frames) {
    FrameResult last;
    for (int i = 0; i < frames; ++i) last = step({});
    return last;
  }
  [[nodiscard]] SE3 truth() { return simulator_.truth(place_); }
  Estimator& estimator() { return *estimator_; }

 private:
  sim::Scene scene_;
  sim::Simulator simulator_;
  std::optional<Estimator> estimator_;
  std::uint32_t frame_ = 0, place_ = 0;
};

double way(const SE3& from, const SE3& to) {
  return (to.t - from.t).norm();
}

TEST(EstimatorWithWheels, OneCameraIsMetricWithinTwoSecondsOfValidPosesAndResetsOnce) {
  WheeledDrive d;
  std::optional<std::int64_t> valid, metric;
  FrameResult r;
  for (int i = 0; i < 100; ++i) {
    r = d.step({});
    if (is_valid(r.state) && !valid) valid = r.utime;
    if (r.scale == ScaleState::kMetric && !metric) metric = r.utime;
  }
  ASSERT_TRUE(valid && metric);
  EXPECT_LE(*metric - *valid, 2'000'000);
  EXPECT_EQ(r.reset_counter, 2U) << "of the map, and of its unit";
  const SE3 from = d.truth(), odom_from = r.T_odom_body;
  r = d.drive(50);
  EXPECT_TRUE(is_valid(r.state));
  EXPECT_EQ(r.reset_counter, 2U);
  EXPECT_NEAR(way(odom_from, r.T_odom_body), way(from, d.truth()), 0.01 * way(from, d.truth()));
  EXPECT_NEAR(r.velocity_body.x(), 10.0, 1.5);
}

// A receiver takes differences of drift between messages of one reset counter.
TEST(EstimatorWithWheels, TheDriftBeginsAnewWithTheMetreAndSigmasAreThoseOfTheWheels) {
  WheeledDrive d;
  FrameResult r = d.step({});
  for (int i = 0; i < 100 && r.scale != ScaleState::kMetric; ++i) r = d.step({});
  ASSERT_EQ(r.scale, ScaleState::kMetric);
  EXPECT_EQ(r.metre, MetreSource::kWheels);
  EXPECT_EQ(r.wheels, WheelTrust::kTrusted);
  const SE3 T_body_odom = r.T_odom_body.inverse();
  EXPECT_TRUE(carried(T_body_odom, r.odometry.drift).isApprox(r.odometry.noise, 1e-6));
  EXPECT_GE(r.odometry.scale_sigma, WheelConfig{}.scale_sigma);
  EXPECT_LE(r.odometry.scale_sigma, 0.05);
  const double speed_sigma = std::sqrt(r.velocity_covariance(0, 0));
  EXPECT_GE(speed_sigma, r.odometry.scale_sigma * r.velocity_body.x()) << "the unit's error is the speed's";
}

TEST(EstimatorWithWheels, WithoutThemTheScaleStaysUnknown) {
  WheelConfig off;
  off.use = false;
  WheeledDrive d(off);
  const FrameResult r = d.drive(60);
  EXPECT_TRUE(is_valid(r.state));
  EXPECT_EQ(r.scale, ScaleState::kUnknown);
  EXPECT_EQ(r.reset_counter, 1U);
}

TEST(EstimatorWithWheels, AVehicleThatStandsKeepsItsPoseToTheBitAndMakesNoKeyframe) {
  WheeledDrive d;
  d.drive(80);
  FrameResult r;
  for (int i = 0; i < 8; ++i) r = d.step({.moves = false});
  const SE3 held = r.T_odom_body;
  for (int i = 0; i < 60; ++i) {
    r = d.step({.moves = false});
    EXPECT_TRUE(is_valid(r.state));
    EXPECT_FALSE(r.keyframe);
    EXPECT_EQ(r.T_odom_body.t, held.t);
    EXPECT_EQ(r.velocity_body.norm(), 0.0);
  }
  const SE3 from = d.truth();
  r = d.drive(10);
  EXPECT_TRUE(is_valid(r.state));
  EXPECT_NEAR(way(held, r.T_odom_body), way(from, d.truth()), 0.03 * way(from, d.truth()) + 0.02);
}

// Locked wheels slide, and sensors that count teeth read zero at walking pace.
TEST(EstimatorWithWheels, WheelsThatReadZeroDoNotHoldAVehicleThatImagesShowMoving) {
  WheeledDrive d;
  const SE3 odom_from = d.drive(80).T_odom_body, from = d.truth();
  FrameResult r;
  for (int i = 0; i < 10; ++i) r = d.step({.wheel_factor = 0.0});
  EXPECT_TRUE(is_valid(r.state));
  EXPECT_NEAR(way(odom_from, r.T_odom_body), way(from, d.truth()), 0.05 * way(from, d.truth()));
}

TEST(EstimatorWithWheels, BlindItGoesOnByWheelsForALimitedTimeAndWithoutAStepAfterwards) {
  WheelConfig config;
  config.blind_s = 1.0;
  WheeledDrive d(config);
  FrameResult r = d.drive(80);
  const SE3 odom_from = r.T_odom_body, from = d.truth();
  const Matrix6d drift_from = r.odometry.drift;
  for (int i = 0; i < 8; ++i) {
    r = d.step({.blind = true, .wheel_factor = 1.05});
    EXPECT_EQ(r.state, State::kDegraded);
    EXPECT_TRUE(r.has_pose);
    EXPECT_FALSE(r.from_vision);
    EXPECT_FALSE(r.keyframe);
    EXPECT_EQ(r.scale, ScaleState::kMetric);
    EXPECT_GT(r.covariance(0, 0), 0.0);
  }
  EXPECT_NEAR(way(odom_from, r.T_odom_body), 1.05 * way(from, d.truth()), 0.02 * way(from, d.truth()));
  const double blind_m = way(odom_from, r.T_odom_body);
  const Matrix6d grown = carried(r.T_odom_body.inverse(), r.odometry.drift - drift_from);
  EXPECT_NEAR(std::sqrt(grown(0, 0)), config.scale_sigma * blind_m + config.speed_sigma_mps * 0.8, 0.1);
  EXPECT_NEAR(std::sqrt(r.velocity_covariance(0, 0)),
              config.speed_sigma_mps + (config.scale_sigma + config.slip_sigma) * r.velocity_body.x(), 0.02);
  SE3 odom_last = r.T_odom_body, last = d.truth();
  for (int i = 0; i < 12; ++i) {
    r = d.step({});
    ASSERT_TRUE(r.has_pose) << i;
    EXPECT_NEAR(way(odom_last, r.T_odom_body), way(last, d.truth()), 0.15) << i;
    odom_last = r.T_odom_body;
    last = d.truth();
  }
  EXPECT_TRUE(r.from_vision);
  EXPECT_EQ(r.reset_counter, 2U);
  for (int i = 0; i < 11; ++i) r = d.step({.blind = true});
  EXPECT_EQ(r.state, State::kLost);
  EXPECT_FALSE(r.has_pose);
}

}  // namespace
}  // namespace farpoint::slam
