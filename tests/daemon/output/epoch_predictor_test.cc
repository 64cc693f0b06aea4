// SPDX-License-Identifier: Apache-2.0
// What is true at the moment of sending.
#include "daemon/output/epoch_predictor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "farpoint/status_t.hpp"

namespace farpoint::daemon {
namespace {

constexpr std::int64_t kImage_us = 5'000'000;

FrameOutput tracked() {
  slam::FrameResult r;
  r.state = slam::State::kTracking;
  r.has_pose = true;
  r.scale = slam::ScaleState::kMetric;
  r.velocity_body << 10, 0, 0, 0, 0, 0.5;
  r.quality = 90;
  r.covariance = slam::Matrix6d::Identity() * 1e-4;
  return make_frame_output(r, 0.0);
}

EpochPredictor with(const FrameOutput& frame, double period_s = 0.1) {
  EpochOptions options;
  options.frame_period_s = period_s;
  options.boot_counter = 7;
  EpochPredictor predictor(options);
  predictor.take(frame, kImage_us);
  return predictor;
}

TEST(EpochPredictor, BeforeTheFirstImageItSaysThatItIsStarting) {
  const ipc::OdometryEpoch e = EpochPredictor(EpochOptions{}).at(kImage_us);
  EXPECT_EQ(e.state, int{status_t::STATE_STARTING});
  EXPECT_EQ(e.reason, ipc::Reason::kNoImageYet);
  EXPECT_TRUE(std::isnan(e.age_s));
  EXPECT_FALSE(e.pose_valid || e.velocity_valid || e.from_vision || e.predicted);
}

TEST(EpochPredictor, ThePoseIsThatOfTheMomentOfSendingAndTheAgeThatOfTheImage) {
  const EpochPredictor predictor = with(tracked());
  for (const std::int64_t dt_us : {0, 20'000, 70'000, 200'000}) {
    const ipc::OdometryEpoch e = predictor.at(kImage_us + dt_us);
    const double dt_s = 1e-6 * static_cast<double>(dt_us);
    EXPECT_NEAR(e.age_s, dt_s, 1e-9);
    // A circle of 20 m.
    EXPECT_NEAR(e.position_m[0], 20.0 * std::sin(0.5 * dt_s), 1e-3);
    EXPECT_NEAR(e.position_m[1], 20.0 * (1.0 - std::cos(0.5 * dt_s)), 1e-3);
    EXPECT_NEAR(e.heading_rad, 0.5 * dt_s, 1e-9);
    EXPECT_EQ(e.predicted, dt_us > 0);
    EXPECT_TRUE(e.pose_valid && e.velocity_valid);
    EXPECT_EQ(e.boot_counter, 7);
  }
}

TEST(EpochPredictor, BeyondOneFramePeriodItIsNotFromVision) {
  const EpochPredictor predictor = with(tracked());
  EXPECT_TRUE(predictor.at(kImage_us + 100'000).from_vision);
  const ipc::OdometryEpoch e = predictor.at(kImage_us + 100'001);
  EXPECT_FALSE(e.from_vision);
  EXPECT_TRUE(e.pose_valid);
}

TEST(EpochPredictor, AQuarterOfASecondAfterTheImageNothingIsValid) {
  const EpochPredictor predictor = with(tracked());
  EXPECT_TRUE(predictor.at(kImage_us + 250'000).pose_valid);
  const ipc::OdometryEpoch e = predictor.at(kImage_us + 250'001);
  EXPECT_FALSE(e.pose_valid || e.velocity_valid || e.from_vision);
  EXPECT_EQ(e.state, int{status_t::STATE_LOST});  // not 'tracking' any more, whichever thread hangs
  EXPECT_EQ(e.reason, ipc::Reason::kNoPoseInTime);
  EXPECT_EQ(e.quality, -1);
}

TEST(EpochPredictor, ACameraThatIsAwayMakesNoImageYounger) {
  EpochPredictor predictor = with(tracked());
  FrameOutput silence;
  silence.result.state = slam::State::kNoCamera;
  predictor.take(silence, kImage_us + 400'000);
  const ipc::OdometryEpoch e = predictor.at(kImage_us + 420'000);
  EXPECT_EQ(e.state, int{status_t::STATE_NO_CAMERA});
  EXPECT_EQ(e.reason, ipc::Reason::kNoCamera);
  EXPECT_NEAR(e.age_s, 0.42, 1e-9);
}

TEST(EpochPredictor, ThePeriodIsMeasuredAndAGapIsNone) {
  EpochPredictor predictor{EpochOptions{}};
  std::int64_t at_us = kImage_us;
  for (const std::int64_t step_us : {0, 40'000, 40'000, 1'200'000})
    predictor.take(tracked(), at_us += step_us);
  EXPECT_TRUE(predictor.at(at_us + 40'000).from_vision);
  EXPECT_FALSE(predictor.at(at_us + 41'000).from_vision);
}

TEST(EpochPredictor, EachStateHasItsReason) {
  const std::map<slam::State, ipc::Reason> reasons{
      {slam::State::kInitialising, ipc::Reason::kMapNotStarted},
      {slam::State::kSettling, ipc::Reason::kMapSettling},
      {slam::State::kTracking, ipc::Reason::kNone},
      {slam::State::kDegraded, ipc::Reason::kFewLandmarks},
      {slam::State::kLost, ipc::Reason::kTrackingLost},
      {slam::State::kRelocalising, ipc::Reason::kPlaceNotRecognised}};
  for (const auto& [state, reason] : reasons) {
    slam::FrameResult r = tracked().result;
    r.state = state;
    EXPECT_EQ(with(make_frame_output(r, 0.0)).at(kImage_us).reason, reason) << static_cast<int>(state);
  }
  slam::FrameResult wild = tracked().result;
  wild.T_odom_body.t.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(with(make_frame_output(wild, 0.0)).at(kImage_us).reason, ipc::Reason::kNumberOutOfRange);
  FrameOutput contradicted = tracked();
  contradicted.calibration_contradicted = true;
  EXPECT_EQ(with(contradicted).at(kImage_us).reason, ipc::Reason::kCalibrationContradicted);
}

TEST(EpochPredictor, NoStandardDeviationIsClaimed) {
  const ipc::OdometryEpoch e = with(tracked()).at(kImage_us);
  EXPECT_LT(e.sigma_position_m[0], 0.0);
  EXPECT_LT(e.sigma_heading_rad, 0.0);
  EXPECT_LT(e.sigma_velocity_m_s[0], 0.0);
}

TEST(EpochPredictor, TheFarewellGivesNoNumber) {
  const ipc::OdometryEpoch e = with(tracked()).farewell(kImage_us + 10'000);
  EXPECT_EQ(e.state, int{status_t::STATE_STOPPED});
  EXPECT_EQ(e.reason, ipc::Reason::kStopped);
  EXPECT_FALSE(e.pose_valid || e.velocity_valid || e.from_vision);
  EXPECT_TRUE(std::isnan(e.age_s));
  EXPECT_EQ(e.quality, -1);
}

}  // namespace
}  // namespace farpoint::daemon
