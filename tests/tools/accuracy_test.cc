// SPDX-License-Identifier: Apache-2.0
// Trajectory files, pairing, alignment and relative errors.
#include "tools/evaluate/accuracy.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "tests/tools/tool_support.h"
#include "tools/common/errors.h"
#include "tools/evaluate/statistics.h"

namespace farpoint::tools {
namespace {

// At a time and place, unturned or turned.
TimedPose at(double time_s, const Eigen::Vector3d& position,
             const Eigen::Vector3d& rotation_rad = Eigen::Vector3d::Zero()) {
  return {time_s, {slam::so3_exp(rotation_rad), position}, 0};
}

constexpr double kRadiansPerDegree = std::numbers::pi / 180.0;

TEST(Statistics, PercentilesInterpolate) {
  EXPECT_DOUBLE_EQ(percentile({4, 1, 3, 2}, 50), 2.5);
  EXPECT_DOUBLE_EQ(percentile({1, 2, 3, 4, 5}, 10), 1.4);
  EXPECT_DOUBLE_EQ(percentile({7}, 99), 7);
  EXPECT_TRUE(std::isnan(percentile({}, 50)));
  EXPECT_TRUE(std::isnan(mean({})));
  EXPECT_DOUBLE_EQ(root_mean_square({3, 4}), std::sqrt(12.5));
}

TEST(TumFile, SurvivesWritingAndReading) {
  std::mt19937_64 random(1);
  const Trajectory path = random_path(&random, 50, 20.0, 1403636579.5);
  const ScratchFolder folder;
  put(folder / "t.tum", to_tum(path));
  const Trajectory back = read_tum(folder / "t.tum");
  ASSERT_EQ(back.poses.size(), 50U);
  EXPECT_TRUE(back.has_orientation);
  for (std::size_t i = 0; i < 50; ++i) {
    EXPECT_NEAR(back.poses[i].time_s, path.poses[i].time_s, 1e-6);
    EXPECT_TRUE(back.poses[i].pose.t.isApprox(path.poses[i].pose.t, 1e-7) || i == 0);
    EXPECT_LT(back.poses[i].pose.q.angularDistance(path.poses[i].pose.q), 1e-7);
  }
}

TEST(TumFile, IdentityQuaternionsMeanPositionOnly) {
  const ScratchFolder folder;
  put(folder / "t.tum", "# comment\n\n0.1, 1, 2, 3, 0, 0, 0, 1\r\n0.2 1 2 3 0 0 0 1 extra\n");
  EXPECT_FALSE(read_tum(folder / "t.tum").has_orientation);
  EXPECT_EQ(read_tum(folder / "t.tum").poses.size(), 2U);
  put(folder / "t.tum", "0.1 1 2 3 0 0 0 1\n0.2 1 2 3 0.6 0 0 0.8\n");
  EXPECT_TRUE(read_tum(folder / "t.tum").has_orientation);
}

TEST(TumFile, MalformedLinesAreNamed) {
  const ScratchFolder folder;
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"", "no poses"},
      {"# only a comment\n", "no poses"},
      {"0 1 2 3 0 0 0 1\n1 1 2 3 0 0 0\n", "t.tum:2: expected 8 fields"},
      {"0 1 2 x 0 0 0 1\n", "t.tum:1: expected a finite number for tz, found 'x'"},
      {"0 1 2 inf 0 0 0 1\n", "t.tum:1: expected a finite number for tz"},
      {"0 1 2 3 0 0 0 1\n\n#\n1 1 2 3 1 1 0 1\n", "t.tum:4: expected a unit quaternion"},
      {"1 1 2 3 0 0 0 1\n0.5 1 2 3 0 0 0 1\n", "t.tum:2: time 0.5 lies before"},
  };
  for (const auto& [content, complaint] : cases) {
    put(folder / "t.tum", content);
    try {
      (void)read_tum(folder / "t.tum");
      ADD_FAILURE() << "accepted: " << content;
    } catch (const InputError& e) {
      EXPECT_NE(std::string(e.what()).find(complaint), std::string::npos) << e.what();
    }
  }
}

