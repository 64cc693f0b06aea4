// SPDX-License-Identifier: Apache-2.0
// Runs without truth: what they say of themselves, and what they leave out.
#include "tools/evaluate/own_metrics.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/tools/made_run.h"
#include "tests/tools/tool_support.h"
#include "tools/evaluate/run_metrics.h"
#include "tools/evaluate/table.h"

namespace farpoint::tools {
namespace {

// A straight path of n poses at 10 Hz, one unit a step.
Trajectory straight_path(int n) {
  Trajectory path;
  for (int i = 0; i < n; ++i)
    path.poses.push_back({0.1 * i, {Eigen::Quaterniond::Identity(), {1.0 * i, 0, 0}}, 0});
  return path;
}

class RunWithoutTruth : public testing::Test {
 protected:
  RunMetrics metrics_of(const MadeRun& run, const Truth& truth = {}) {
    write_run_log(folder / "run.lcm", run);
    return evaluate_run(read_run(folder / "run.lcm"), truth, {});
  }
  ScratchFolder folder;
};

TEST_F(RunWithoutTruth, TellsValidityLossesAndPath) {
  MadeRun run;
  run.final_trajectory = straight_path(201);
  run.blind_from = 50;
  run.blind_to = 80;
  const RunMetrics m = metrics_of(run);
  EXPECT_FALSE(m.compared);
  EXPECT_EQ(m.images, 201);
  EXPECT_STREQ(m.own.length_unit, "map units");
  EXPECT_NEAR(m.own.duration_s, 20.0, 1e-9);
  EXPECT_EQ(m.own.final_path.poses, 201U);
  EXPECT_NEAR(m.own.final_path.share, 1.0, 1e-12);
  EXPECT_NEAR(m.own.final_path.length, 200.0, 1e-9);
  EXPECT_EQ(m.own.live_path->poses, 161U);
  EXPECT_NEAR(*m.own.first_valid_s, 1.0, 1e-9);
  EXPECT_NEAR(*m.own.longest_blind_s, 3.1, 1e-9);  // the last valid one at 4.9 s, the next at 8.0 s
  EXPECT_NEAR(m.own.state_percent[status_t::STATE_TRACKING], 100.0 * 161 / 201, 1e-9);
  EXPECT_NEAR(m.own.state_percent[status_t::STATE_INITIALISING], 100.0 * 40 / 201, 1e-9);
  EXPECT_EQ(*m.own.frames_dropped, 4);
  EXPECT_EQ(*m.times_lost, 2);
}

TEST_F(RunWithoutTruth, FramesWithoutAPoseAtTheEndAreBlind) {
  MadeRun run;
  run.final_trajectory = straight_path(101);
  run.blind_from = 60;
  run.blind_to = 101;
  EXPECT_NEAR(*metrics_of(run).own.longest_blind_s, 4.1, 1e-9);
  run.first_live = 101;
  EXPECT_FALSE(metrics_of(run).own.first_valid_s.has_value());
  EXPECT_FALSE(metrics_of(run).own.longest_blind_s.has_value());
}

TEST_F(RunWithoutTruth, PointsAreTheLandmarksThatHaveADepth) {
  MadeRun run;
  run.final_trajectory = straight_path(30);
  const RunMetrics ended = metrics_of(run);
  EXPECT_EQ(ended.own.map->points, 1234);  // 1500 landmarks, 266 of them virtual map points
  EXPECT_EQ(ended.own.map->vmps, 266);
  EXPECT_EQ(ended.own.map->keyframes, 50);
  run.ended = false;  // the last status counts
  EXPECT_EQ(metrics_of(run).own.map->points, 1190);
  status_t status{};
  status.landmarks = 10;
  status.vmps = 12;  // counted a moment before
  EXPECT_EQ(map_counts(status).points, 0);
}

TEST_F(RunWithoutTruth, HasNoErrorsInJsonAndTable) {
  MadeRun run;
  run.final_trajectory = straight_path(101);
  const RunMetrics m = metrics_of(run);
  const Json json = to_json(m);
  for (const char* absent : {"align", "truth_point", "final.n", "final.share", "final.ate_rmse_m",
                             "final.scale", "live.n", "triangulation_depth_m", "landmarks"})
    EXPECT_EQ(json.find(absent)->dump(), "null") << absent;
  ASSERT_NE(json.find("compared_with_truth"), nullptr);
  EXPECT_EQ(json.find("compared_with_truth")->dump(), "false");
  EXPECT_EQ(json.find("own.final.path")->number(), 100.0);
  EXPECT_EQ(json.find("own.points")->number(), 1234.0);
  EXPECT_NEAR(json.find("own.states_percent.tracking")->number(), 100.0 * 91 / 101, 1e-9);
  const std::string text = table_text({m});
  EXPECT_EQ(text.find("ATE"), std::string::npos) << text;
  EXPECT_EQ(text.find("lost:"), std::string::npos) << text;
  for (const char* part : {"blind s", "map units", "100.0"})
    EXPECT_NE(text.find(part), std::string::npos) << text;
  const std::string details = details_text(m);
  for (const char* part : {"run no truth", "run all maps: keyframes=50 points=1234 vmps=266",
                           "first_valid_s=1.00 longest_blind_s=0.10"})
    EXPECT_NE(details.find(part), std::string::npos) << details;
}

TEST_F(RunWithoutTruth, MetricRunHasDepthsInMetres) {
  MadeRun run;
  run.final_trajectory = straight_path(30);
  run.scale_state = status_t::SCALE_UNKNOWN;
  EXPECT_FALSE(metrics_of(run).depth.has_value());
  run.scale_state = status_t::SCALE_ASSUMED;
  const RunMetrics m = metrics_of(run);
  EXPECT_STREQ(m.own.length_unit, "m");
  EXPECT_NEAR(m.depth->triangulation_m.p50, 50.0, 1e-3);
}

TEST_F(RunWithoutTruth, TextFileHasItsPathOnly) {
  put(folder / "t.tum", "0 0 0 0 0 0 0 1\n1 3 0 0 0 0 0 1\n2 3 4 0 0 0 0 1\n");
  const RunMetrics m = evaluate_run(read_run(folder / "t.tum"), Truth{}, {});
  EXPECT_NEAR(m.own.final_path.length, 7.0, 1e-9);
  EXPECT_NEAR(m.own.duration_s, 2.0, 1e-9);
  EXPECT_FALSE(m.own.live_path.has_value());
  EXPECT_NE(details_text(m).find("t final path: poses=3"), std::string::npos);
}

TEST_F(RunWithoutTruth, RecordingWithoutTruthStillCountsTheFrames) {
  Trajectory none;
  write_recording_log(folder / "empty.lcm", none, "", {0, 0, 0});
  EXPECT_FALSE(read_reference(folder / "empty.lcm").is_known());
  EXPECT_THROW((void)read_truth(folder / "empty.lcm"), std::runtime_error);
  Truth frames_only;
  frames_only.frame_utimes.assign(400, 0);
  MadeRun run;
  run.final_trajectory = straight_path(200);
  const RunMetrics m = metrics_of(run, frames_only);
  EXPECT_EQ(m.images, 400);
  EXPECT_NEAR(m.own.final_path.share, 0.5, 1e-12);
}

TEST_F(RunWithoutTruth, StepFromOneMapToAnotherIsNoWay) {
  Trajectory path = straight_path(4);
  path.poses[2].map_id = path.poses[3].map_id = 9;
  EXPECT_NEAR(measure_path(path, 8).length, 2.0, 1e-12);
  EXPECT_NEAR(measure_path(path, 8).share, 0.5, 1e-12);
}

// Other programs read them.
TEST_F(RunWithoutTruth, JsonOfARunWithTruthKeepsItsKeysInOrder) {
  std::mt19937_64 random{3};
  Truth truth;
  truth.body = random_path(&random, 201, 10.0, 100.0);
  MadeRun run;
  run.final_trajectory = disturbed(truth.body, 0.5, 0.0, &random);
  const std::string text = to_json(metrics_of(run, truth)).dump();
  std::size_t at = 0;
  for (const char* key : {"name",
                          "align",
                          "planar",
                          "truth_point",
                          "scale_state",
                          "images",
                          "tracked_percent",
                          "resets",
                          "times_lost",
                          "maps",
                          "tracking_ms",
                          "frame_ms",
                          "deadline_misses",
                          "peak_resident_mb",
                          "latency",
                          "steadiness",
                          "triangulation_depth_m",
                          "depth_over_50_m_percent",
                          "depth_over_100_m_percent",
                          "observation_distance_m",
                          "map_points",
                          "vmp_percent",
                          "landmarks",
                          "final",
                          "live",
                          "segments",
                          "compared_with_truth",
                          "own"}) {
    const std::size_t found = text.find(std::string(1, '"').append(key).append("\":"), at);
    ASSERT_NE(found, std::string::npos) << key << " in " << text;
    at = found;
  }
  EXPECT_NE(text.find("\"align\":\"sim3\""), std::string::npos);
}

// ---- the program

TEST_F(RunWithoutTruth, ProgramNeedsNoTruth) {
  MadeRun run;
  run.final_trajectory = straight_path(101);
  write_run_log(folder / "run.lcm", run);
  const std::string command = "evaluate " + (folder / "run.lcm").string();
  const ProgramResult alone = run_farpoint_program(command);
  EXPECT_EQ(alone.status, 0) << alone.err;
  EXPECT_NE(alone.out.find("run no truth"), std::string::npos) << alone.out;
  const ProgramResult aligned = run_farpoint_program(command + " --align se3");
  EXPECT_EQ(aligned.status, 2);
  EXPECT_NE(aligned.err.find("compare with truth, expected --truth"), std::string::npos) << aligned.err;

  write_recording_log(folder / "empty.lcm", {}, "", {0, 0, 0});
  const ProgramResult beside = run_farpoint_program(command + " --truth " + (folder / "empty.lcm").string());
  EXPECT_EQ(beside.status, 0) << beside.err;
  EXPECT_NE(beside.err.find("no GROUND_TRUTH messages, evaluated without truth"), std::string::npos);
  // A condition on an error that is not there is broken, not fulfilled.
  EXPECT_EQ(run_farpoint_program(command + " --expect 'run.ate < 1'").status, 1);
  EXPECT_EQ(run_farpoint_program(command + " --expect 'run.own.longest_blind_s < 1'").status, 0);
}

}  // namespace
}  // namespace farpoint::tools
