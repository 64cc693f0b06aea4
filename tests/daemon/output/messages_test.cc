// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/messages.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace farpoint::daemon {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

slam::FrameResult tracked_result() {
  slam::FrameResult r;
  r.utime = 1'234'567;
  r.sequence = 12;
  r.state = slam::State::kTracking;
  r.has_pose = true;
  r.T_map_body = {slam::so3_exp({0.1, 0.2, 0.3}), {1.0, 2.0, 3.0}};
  r.T_odom_body = {slam::so3_exp({0.0, 0.2, 0.3}), {4.0, 5.0, 6.0}};
  r.map_from_odom = {1.5, slam::so3_exp({0.1, 0.0, 0.0}), {7.0, 8.0, 9.0}};
  r.velocity_body << 10.0, 11.0, 12.0, 0.4, 0.5, 0.6;
  r.covariance = slam::Matrix6d::Identity() * 0.25;
  r.covariance(0, 5) = r.covariance(5, 0) = 0.01;
  r.velocity_covariance = slam::Matrix6d::Identity() * 0.04;
  r.odometry.noise = slam::Matrix6d::Identity() * 0.01;
  r.odometry.drift = slam::Matrix6d::Identity() * 0.02;
  r.odometry.drift_of_second = slam::Matrix6d::Identity() * 0.005;
  r.odometry.scale_sigma = 0.1;
  r.quality = 80;
  r.reset_counter = 3;
  r.map_id = 2;
  return r;
}

TEST(FrameOutput, AssumedScaleTurnsEveryLengthIntoMetres) {
  const FrameOutput f = make_frame_output(tracked_result(), 2.0);
  EXPECT_TRUE(f.valid);
  EXPECT_EQ(f.result.scale, slam::ScaleState::kAssumed);
  EXPECT_EQ(f.result.T_map_body.t, Eigen::Vector3d(2.0, 4.0, 6.0));
  EXPECT_EQ(f.result.T_odom_body.t, Eigen::Vector3d(8.0, 10.0, 12.0));
  EXPECT_EQ(f.result.velocity_body.head<3>(), Eigen::Vector3d(20.0, 22.0, 24.0));
  EXPECT_EQ(f.result.velocity_body.tail<3>(), Eigen::Vector3d(0.4, 0.5, 0.6));
  EXPECT_DOUBLE_EQ(f.result.covariance(0, 0), 1.0);   // squared
  EXPECT_DOUBLE_EQ(f.result.covariance(5, 5), 0.25);  // rad^2
  EXPECT_DOUBLE_EQ(f.result.covariance(0, 5), 0.02);
  // map_from_odom still maps odom into map.
  const slam::FrameResult raw = tracked_result();
  const Eigen::Vector3d p_odom(0.3, -0.2, 5.0);
  EXPECT_TRUE((f.result.map_from_odom * (2.0 * p_odom)).isApprox(2.0 * (raw.map_from_odom * p_odom), 1e-12));
}

TEST(FrameOutput, AssumedScaleTurnsTheLengthsOfTheOdometrysErrorsIntoMetres) {
  const slam::FrameResult r = make_frame_output(tracked_result(), 2.0).result;
  EXPECT_DOUBLE_EQ(r.odometry.noise(0, 0), 0.04);
  EXPECT_DOUBLE_EQ(r.odometry.noise(4, 4), 0.01);
  EXPECT_DOUBLE_EQ(r.odometry.drift(1, 1), 0.08);
  EXPECT_DOUBLE_EQ(r.odometry.drift_of_second(1, 1), 0.02);
  EXPECT_DOUBLE_EQ(r.velocity_covariance(2, 2), 0.16);
  EXPECT_TRUE(std::isnan(r.odometry.scale_sigma));  // the key has none
}

// A camera 1.2 m ahead of the axle and half a metre beside it, in map units of 2 m. The vehicle turns on the
// spot.
TEST(FrameOutput, WithAnAssumedScaleThePoseIsTheBodysAndNotTheCameras) {
  const Eigen::Vector3d lever_m(1.2, 0.5, 0.0);
  const double turn = 0.7, rate = 0.3;
  const Eigen::Quaterniond q = slam::so3_exp({0, 0, turn});
  slam::FrameResult r = tracked_result();
  r.T_odom_body = {q, (q * lever_m - lever_m) / 2.0};
  r.T_map_body = r.T_odom_body;
  r.map_from_odom = slam::Sim3{};
  r.velocity_body << 0.5 * Eigen::Vector3d(0, 0, rate).cross(lever_m), 0, 0, rate;
  const slam::FrameResult body = make_frame_output(r, 2.0, lever_m).result;
  EXPECT_LT(body.T_odom_body.t.norm(), 1e-12);
  EXPECT_LT(body.T_map_body.t.norm(), 1e-12);
  EXPECT_LT(body.velocity_body.head<3>().norm(), 1e-12);
  EXPECT_DOUBLE_EQ(body.velocity_body[5], rate);
  EXPECT_LT(body.map_from_odom.t.norm(), 1e-12);
  // The yaw's error moves the axle across, 1.2 m behind the camera.
  EXPECT_NEAR(body.odometry.noise(1, 1), 4.0 * 0.01 + 1.2 * 1.2 * 0.01, 1e-12);
  // A map of unknown unit has no place for the lever arm.
  EXPECT_EQ(make_frame_output(r, 0.0, lever_m).result.T_odom_body.t, r.T_odom_body.t);
}

