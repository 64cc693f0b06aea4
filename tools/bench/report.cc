// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/report.h"

#include <algorithm>
#include <cstdio>
#include <numeric>

#include "tools/evaluate/statistics.h"

namespace farpoint::tools {
namespace {

struct StageName {
  int stage;
  const char* name;
};
// In the order of a frame's way.
constexpr StageName kStageNames[] = {
    {timing_t::STAGE_TRACKING, "tracking"},
    {timing_t::STAGE_PYRAMID, "pyramid"},
    {timing_t::STAGE_EXTRACTION, "extraction"},
    {timing_t::STAGE_MATCHING, "matching"},
    {timing_t::STAGE_ALIGNMENT, "alignment"},
    {timing_t::STAGE_POSE, "pose"},
    {timing_t::STAGE_KEYFRAME, "keyframe"},
    {timing_t::STAGE_MAPPING, "mapping"},
    {timing_t::STAGE_TRIANGULATION, "triangulation"},
    {timing_t::STAGE_FUSING, "fusing"},
    {timing_t::STAGE_LOCAL_BA, "local_ba"},
    {daemon::StageClock::kCalibration, "calibration"},
    {timing_t::STAGE_CULLING, "culling"},
    {timing_t::STAGE_DECODE, "decode"},
};
// What a controller waits for is elapsed time, whatever used it.
constexpr StageName kWallStageNames[] = {{timing_t::STAGE_TRACKING, "tracking_wall"},
                                         {timing_t::STAGE_MAPPING, "mapping_wall"}};

using StageTimes = std::array<double, daemon::StageClock::kStages> FrameTimes::*;

void add_stage(const std::vector<const BenchPass*>& passes, const StageName& stage, StageTimes times,
               BenchReport* report) {
  std::vector<double> values;
  for (const BenchPass* pass : passes) {
    for (const FrameTimes& frame : pass->frames) {
      const double ms = (frame.*times)[static_cast<std::size_t>(stage.stage)];
      if (ms >= 0.0) values.push_back(ms);
    }
  }
  if (values.empty()) return;
  report->stages.push_back({stage.name, values.size(), percentile(values, 50), percentile(values, 99),
                            *std::max_element(values.begin(), values.end())});
}

std::vector<std::size_t> calmest_first(const std::vector<double>& disturbance) {
  std::vector<std::size_t> order(disturbance.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return disturbance[a] < disturbance[b]; });
  return order;
}

std::string line(const char* format, auto... values) {
  char text[200];
  std::snprintf(text, sizeof(text), format, values...);
  return text;
}

}  // namespace

std::vector<double> disturbances(const std::vector<BenchPass>& passes) {
  std::vector<double> out;
  for (const BenchPass& pass : passes) {
    std::vector<double> slowdown;
    for (std::size_t i = 0; i < pass.frames.size(); ++i) {
      double least_ms = pass.frames[i].yardstick_ms;
      for (const BenchPass& other : passes) least_ms = std::min(least_ms, other.frames[i].yardstick_ms);
      slowdown.push_back(pass.frames[i].yardstick_ms / std::max(least_ms, 1e-9));
    }
    out.push_back(percentile(std::move(slowdown), 90));
  }
  return out;
}

bool enough_calm_passes(const std::vector<BenchPass>& passes, std::size_t count) {
  const std::vector<double> all = disturbances(passes);
  return static_cast<std::size_t>(
             std::count_if(all.begin(), all.end(), [](double d) { return d <= kDisturbed; })) >= count;
}

BenchReport make_report(const std::vector<BenchPass>& passes, std::size_t count) {
  const std::vector<double> disturbance = disturbances(passes);
  std::vector<std::size_t> order = calmest_first(disturbance);
  order.resize(count);
  BenchReport report;
  std::vector<const BenchPass*> used;
  for (const std::size_t i : order) {
    used.push_back(&passes[i]);
    report.disturbance = std::max(report.disturbance, disturbance[i]);
  }
  std::vector<double> yardstick, process;
  for (const BenchPass* pass : used) {
    for (const FrameTimes& frame : pass->frames) {
      yardstick.push_back(frame.yardstick_ms);
      process.push_back(frame.process_cpu_ms);
    }
  }
  report.yardstick_p50_ms = percentile(yardstick, 50);
  report.yardstick_p99_ms = percentile(yardstick, 99);
  report.process_cpu_ms = mean(process);
  report.frames = yardstick.size();
  report.passes = count;
  report.passes_run = passes.size();
  for (const StageName& stage : kStageNames) add_stage(used, stage, &FrameTimes::cpu_ms, &report);
  for (const StageName& stage : kWallStageNames) add_stage(used, stage, &FrameTimes::wall_ms, &report);
  return report;
}

Json to_json(const BenchReport& report) {
  const double yardstick_ms = report.yardstick_p50_ms;
  Json yardstick = Json::object();
  yardstick.set("p50", report.yardstick_p50_ms);
  yardstick.set("p99", report.yardstick_p99_ms);
  Json stages = Json::object();
  for (const BenchStage& s : report.stages) {
    Json stage = Json::object();
    stage.set("p50_ms", s.p50_ms);
    stage.set("p99_ms", s.p99_ms);
    stage.set("max_ms", s.max_ms);
    stage.set("p50_yardsticks", s.p50_ms / yardstick_ms);
    stage.set("p99_yardsticks", s.p99_ms / yardstick_ms);
    stages.set(s.name, std::move(stage));
  }
  Json json = Json::object();
  json.set("yardstick_ms", std::move(yardstick));
  json.set("stages", std::move(stages));
  json.set("process_cpu_yardsticks", report.process_cpu_ms / yardstick_ms);
  json.set("frames", static_cast<std::int64_t>(report.frames));
  return json;
}

std::string to_text(const BenchReport& report) {
  const double yardstick_ms = report.yardstick_p50_ms;
  std::string text = line("%-15s %7s %8s %8s %8s   %s\n", "", "frames", "p50 ms", "p99 ms", "max ms",
                          "p50, p99, max in yardsticks");
  for (const BenchStage& s : report.stages) {
    text +=
        line("%-15s %7zu %8.2f %8.2f %8.2f   %5.2f %5.2f %5.2f\n", s.name.c_str(), s.frames, s.p50_ms,
             s.p99_ms, s.max_ms, s.p50_ms / yardstick_ms, s.p99_ms / yardstick_ms, s.max_ms / yardstick_ms);
  }
  text += line("yardstick (cv::ORB, 2000 features): p50 %.2f ms, p99 %.2f ms\n", report.yardstick_p50_ms,
               report.yardstick_p99_ms);
  text += line("process CPU a frame: %.2f ms, %.2f yardsticks\n", report.process_cpu_ms,
               report.process_cpu_ms / yardstick_ms);
  text += line("%zu frames in %zu passes of %zu run; disturbance %.2f\n", report.frames, report.passes,
               report.passes_run, report.disturbance);
  return text;
}

}  // namespace farpoint::tools