TEST(Pairing, NearestWithinToleranceTheLaterOfTwoEquals) {
  Trajectory truth, estimate;
  for (const double t : {0.0, 0.25, 0.5}) truth.poses.push_back(at(t, {t, 0, 0}));
  for (const double t : {-0.125, 0.0625, 0.125, 0.4, 0.7}) estimate.poses.push_back(at(t, {0, 0, 0}));
  const std::vector<PosePair> pairs = pair_nearest(truth, estimate, 0.125);
  ASSERT_EQ(pairs.size(), 4U);
  EXPECT_EQ(pairs[0].T_world_body.t.x(), 0.0);
  EXPECT_EQ(pairs[1].T_world_body.t.x(), 0.0);
  EXPECT_EQ(pairs[2].T_world_body.t.x(), 0.25);
  EXPECT_EQ(pairs[3].T_world_body.t.x(), 0.5);
  EXPECT_EQ(pair_nearest(truth, estimate, 0.06).size(), 0U);
  EXPECT_EQ(pair_nearest({}, estimate).size(), 0U);
}

TEST(Alignment, FindsTheSimilarityAgain) {
  std::mt19937_64 random(2);
  const Trajectory path = random_path(&random, 200, 10.0, 0.0);
  const Trajectory moved = disturbed(path, 0.25, 0.0, &random);
  const auto sim3 = absolute_error(pair_nearest(path, moved), Alignment::kSim3, false);
  ASSERT_TRUE(sim3.has_value());
  EXPECT_NEAR(sim3->scale, 4.0, 1e-9);
  EXPECT_LT(sim3->max_m, 1e-9);
  const auto se3 = absolute_error(pair_nearest(path, moved), Alignment::kSe3, false);
  EXPECT_EQ(se3->scale, 1.0);
  EXPECT_GT(se3->rmse_m, 1.0);
}

TEST(Alignment, StandingEstimateIsMovedAndTooFewPairsAreNone) {
  Trajectory truth, estimate;
  for (int i = 0; i < 4; ++i) truth.poses.push_back(at(0.1 * i, {1.0 * i, 0, 0}));
  for (int i = 0; i < 4; ++i) estimate.poses.push_back(at(0.1 * i, {7, 7, 7}));
  const auto error = absolute_error(pair_nearest(truth, estimate), Alignment::kSim3, false);
  ASSERT_TRUE(error.has_value());
  EXPECT_NEAR(error->rmse_m, std::sqrt((1.5 * 1.5 + 0.5 * 0.5) / 2.0), 1e-12);
  estimate.poses.resize(2);
  EXPECT_FALSE(absolute_error(pair_nearest(truth, estimate), Alignment::kSim3, false).has_value());
  EXPECT_FALSE(absolute_error(pair_nearest(truth, estimate), Alignment::kNone, false).has_value());
}

// Straight ahead, 1 m a frame: the estimate is 2 % too long and yaws 0.001 degrees a metre.
TEST(SegmentError, GivesDriftInPercentAndDegreesAMetre) {
  Trajectory truth, estimate;
  slam::SE3 drifting;
  slam::Vector6d step = slam::Vector6d::Zero();
  step[0] = 1.02;
  step[5] = 0.001 * kRadiansPerDegree;
  for (int i = 0; i < 1000; ++i) {
    truth.poses.push_back(at(0.1 * i, {1.0 * i, 0, 0}));
    estimate.poses.push_back({0.1 * i, drifting, 0});
    drifting = drifting.boxplus(step);
  }
  const auto error = segment_error(pair_nearest(truth, estimate), 1.0);
  ASSERT_TRUE(error.has_value());
  EXPECT_NEAR(error->translation_percent, 2.0, 0.15);  // a segment is the first frame beyond its length
  EXPECT_NEAR(error->rotation_deg_per_m, 0.001, 5e-5);
  EXPECT_NEAR(segment_error(pair_nearest(truth, estimate), 1 / 1.02)->translation_percent, 0.0, 1.1);
  truth.poses.resize(90);
  EXPECT_FALSE(segment_error(pair_nearest(truth, estimate), 1.0).has_value());
}