TEST(FrameOutput, TheLeverArmLeavesMapAndOdomTogether) {
  const slam::FrameResult r = tracked_result();
  const slam::FrameResult moved = make_frame_output(r, 2.0, {1.2, 0.5, -0.3}).result;
  const slam::FrameResult still = make_frame_output(r, 2.0).result;
  const Eigen::Vector3d lever(1.2, 0.5, -0.3), p(3.0, -4.0, 5.0);
  EXPECT_TRUE((moved.map_from_odom * (p + lever)).isApprox(still.map_from_odom * p + lever, 1e-12));
}

TEST(FrameOutput, NoAssumedScaleChangesNothingAndAMeasuredOneWins) {
  const FrameOutput f = make_frame_output(tracked_result(), 0.0);
  EXPECT_EQ(f.result.scale, slam::ScaleState::kUnknown);
  EXPECT_EQ(f.result.T_map_body.t, Eigen::Vector3d(1.0, 2.0, 3.0));
  slam::FrameResult metric = tracked_result();
  metric.scale = slam::ScaleState::kMetric;
  EXPECT_EQ(make_frame_output(metric, 2.0).result.T_map_body.t, Eigen::Vector3d(1.0, 2.0, 3.0));
  EXPECT_EQ(make_frame_output(metric, 2.0).result.scale, slam::ScaleState::kMetric);
}

TEST(FrameOutput, OnlyTrackingAndDegradedPosesThatAreFiniteAreValid) {
  for (int state = 0; state <= 7; ++state) {
    slam::FrameResult r = tracked_result();
    r.state = static_cast<slam::State>(state);
    EXPECT_EQ(make_frame_output(r, 0.0).valid, state == 3 || state == 4) << state;
  }
  slam::FrameResult r = tracked_result();
  r.has_pose = false;
  EXPECT_FALSE(make_frame_output(r, 0.0).valid);
  r = tracked_result();
  r.T_map_body.t.y() = kNan;
  EXPECT_FALSE(make_frame_output(r, 1.0).valid);
  r = tracked_result();
  r.velocity_body(4) = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(make_frame_output(r, 0.0).valid);
}

TEST(Messages, ValidFrame) {
  const FrameOutput f = make_frame_output(tracked_result(), 0.0);
  const odometry_t o = make_odometry(f);
  EXPECT_EQ(o.utime, 1'234'567);
  EXPECT_EQ(o.publish_utime, o.utime);  // lockstep: derived from utime
  EXPECT_EQ(o.sequence, 12);
  EXPECT_EQ(o.position[2], 6.0);
  EXPECT_DOUBLE_EQ(o.orientation[0], f.result.T_odom_body.q.w());
  EXPECT_DOUBLE_EQ(o.orientation[3], f.result.T_odom_body.q.z());
  EXPECT_EQ(o.velocity[1], 11.0);
  EXPECT_EQ(o.angular_velocity[2], 0.6);
  EXPECT_EQ(o.noise_covariance[1][1], 0.01);
  EXPECT_EQ(o.drift_covariance[5][5], 0.02);
  EXPECT_EQ(o.twist_covariance[3][3], 0.04);
  EXPECT_EQ(o.scale_sigma, 0.1);
  const slam::Matrix6d marginal = f.result.odometry.since_reset(f.result.T_odom_body);
  for (int row = 0; row < 6; ++row)
    for (int column = 0; column < 6; ++column)
      EXPECT_EQ(o.pose_covariance[row][column], marginal(row, column));
  EXPECT_GT(o.pose_covariance[0][0] + o.pose_covariance[1][1] + o.pose_covariance[2][2], 0.1 * 0.1 * 77.0);
  EXPECT_EQ(o.boot_counter, 0);
  EXPECT_EQ(o.state, static_cast<int>(status_t::STATE_TRACKING));
  EXPECT_EQ(o.scale_state, static_cast<int>(status_t::SCALE_UNKNOWN));
  EXPECT_EQ(o.quality, 80);
  EXPECT_EQ(o.valid, 1);
  EXPECT_EQ(o.map_id, 2);
  EXPECT_EQ(o.reset_counter, 3);
  const pose_t p = make_pose(f);
  EXPECT_EQ(p.position[0], 1.0);
  EXPECT_EQ(p.covariance[5][0], 0.01);
  EXPECT_EQ(p.quality, 80);
  const map_from_odom_t m = make_map_from_odom(f);
  EXPECT_EQ(m.scale, 1.5);
  EXPECT_EQ(m.position[1], 8.0);
  const bot_core::pose_t b = make_bot_core_pose(f);
  const Eigen::Vector3d velocity_map = f.result.T_map_body.q * (1.5 * f.result.velocity_body.head<3>());
  EXPECT_DOUBLE_EQ(b.vel[0], velocity_map.x());
}

