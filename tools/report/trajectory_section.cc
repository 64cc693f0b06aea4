// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "tools/evaluate/statistics.h"
#include "tools/report/html.h"
#include "tools/report/motion.h"
#include "tools/report/plot.h"
#include "tools/report/sections.h"

namespace farpoint::tools::report {
namespace {

Trajectory final_in_world(const RunRecord& run) {
  return moved_by(run.world_from_map(), run.run.final_trajectory);
}

// Without truth only the poses of the final trajectory's map share a frame with it.
Trajectory live_in_world(const RunRecord& run) {
  if (!run.run.log) return {};
  if (run.metrics || run.run.final_trajectory.poses.empty())
    return moved_by(run.world_from_live_map(), run.live);
  return of_map(run.run.final_trajectory.poses.front().map_id, run.run.log->live_trajectory);
}

void label_ends(const Trajectory& trajectory, bool with_end, Plot* plot) {
  if (trajectory.poses.empty()) return;
  if (with_end) plot->label_point("end", trajectory.poses.back().pose.t.head<2>());
  plot->label_point("start", trajectory.poses.front().pose.t.head<2>());
}

std::string top_view(const Runs& runs, const Truth* truth, const std::string& unit) {
  Plot plot({"Trajectory from above", {"x, " + unit}, {"y, " + unit}, true, 520, 480});
  if (truth != nullptr) plot.line("truth", plan_of(truth_for(runs[0], *truth)), truth_style());
  for (std::size_t i = 0; i < runs.size(); ++i) {
    plot.line(runs[i].name + ", final", plan_of(final_in_world(runs[i])), run_style(i));
    Style live = thin_run_style(i);
    live.dash.clear();
    plot.line(runs[i].name + ", live", plan_of(live_in_world(runs[i])), live);
  }
  label_ends(final_in_world(runs[0]), false, &plot);
  return plot.svg();
}

std::vector<TimedVector> positions_of(const Trajectory& trajectory) {
  std::vector<TimedVector> positions;
  positions.reserve(trajectory.poses.size());
  for (const TimedPose& p : trajectory.poses) positions.push_back({p.time_s, p.pose.t});
  return positions;
}

std::string height_view(const Runs& runs, const Truth* truth, const std::string& unit) {
  double end_s = runs[0].start_s;
  for (const RunRecord& run : runs) end_s = std::max(end_s, run.end_s());
  Plot plot({"Height", {"time since the first frame, s"}, {"z, " + unit}, false, 520, 300});
  const auto add = [&](const std::string& name, const Trajectory& in_world, const Style& style) {
    plot.line(name, component_over_time(positions_of(in_world), 2, runs[0].start_s, end_s), style);
  };
  if (truth != nullptr) add("truth", truth_for(runs[0], *truth), truth_style());
  for (std::size_t i = 0; i < runs.size(); ++i) {
    add(runs[i].name + ", final", final_in_world(runs[i]), run_style(i));
    add(runs[i].name + ", live", live_in_world(runs[i]), thin_run_style(i));
  }
  return plot.svg();
}

// One picture a run; the colours of all span the same errors.
std::vector<std::string> error_paths(const Runs& runs, const Truth& truth) {
  std::vector<std::vector<PosePair>> pairs_of_runs;
  double high_m = 0.0;
  const auto error_m = [](const PosePair& p) { return (p.T_map_body.t - p.T_world_body.t).norm(); };
  for (const RunRecord& run : runs) {
    const bool is_aligned = run.metrics && run.metrics->final_metrics.absolute;
    pairs_of_runs.push_back(is_aligned ? pair_nearest(truth_for(run, truth), final_in_world(run))
                                       : std::vector<PosePair>{});
    std::vector<double> errors_m;
    errors_m.reserve(pairs_of_runs.back().size());
    for (const PosePair& pair : pairs_of_runs.back()) errors_m.push_back(error_m(pair));
    if (!errors_m.empty()) high_m = std::max(high_m, percentile(std::move(errors_m), 98.0));
  }
  std::vector<std::string> pictures;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    Plot plot({runs[i].name + ", final: position error", {"x, m"}, {"y, m"}, true, 520, 480});
    ColouredValues colours{{}, 0.0, high_m, "error after alignment, m"};
    Trajectory path;
    for (const PosePair& pair : pairs_of_runs[i]) {
      path.poses.push_back({pair.time_s, pair.T_map_body, pair.map_id});
      colours.values.push_back(error_m(pair));
    }
    std::vector<Eigen::Vector2d> points;
    points.reserve(path.poses.size());
    for (const TimedPose& p : path.poses) points.emplace_back(p.pose.t.head<2>());
    plot.coloured_line(std::move(points), std::move(colours));
    label_ends(path, true, &plot);
    pictures.push_back(plot.svg());
  }
  return pictures;
}

}  // namespace

std::string trajectory_section(const Runs& runs, const Truth* truth) {
  if (runs.empty()) return {};
  const std::string unit = runs[0].length_unit();
  std::vector<std::string> pictures = {top_view(runs, truth, unit), height_view(runs, truth, unit)};
  if (truth != nullptr) {
    for (std::string& picture : error_paths(runs, *truth)) pictures.push_back(std::move(picture));
  }
  const std::string how =
      truth == nullptr
          ? "Each run in its own map frame: there is no truth to align it with. final: after the last "
            "optimisation; live: as published, where it is of the same map."
          : "Runs aligned with truth; the live trajectory is aligned by itself. Gaps: no valid pose, or "
            "another "
            "map. start: the first pose of the first run.";
  return section("Trajectory", how, row_of(pictures));
}

}  // namespace farpoint::tools::report
