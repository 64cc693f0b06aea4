// SPDX-License-Identifier: Apache-2.0
// Run logs against truth: figures, tables, JSON, conditions.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/tools/made_run.h"
#include "tests/tools/tool_support.h"
#include "tools/common/errors.h"
#include "tools/evaluate/expectation.h"
#include "tools/evaluate/run_metrics.h"
#include "tools/evaluate/table.h"

namespace farpoint::tools {
namespace {

class EvaluateRun : public testing::Test {
 protected:
  std::mt19937_64 random{5};
  ScratchFolder folder;
  Trajectory truth = random_path(&random, 201, 10.0, 100.0);
};

TEST_F(EvaluateRun, GivesTheRowOfMethod) {
  write_recording_log(folder / "truth.lcm", truth, "", {0, 0, 0});
  MadeRun run;
  run.final_trajectory = disturbed(truth, 0.5, 0.0, &random);
  write_run_log(folder / "run.lcm", run);
  const RunMetrics m = evaluate_run(read_run(folder / "run.lcm"), read_truth(folder / "truth.lcm"), {});
  EXPECT_EQ(m.name, "run");
  EXPECT_EQ(m.images, 201);
  EXPECT_EQ(m.alignment, Alignment::kSim3);
  EXPECT_STREQ(m.truth_point, "body");  // no body is named: camera 0 is where the body is
  ASSERT_TRUE(m.final_metrics.absolute.has_value());
  EXPECT_EQ(m.final_metrics.paired, 201U);
  EXPECT_NEAR(m.final_metrics.absolute->scale, 2.0, 1e-5);
  EXPECT_LT(m.final_metrics.absolute->rmse_m, 1e-4);
  ASSERT_TRUE(m.live_metrics.has_value());
  EXPECT_NEAR(m.live_metrics->share, 191.0 / 201.0, 1e-12);
  EXPECT_LT(m.live_metrics->absolute->rmse_m, 1e-4);
  EXPECT_TRUE(m.final_metrics.segments.has_value());
  EXPECT_NEAR(*m.tracked_percent, 100.0 * 191 / 201, 1e-9);
  EXPECT_EQ(*m.resets, 3);
  EXPECT_EQ(*m.deadline_misses, 1);
  EXPECT_NEAR(*m.peak_resident_mb, 300.0, 1e-9);
  EXPECT_EQ(*m.map_points, 1234);
  EXPECT_NEAR(*m.vmp_percent, 5.0, 1e-9);
  ASSERT_TRUE(m.depth.has_value());  // metres are twice the map's units; the uncertain point does not count
  EXPECT_EQ(m.depth->triangulation_m.count, 101U);
  EXPECT_NEAR(m.depth->triangulation_m.p50, 100.0, 1e-3);
  EXPECT_NEAR(m.depth->triangulation_m.p90, 180.0, 1e-3);
  EXPECT_NEAR(m.depth->over_100_m_percent, 100.0 * 50 / 101, 1.0);
  EXPECT_NEAR(m.depth->observation_m.p10, 4.0, 1e-4);
  const Json json = to_json(m);
  EXPECT_NEAR(json.find("tracking_ms.mean")->number(), 100.0, 1e-9);
  EXPECT_NEAR(json.find("tracking_ms.p99")->number(), 198.0, 1e-9);
  EXPECT_NEAR(json.find("tracking_ms.max")->number(), 200.0, 1e-9);
  EXPECT_NEAR(json.find("latency.p50_ms")->number(), 107.0, 1e-9);
}

TEST_F(EvaluateRun, TruthMovesToCamera0WhileTheScaleIsUnknown) {
  const Eigen::Vector3d lever_arm(3, 1, -2);
  write_recording_log(folder / "truth.lcm", truth, "imu0", lever_arm);
  MadeRun run;
  run.final_trajectory = truth;  // the estimator's body stands at camera 0, with the body's axes
  move_reference_point({Eigen::Quaterniond::Identity(), lever_arm}, &run.final_trajectory);
  run.final_trajectory = disturbed(run.final_trajectory, 3.0, 0.0, &random);
  write_run_log(folder / "run.lcm", run);
  const Truth read = read_truth(folder / "truth.lcm");
  const RunMetrics at_camera = evaluate_run(read_run(folder / "run.lcm"), read, {});
  EXPECT_STREQ(at_camera.truth_point, "camera0");
  EXPECT_LT(at_camera.final_metrics.absolute->rmse_m, 1e-4);
  EXPECT_LT(at_camera.final_metrics.one_second->rotation_max_deg, 1e-4);

  EvaluationOptions at_body;
  at_body.truth_point = TruthPoint::kBody;
  EXPECT_GT(evaluate_run(read_run(folder / "run.lcm"), read, at_body).final_metrics.absolute->rmse_m, 0.1);

  run.final_trajectory = disturbed(truth, 1.0, 0.0, &random);
  run.scale_state = status_t::SCALE_METRIC;
  write_run_log(folder / "metric.lcm", run);
  const RunMetrics metric = evaluate_run(read_run(folder / "metric.lcm"), read, {});
  EXPECT_STREQ(metric.truth_point, "body");
  EXPECT_EQ(metric.alignment, Alignment::kSe3);
  EXPECT_LT(metric.final_metrics.absolute->rmse_m, 1e-4);
}

TEST_F(EvaluateRun, SegmentsShowALostScale) {
  write_recording_log(folder / "truth.lcm", truth, "", {0, 0, 0});
  MadeRun run;
  run.final_trajectory = truth;
  const Eigen::Vector3d turn = truth.poses[100].pose.t;  // before it everything is 8 % too short
  for (std::size_t i = 0; i < 100; ++i) {
    Eigen::Vector3d& t = run.final_trajectory.poses[i].pose.t;
    t = turn + 0.92 * (t - turn);
  }
  write_run_log(folder / "run.lcm", run);
  EvaluationOptions options;
  options.segments = {{0, 100}, {100, 201}};
  const RunMetrics m = evaluate_run(read_run(folder / "run.lcm"), read_truth(folder / "truth.lcm"), options);
  ASSERT_EQ(m.segments.size(), 2U);
  EXPECT_NEAR(*m.segments[0].scale, 1.0 / 0.92, 1e-5);
  EXPECT_NEAR(*m.segments[1].scale, 1.0, 1e-5);
  EXPECT_NEAR(*m.segments[1].ratio_to_first, 0.92, 1e-5);
  options.segments = {{0, 202}};
  EXPECT_THROW((void)evaluate_run(read_run(folder / "run.lcm"), read_truth(folder / "truth.lcm"), options),
               InputError);
}

TEST_F(EvaluateRun, LostRunIsPrintedAsLost) {
  write_recording_log(folder / "truth.lcm", truth, "", {0, 0, 0});
  MadeRun run;
  run.final_trajectory = truth;
  run.first_live = 1000;
  run.ended = false;
  write_run_log(folder / "run.lcm", run);
  const RunMetrics m = evaluate_run(read_run(folder / "run.lcm"), read_truth(folder / "truth.lcm"), {});
  EXPECT_EQ(m.final_metrics.paired, 0U);
  EXPECT_EQ(m.live_metrics->paired, 0U);
  EXPECT_NE(table_text({m}).find("lost"), std::string::npos);
  EXPECT_NE(details_text(m).find("lost"), std::string::npos);
  EXPECT_EQ(to_json(m).find("final.ate_rmse_m")->dump(), "null");
}

TEST_F(EvaluateRun, TimeOfTheWholeFrameIsNotCalledTracking) {
  write_recording_log(folder / "truth.lcm", truth, "", {0, 0, 0});
  MadeRun run;
  run.final_trajectory = truth;
  write_run_log(folder / "run.lcm", run);
  run.tracking_timed = false;
  write_run_log(folder / "lockstep.lcm", run);
  const Truth read = read_truth(folder / "truth.lcm");
  const RunMetrics tracking = evaluate_run(read_run(folder / "run.lcm"), read, {});
  const RunMetrics frame = evaluate_run(read_run(folder / "lockstep.lcm"), read, {});
  EXPECT_EQ(to_json(frame).find("tracking_ms")->dump(), "null");
  EXPECT_NEAR(to_json(frame).find("frame_ms.p50")->number(), 100.0, 1e-9);
  EXPECT_NE(table_text({tracking}).find(" tracking "), std::string::npos);
  EXPECT_EQ(table_text({frame}).find(" tracking "), std::string::npos);
  EXPECT_NE(table_text({frame}).find(" frame "), std::string::npos);
}

TEST_F(EvaluateRun, PositionOnlyTruthHasNoRotationErrors) {
  truth.has_orientation = false;
  Trajectory positions = truth;
  for (TimedPose& p : positions.poses) p.pose.q = Eigen::Quaterniond::Identity();
  write_recording_log(folder / "truth.lcm", positions, "imu0", {1, 0, 0});
  MadeRun run;
  run.final_trajectory = disturbed(truth, 1.0, 0.0, &random);
  write_run_log(folder / "run.lcm", run);
  const Truth read = read_truth(folder / "truth.lcm");
  const RunMetrics m = evaluate_run(read_run(folder / "run.lcm"), read, {});
  EXPECT_STREQ(m.truth_point, "body");
  EXPECT_LT(m.final_metrics.absolute->rmse_m, 1e-4);
  EXPECT_FALSE(m.final_metrics.segments.has_value());
  EXPECT_FALSE(m.final_metrics.one_second.has_value());
  EvaluationOptions options;
  options.truth_point = TruthPoint::kCamera0;
  EXPECT_THROW((void)evaluate_run(read_run(folder / "run.lcm"), read, options), InputError);
}

TEST_F(EvaluateRun, DamagedLogIsReadAroundTheDamage) {
  write_recording_log(folder / "truth.lcm", truth, "", {0, 0, 0});
  const std::string whole = get(folder / "truth.lcm");
  put(folder / "cut.lcm",
      whole.substr(0, whole.size() / 2) + std::string(40, 'x') + whole.substr(whole.size() / 2 + 40));
  const std::size_t poses = read_truth(folder / "cut.lcm").body.poses.size();
  EXPECT_LT(poses, 201U + 1U);
  EXPECT_GE(poses, 199U);
}

TEST(Table, AlignsColumnsAndEndsWithTheLastRun) {
  RunMetrics a, b;
  a.name = "a";
  b.name = "a_longer_name";
  const std::string text = table_text({a, b});
  std::vector<std::string> lines;
  for (std::size_t begin = 0; begin < text.size(); begin = text.find('\n', begin) + 1) {
    lines.push_back(text.substr(begin, text.find('\n', begin) - begin));
  }
  ASSERT_EQ(lines.size(), 4U);
  for (const std::string& line : lines) EXPECT_EQ(line.size(), lines[0].size());
  EXPECT_TRUE(lines[3].starts_with("a_longer_name "));
}

TEST(JsonValue, EscapesAndKeepsOrder) {
  Json json = Json::object();
  json.set("z", "a\"b\\c\n");
  json.set("a", Json::Array{Json(1.5), Json(std::int64_t{-3}), Json(), Json(true), Json(std::nan(""))});
  EXPECT_EQ(json.dump(), R"({"z":"a\"b\\c\u000a","a":[1.5,-3,null,true,null]})");
}

// ---- conditions ----

std::vector<std::pair<std::string, Json>> two_runs() {
  const auto run = [](double ate) {
    Json final_metrics = Json::object();
    final_metrics.set("ate_rmse_m", ate);
    final_metrics.set("share", 0.99);
    Json json = Json::object();
    json.set("resets", std::int64_t{0});
    json.set("final", final_metrics);
    json.set("live", Json());
    return json;
  };
  return {{"vmp", run(0.5)}, {"base.line", run(0.51)}};
}

TEST(Expectation, ComparesMetricsOfRuns) {
  const auto runs = two_runs();
  EXPECT_TRUE(check_expectation("vmp.ate < base.line.ate", runs).holds);
  EXPECT_FALSE(check_expectation("vmp.ate > base.line.ate", runs).holds);
  EXPECT_TRUE(check_expectation("base.line.ate <= 1.03 vmp.ate", runs).holds);
  EXPECT_FALSE(check_expectation("base.line.ate<=1.01*vmp.ate", runs).holds);
  EXPECT_TRUE(check_expectation("vmp.final.share >= 0.98", runs).holds);
  EXPECT_TRUE(check_expectation("vmp.share == 0.99", runs).holds);
  EXPECT_TRUE(check_expectation("vmp.resets==0", runs).holds);
}

TEST(Expectation, AMissingFigureBreaksIt) {
  const auto runs = two_runs();
  EXPECT_FALSE(check_expectation("vmp.live.ate_rmse_m < 1", runs).holds);
  EXPECT_FALSE(check_expectation("vmp.live_ate > 1", runs).holds);
}

TEST(Expectation, WrongOnesAreRefused) {
  const auto runs = two_runs();
  for (const char* condition :
       {"", "vmp.ate", "vmp.ate <", "vmp.ate ! 3", "vmp.ate <> 3", "nothing.ate < 3", "vmp.nothing < 3",
        "vmp.ate < x vmp.ate", "vmp.ate < 1 2 3", "3 < vmp.ate", "vmp.ate < nan"}) {
    EXPECT_THROW((void)check_expectation(condition, runs), InputError) << condition;
  }
}

}  // namespace
}  // namespace farpoint::tools