TEST(Messages, LossLeavesNoNumberThatCouldBeTakenForAPose) {
  slam::FrameResult r = tracked_result();
  r.state = slam::State::kLost;
  r.has_pose = false;
  const FrameOutput f = make_frame_output(r, 1.0);
  const odometry_t o = make_odometry(f);
  const pose_t p = make_pose(f);
  EXPECT_EQ(o.quality, -1);
  EXPECT_EQ(p.quality, -1);
  EXPECT_EQ(o.valid, 0);
  EXPECT_EQ(o.velocity_valid, 0);
  EXPECT_EQ(p.valid, 0);
  EXPECT_EQ(o.state, static_cast<int>(status_t::STATE_LOST));
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(std::isnan(o.position[i]) && std::isnan(p.position[i]) && std::isnan(o.velocity[i]) &&
                std::isnan(o.angular_velocity[i]));
  }
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(std::isnan(o.orientation[i]) && std::isnan(p.orientation[i]));
  EXPECT_TRUE(std::isnan(o.pose_covariance[3][3]) && std::isnan(p.covariance[0][0]));
  EXPECT_TRUE(std::isnan(o.noise_covariance[0][0]) && std::isnan(o.drift_covariance[0][0]) &&
              std::isnan(o.twist_covariance[0][0]) && std::isnan(o.scale_sigma));
}

TEST(Messages, StatesAndScalesHaveTheSameNumbersAsTheEstimators) {
  EXPECT_EQ(static_cast<int>(status_t::STATE_STARTING), static_cast<int>(slam::State::kStarting));
  EXPECT_EQ(static_cast<int>(status_t::STATE_INITIALISING), static_cast<int>(slam::State::kInitialising));
  EXPECT_EQ(static_cast<int>(status_t::STATE_SETTLING), static_cast<int>(slam::State::kSettling));
  EXPECT_EQ(static_cast<int>(status_t::STATE_TRACKING), static_cast<int>(slam::State::kTracking));
  EXPECT_EQ(static_cast<int>(status_t::STATE_DEGRADED), static_cast<int>(slam::State::kDegraded));
  EXPECT_EQ(static_cast<int>(status_t::STATE_LOST), static_cast<int>(slam::State::kLost));
  EXPECT_EQ(static_cast<int>(status_t::STATE_RELOCALISING), static_cast<int>(slam::State::kRelocalising));
  EXPECT_EQ(static_cast<int>(status_t::STATE_NO_CAMERA), static_cast<int>(slam::State::kNoCamera));
  EXPECT_EQ(static_cast<int>(status_t::SCALE_UNKNOWN), static_cast<int>(slam::ScaleState::kUnknown));
  EXPECT_EQ(static_cast<int>(status_t::SCALE_ASSUMED), static_cast<int>(slam::ScaleState::kAssumed));
  EXPECT_EQ(static_cast<int>(status_t::SCALE_METRIC), static_cast<int>(slam::ScaleState::kMetric));
}

slam::LandmarkInfo landmark(std::int32_t map_id, double depth, double relative_sigma, bool full, bool vmp) {
  slam::LandmarkInfo l;
  l.map_id = map_id;
  l.position_map = {depth, 0.0, 1.0};
  l.inverse_depth = 1.0 / depth;
  l.inverse_depth_sigma = relative_sigma / depth;
  l.creation_depth = depth;
  l.creation_relative_sigma = relative_sigma;
  l.full = full;
  l.through_vmp = vmp;
  return l;
}

