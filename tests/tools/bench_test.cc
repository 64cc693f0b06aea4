// SPDX-License-Identifier: Apache-2.0
// What `farpoint bench` makes of the times of single frames, and the command as a whole.
#include <gtest/gtest.h>

#include "tests/tools/tool_support.h"
#include "tools/bench/bench.h"
#include "tools/bench/report.h"
#include "tools/common/errors.h"
#include "tools/import/kitti.h"
#include "tools/import/recording_log.h"

namespace farpoint::tools {
namespace {

// Frame i has a yardstick of 10 ms and i % 5 more, `slowdown` times; tracking takes half of that.
BenchPass made_pass(std::size_t frames, double slowdown) {
  BenchPass pass;
  for (std::size_t i = 0; i < frames; ++i) {
    FrameTimes t;
    t.cpu_ms.fill(-1.0);
    t.wall_ms.fill(-1.0);
    t.yardstick_ms = slowdown * (10.0 + static_cast<double>(i % 5));
    t.cpu_ms[timing_t::STAGE_TRACKING] = 0.5 * t.yardstick_ms;
    t.wall_ms[timing_t::STAGE_TRACKING] = t.yardstick_ms;
    t.process_cpu_ms = 3.0 * t.yardstick_ms;
    pass.frames.push_back(t);
  }
  return pass;
}

const BenchStage* stage(const BenchReport& report, const std::string& name) {
  for (const BenchStage& s : report.stages)
    if (s.name == name) return &s;
  return nullptr;
}

TEST(BenchReport, DisturbanceComparesFramesWithThemselves) {
  // Frames differ by 40 % among themselves: no disturbance.
  EXPECT_EQ(disturbances({made_pass(50, 1.0), made_pass(50, 1.0)}), (std::vector<double>{1.0, 1.0}));
  const std::vector<double> d = disturbances({made_pass(50, 1.0), made_pass(50, 2.0)});
  EXPECT_DOUBLE_EQ(d[0], 1.0);
  EXPECT_DOUBLE_EQ(d[1], 2.0);
}

TEST(BenchReport, AFewSlowFramesAreNoDisturbance) {
  BenchPass hiccup = made_pass(100, 1.0);
  for (std::size_t i = 0; i < 8; ++i) hiccup.frames[12 * i].yardstick_ms *= 10.0;
  EXPECT_DOUBLE_EQ(disturbances({made_pass(100, 1.0), hiccup})[1], 1.0);
  for (std::size_t i = 0; i < 12; ++i) hiccup.frames[8 * i + 1].yardstick_ms *= 10.0;
  EXPECT_GT(disturbances({made_pass(100, 1.0), hiccup})[1], kDisturbed);
}

TEST(BenchReport, CallsForMorePassesUntilEnoughAreCalm) {
  std::vector<BenchPass> passes{made_pass(20, 1.0), made_pass(20, 1.1), made_pass(20, 1.4)};
  EXPECT_TRUE(enough_calm_passes(passes, 2));
  EXPECT_FALSE(enough_calm_passes(passes, 3));
  passes.push_back(made_pass(20, 1.2));
  EXPECT_TRUE(enough_calm_passes(passes, 3));
}

TEST(BenchReport, PoolsTheCalmestPasses) {
  const BenchReport report = make_report({made_pass(100, 3.0), made_pass(100, 1.0), made_pass(100, 1.0)}, 2);
  EXPECT_EQ(report.frames, 200U);
  EXPECT_EQ(report.passes, 2U);
  EXPECT_EQ(report.passes_run, 3U);
  EXPECT_DOUBLE_EQ(report.disturbance, 1.0);
  EXPECT_DOUBLE_EQ(report.yardstick_p50_ms, 12.0);
  EXPECT_DOUBLE_EQ(report.yardstick_p99_ms, 14.0);
  EXPECT_DOUBLE_EQ(report.process_cpu_ms, 36.0);
  const BenchStage* tracking = stage(report, "tracking");
  ASSERT_NE(tracking, nullptr);
  EXPECT_EQ(tracking->frames, 200U);
  EXPECT_DOUBLE_EQ(tracking->p50_ms, 6.0);
  EXPECT_DOUBLE_EQ(tracking->max_ms, 7.0);
  ASSERT_NE(stage(report, "tracking_wall"), nullptr);
  EXPECT_DOUBLE_EQ(stage(report, "tracking_wall")->p50_ms, 12.0);
}

TEST(BenchReport, FramesInWhichAStageDidNotRunDoNotCount) {
  BenchPass pass = made_pass(10, 1.0);
  for (std::size_t i = 0; i < 4; ++i) pass.frames[i].cpu_ms[timing_t::STAGE_TRACKING] = -1.0;
  pass.frames[3].cpu_ms[timing_t::STAGE_MAPPING] = 30.0;
  const BenchReport report = make_report({pass}, 1);
  EXPECT_EQ(stage(report, "tracking")->frames, 6U);
  EXPECT_EQ(stage(report, "mapping")->frames, 1U);
  EXPECT_DOUBLE_EQ(stage(report, "mapping")->p99_ms, 30.0);
  EXPECT_EQ(stage(report, "local_ba"), nullptr) << "a stage that never ran has no row";
}

TEST(BenchReport, JsonHasThePromisedShape) {
  BenchPass pass = made_pass(100, 1.0);
  for (FrameTimes& t : pass.frames) t.wall_ms.fill(-1.0);
  EXPECT_EQ(
      to_json(make_report({pass}, 1)).dump(),
      R"({"yardstick_ms":{"p50":12,"p99":14},"stages":{"tracking":{"p50_ms":6,"p99_ms":7,"max_ms":7,)"
      R"("p50_yardsticks":0.5,"p99_yardsticks":0.5833333333}},"process_cpu_yardsticks":3,"frames":100})");
}

TEST(BenchReport, TextNamesEveryStageAndTheYardstick) {
  const std::string text = to_text(make_report({made_pass(10, 1.0)}, 1));
  for (const char* part : {"tracking ", "tracking_wall", "yardstick", "process CPU", "disturbance"})
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
}

TEST(Bench, MeasuresEveryFrameOfARecording) {
  const ScratchFolder folder;
  make_kitti(folder.path());
  const std::string log = (folder / "k.lcm").string();
  write_recording(read_kitti(folder.path().string(), "07"), log);
  std::size_t last_pass = 0, calls = 0;
  const BenchReport report = run_bench({log, 2}, {}, [&](std::size_t pass, double share) {
    last_pass = pass;
    ++calls;
    EXPECT_LE(share, 1.0);
  });
  EXPECT_EQ(report.frames, 10U);  // five a pass
  EXPECT_EQ(report.passes, 2U);
  EXPECT_EQ(report.passes_run, last_pass);
  EXPECT_EQ(calls, 5 * last_pass);
  EXPECT_GT(report.yardstick_p50_ms, 0.0);
  EXPECT_GT(report.process_cpu_ms, 0.0);
  ASSERT_NE(stage(report, "extraction"), nullptr);
  EXPECT_EQ(stage(report, "extraction")->frames, 10U);
  EXPECT_EQ(stage(report, "tracking"), nullptr) << "nothing to track against in five flat images";
}

TEST(Bench, RefusesWhatItCannotMeasure) {
  const ScratchFolder folder;
  put(folder / "empty.lcm", "");
  EXPECT_THROW((void)run_bench({(folder / "none.lcm").string(), 1}, {}, [](std::size_t, double) {}),
               InputError);
  EXPECT_THROW((void)run_bench({(folder / "empty.lcm").string(), 1}, {}, [](std::size_t, double) {}),
               InputError);
}

TEST(Program, BenchSpeaksJsonAndRefusesWrongUse) {
  const ScratchFolder folder;
  make_kitti(folder.path());
  const std::string log = (folder / "k.lcm").string();
  write_recording(read_kitti(folder.path().string(), "07"), log);
  const ProgramResult json = run_farpoint_program("bench '" + log + "' --passes 1 --json");
  EXPECT_EQ(json.status, 0) << json.err;
  EXPECT_EQ(json.out.rfind("{\"yardstick_ms\":{\"p50\":", 0), 0U) << json.out;
  EXPECT_NE(json.out.find("\"frames\":5}"), std::string::npos) << json.out;
  for (const char* wrong : {"bench -", "bench nowhere.lcm", "bench --passes 0 nowhere.lcm"})
    EXPECT_EQ(run_farpoint_program(wrong).status, 2) << wrong;
  const ProgramResult key = run_farpoint_program("bench '" + log + "' --set no.such=1");
  EXPECT_EQ(key.status, 2);
  EXPECT_NE(key.err.find("no.such"), std::string::npos) << key.err;
}

}  // namespace
}  // namespace farpoint::tools
