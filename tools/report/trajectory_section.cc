// SPDX-License-Identifier: Apache-2.0
#include "tools/report/html.h"
#include "tools/report/plot.h"
#include "tools/report/sections.h"

namespace farpoint::tools::report {
namespace {

// Way along a trajectory up to each pose.
std::vector<double> way_along(const Trajectory& trajectory) {
  std::vector<double> way;
  for (std::size_t i = 0; i < trajectory.poses.size(); ++i) {
    const double step = i == 0 ? 0.0 : (trajectory.poses[i].pose.t - trajectory.poses[i - 1].pose.t).norm();
    way.push_back(i == 0 ? 0.0 : way.back() + step);
  }
  return way;
}

// The truth at the point of the vehicle that this run was compared at.
Trajectory truth_for(const RunRecord& run, const Truth& truth) {
  Trajectory moved = truth.body;
  if (run.metrics && std::string(run.metrics->truth_point) == "camera0")
    move_reference_point({Eigen::Quaterniond::Identity(), truth.T_body_camera0.t}, &moved);
  return moved;
}

std::vector<Eigen::Vector2d> error_points(const Trajectory& truth, const Trajectory& estimate,
                                          const slam::Sim3& world_from_map) {
  const std::vector<double> way = way_along(truth);
  std::vector<Eigen::Vector2d> points;
  std::size_t at = 0;
  for (const PosePair& pair : pair_nearest(truth, estimate)) {
    while (at + 1 < truth.poses.size() && truth.poses[at].time_s < pair.time_s - 1e-3) ++at;
    points.emplace_back(way[at], (world_from_map * pair.T_map_body.t - pair.T_world_body.t).norm());
  }
  return points;
}

std::string top_view(const Runs& runs, const Truth* truth, const std::string& unit) {
  Plot plot({"Trajectory from above", {"x, " + unit}, {"y, " + unit}, true, 520, 460});
  if (truth != nullptr) {
    std::vector<Eigen::Vector2d> points;
    for (const TimedPose& p : truth_for(runs[0], *truth).poses) points.push_back(p.pose.t.head<2>());
    plot.line("truth", points, truth_style());
  }
  for (std::size_t i = 0; i < runs.size(); ++i) {
    std::vector<Eigen::Vector2d> points;
    for (const TimedPose& p : runs[i].run.final_trajectory.poses)
      points.push_back((runs[i].world_from_map() * p.pose.t).head<2>());
    plot.line(runs[i].name + ", final", points, run_style(i));
  }
  return plot.svg();
}

std::string height_view(const Runs& runs, const Truth* truth, const std::string& unit) {
  Plot plot({"Height", {"way, " + unit}, {"z, " + unit}, false, 520, 300});
  const auto add = [&](const std::string& name, const Trajectory& trajectory, const slam::Sim3& S,
                       const Style& style) {
    const std::vector<double> way = way_along(trajectory);
    std::vector<Eigen::Vector2d> points;
    for (std::size_t k = 0; k < way.size(); ++k)
      points.emplace_back(S.scale * way[k], (S * trajectory.poses[k].pose.t).z());
    plot.line(name, points, style);
  };
  if (truth != nullptr) add("truth", truth_for(runs[0], *truth), {}, truth_style());
  for (std::size_t i = 0; i < runs.size(); ++i)
    add(runs[i].name + ", final", runs[i].run.final_trajectory, runs[i].world_from_map(), run_style(i));
  return plot.svg();
}

std::string error_view(const Runs& runs, const Truth& truth) {
  Plot plot({"Position error over the way", {"true way, m"}, {"error after alignment, m"}, false, 520, 300});
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (!runs[i].metrics || !runs[i].metrics->final_metrics.absolute) continue;
    const Trajectory moved = truth_for(runs[i], truth);
    plot.line(runs[i].name + ", final",
              error_points(moved, runs[i].run.final_trajectory, runs[i].world_from_map()), run_style(i));
    Style thin = run_style(i);
    thin.width_px = 0.8;
    const auto& live = runs[i].metrics->live_metrics;
    if (live && live->absolute) {
      plot.line(
          runs[i].name + ", live",
          error_points(moved, runs[i].run.log->live_trajectory, live->absolute->map_to_world.S_world_map),
          thin);
    }
  }
  return plot.svg();
}

}  // namespace

std::string trajectory_section(const Runs& runs, const Truth* truth) {
  if (runs.empty()) return {};
  const std::string unit = runs[0].length_unit();
  std::vector<std::string> pictures = {top_view(runs, truth, unit), height_view(runs, truth, unit)};
  if (truth != nullptr) pictures.push_back(error_view(runs, *truth));
  return section("Trajectory",
                 truth == nullptr ? "Each run in its own map frame: there is no truth to align it with."
                                  : "Runs aligned with truth. The live trajectory is aligned by itself.",
                 row_of(pictures));
}

}  // namespace farpoint::tools::report