// Straight ahead, 1 m a frame, with a zigzag of 0.5 m: its share falls with the length.
TEST(SegmentError, IsGivenForEachLengthThatFits) {
  Trajectory truth, estimate;
  for (int i = 0; i < 300; ++i) {
    truth.poses.push_back(at(0.1 * i, {1.0 * i, 0, 0}));
    estimate.poses.push_back(at(0.1 * i, {1.0 * i, i % 14 < 7 ? 0.5 : 0.0, 0}));
  }
  const std::vector<PosePair> pairs = pair_nearest(truth, estimate);
  const std::vector<LengthError> errors = segment_errors(pairs, 1.0, {9.0, 100.0, 200.0, 400.0});
  ASSERT_EQ(errors.size(), 3U) << "400 m fit nowhere";
  EXPECT_EQ(errors[0].length_m, 9.0);
  EXPECT_EQ(errors[2].length_m, 200.0);
  EXPECT_EQ(errors[2].error.segments, 10U);
  EXPECT_GT(errors[0].error.translation_percent, 2.0);
  EXPECT_LT(errors[2].error.translation_percent, 1.0);
  // Over 100 to 800 m the one figure is the mean of all segments.
  const std::vector<LengthError> kitti = segment_errors(pairs, 1.0, {100.0, 200.0});
  const auto whole = segment_error(pairs, 1.0);
  double sum = 0.0;
  for (const LengthError& e : kitti)
    sum += e.error.translation_percent * static_cast<double>(e.error.segments);
  EXPECT_NEAR(whole->translation_percent, sum / static_cast<double>(whole->segments), 1e-9);
}

TEST(PairInterpolated, TruthIsAtTheEstimatesOwnTime) {
  Trajectory truth, estimate;
  for (int i = 0; i < 100; ++i) truth.poses.push_back(at(0.01 * i, {1.0 * i, 0, 0}));
  estimate.poses.push_back(at(0.123, {0, 0, 0}));
  estimate.poses.push_back(at(5.0, {0, 0, 0}));
  const std::vector<PosePair> pairs = pair_interpolated(truth, estimate);
  ASSERT_EQ(pairs.size(), 1U);
  EXPECT_NEAR(pairs[0].T_world_body.t.x(), 12.3, 1e-9);
  EXPECT_TRUE(pair_interpolated({}, estimate).empty());
}

TEST(OneSecondError, FindsAConstantDriftAndTheWorstPose) {
  Trajectory truth, estimate;
  const double rate_rad = 50.0 * kRadiansPerDegree;  // a second, about z
  for (int i = 0; i < 400; ++i) {
    const double t = 0.01 * i;
    truth.poses.push_back(at(t, {0, 0, 0}, {0, 0, rate_rad * t}));
  }
  for (int i = 0; i < 100; ++i) {
    const double t = 0.003 + i / 30.0;  // never at the truth's times
    const double jump_rad = i == 60 ? 3.0 * kRadiansPerDegree : 0.0;
    estimate.poses.push_back(at(t, {0, 0, 0}, {0, 0, (rate_rad + 0.5 * kRadiansPerDegree) * t + jump_rad}));
  }
  const auto error = one_second_error(truth, estimate, 1.0);
  ASSERT_TRUE(error.has_value());
  EXPECT_EQ(error->pairs, 70U);
  EXPECT_NEAR(error->rotation_max_deg, 3.5, 0.01);
  EXPECT_NEAR(error->rotation_rmse_deg, std::sqrt((68 * 0.25 + 3.5 * 3.5 + 2.5 * 2.5) / 70), 0.01);
  EXPECT_NEAR(error->translation_max_m, 0.0, 1e-9);
}

TEST(OneSecondError, PosesOfDifferentMapsAreNoPair) {
  std::mt19937_64 random(3);
  const Trajectory truth = random_path(&random, 40, 10.0, 0.0);
  Trajectory estimate = truth;
  for (std::size_t i = 20; i < 40; ++i) {  // a second map with an origin of its own
    estimate.poses[i].pose = slam::SE3{slam::so3_exp({0, 0, 1}), {5, 5, 5}} * truth.poses[i].pose;
    estimate.poses[i].map_id = 1;
  }
  EXPECT_LT(one_second_error(truth, estimate, 1.0)->rotation_max_deg, 1e-6);
  for (TimedPose& p : estimate.poses) p.map_id = 0;
  EXPECT_GT(one_second_error(truth, estimate, 1.0)->rotation_max_deg, 50.0);
}

}  // namespace
}  // namespace farpoint::tools