TEST(Messages, MapHoldsTheFramesMapThinnedAndScaled) {
  const FrameOutput f = make_frame_output(tracked_result(), 2.0);
  MapContent content;
  for (int i = 1; i <= 10; ++i) content.landmarks.push_back(landmark(2, i, 0.1, i % 2 == 0, true));
  content.landmarks.push_back(landmark(7, 99.0, 0.1, true, true));  // another map's
  content.keyframes = {slam::SE3{Eigen::Quaterniond::Identity(), {1.0, 2.0, 3.0}}};
  const map_t all = make_map(f, content, 100, 2.0);
  ASSERT_EQ(all.npoints, 10);
  EXPECT_FLOAT_EQ(all.x[4], 10.0f);
  EXPECT_FLOAT_EQ(all.relative_sigma[4], 0.1f);
  EXPECT_EQ(all.landmark_state[1], static_cast<int>(map_t::LANDMARK_FULL));
  ASSERT_EQ(all.nkeyframes, 1);
  EXPECT_EQ(all.keyframe_pose[0], (std::vector<double>{2.0, 4.0, 6.0, 1.0, 0.0, 0.0, 0.0}));
  const map_t thinned = make_map(f, content, 4, 2.0);
  EXPECT_EQ(thinned.npoints, 4);
  EXPECT_EQ(make_map(f, content, 0, 2.0).npoints, 0);
  EXPECT_EQ(make_map(f, {}, 4, 2.0).npoints, 0);
}

TEST(Messages, Quantiles) {
  EXPECT_TRUE(std::isnan(quantile({}, 0.5)));
  EXPECT_EQ(quantile(std::vector<double>{3.0}, 0.9), 3.0);
  const std::vector<double> values{0.0, 10.0, 20.0, 30.0, 40.0};
  EXPECT_EQ(quantile(values, 0.0), 0.0);
  EXPECT_EQ(quantile(values, 0.5), 20.0);
  EXPECT_EQ(quantile(values, 1.0), 40.0);
  EXPECT_DOUBLE_EQ(quantile(values, 0.1), 4.0);
}

TEST(Messages, SummaryCountsOnlySurvivingWellKnownDepths) {
  RunEnd end;
  end.frames = 5;
  end.unit_scale = 10.0;
  end.live_utimes = {200, 300};
  end.trajectories.push_back(
      {4, {{100, {}}, {200, {Eigen::Quaterniond::Identity(), {1.0, 0.0, 0.0}}}, {300, {}}}});
  end.trajectories.push_back({9, {{400, {}}}});
  for (int i = 1; i <= 9; ++i) end.landmarks.push_back(landmark(4, i, 0.2, true, i <= 3));
  end.landmarks.push_back(landmark(4, 1000.0, 0.31, true, true));  // deep, but not known well enough
  end.landmarks.push_back(landmark(4, 2000.0, 0.1, false, true));  // not a point yet
  end.observation_distances = {{3.0, 1.0, 2.0}, {}};
  const summary_t s = make_summary(end, Config{});
  ASSERT_EQ(s.nmaps, 2);
  const map_summary_t& m = s.maps[0];
  EXPECT_EQ(m.map_id, 4);
  EXPECT_EQ(m.frames, 3);
  EXPECT_EQ(m.landmarks, 10);
  EXPECT_EQ(m.landmarks_through_vmp, 4);
  EXPECT_EQ(m.ncreated, 10);
  EXPECT_DOUBLE_EQ(m.creation_depth_median, 50.0);
  EXPECT_DOUBLE_EQ(m.creation_depth_p90, 82.0);
  EXPECT_EQ(m.observations, 3);
  EXPECT_DOUBLE_EQ(m.observation_distance_median, 20.0);
  ASSERT_EQ(m.nquantiles, 101);
  EXPECT_FLOAT_EQ(m.observation_distance_quantile[100], 30.0f);
  EXPECT_EQ(s.maps[1].nquantiles, 0);
  EXPECT_TRUE(std::isnan(s.maps[1].creation_depth_median));
  EXPECT_EQ(s.landmark_mode, "vmp");
  EXPECT_EQ(s.configuration, canonical_text(Config{}));

  const trajectory_t t = make_trajectory(end);
  EXPECT_EQ(t.map_id, 4);
  EXPECT_EQ(t.nmaps, 2);
  ASSERT_EQ(t.nposes, 4);
  EXPECT_EQ(t.poses[1].position[0], 10.0);
  EXPECT_EQ(t.poses[0].was_live, 0);
  EXPECT_EQ(t.poses[1].was_live, 1);
  EXPECT_EQ(t.poses[3].map_id, 9);
  std::vector<std::uint8_t> bytes;
  ipc::encode(s, &bytes);
  summary_t decoded;
  EXPECT_TRUE(ipc::decode(bytes, &decoded));
}

TEST(Messages, ARunWithoutAMapStillHasATrajectoryAndASummary) {
  RunEnd end;
  end.frames = 7;
  EXPECT_EQ(make_trajectory(end).map_id, -1);
  EXPECT_EQ(make_trajectory(end).frames, 7);
  EXPECT_EQ(make_summary(end, Config{}).nmaps, 0);
}

}  // namespace
}  // namespace farpoint::daemon
