// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>

#include "tools/evaluate/landmark_truth.h"
#include "tools/evaluate/statistics.h"
#include "tools/report/html.h"
#include "tools/report/motion.h"
#include "tools/report/plot.h"
#include "tools/report/sections.h"

namespace farpoint::tools::report {
namespace {

using PointList = std::vector<Eigen::Vector2d>;

// A value of each pair over the true way; `value` gets the pair.
template <typename Value>
PointList over_the_way(const Trajectory& truth, const std::vector<PosePair>& pairs, Value&& value) {
  const std::vector<double> way = way_along(truth);
  PointList points;
  std::size_t at = 0;
  for (const PosePair& pair : pairs) {
    while (at + 1 < truth.poses.size() && truth.poses[at].time_s < pair.time_s - 1e-3) ++at;
    points.emplace_back(way[at], value(pair));
  }
  return points;
}

PointList error_points(const Trajectory& truth, const Trajectory& estimate,
                       const slam::Sim3& world_from_map) {
  return over_the_way(truth, pair_nearest(truth, estimate), [&](const PosePair& pair) {
    return (world_from_map * pair.T_map_body.t - pair.T_world_body.t).norm();
  });
}

std::string error_view(const Runs& runs, const Truth& truth) {
  Plot plot({"Position error over the way", {"true way, m"}, {"error after alignment, m"}, false, 520, 300});
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (!runs[i].metrics || !runs[i].metrics->final_metrics.absolute) continue;
    const Trajectory moved = truth_for(runs[i], truth);
    plot.line(runs[i].name + ", final",
              error_points(moved, runs[i].run.final_trajectory, runs[i].world_from_map()), run_style(i));
    const auto& live = runs[i].metrics->live_metrics;
    if (live && live->absolute) {
      plot.line(runs[i].name + ", live", error_points(moved, runs[i].live, runs[i].world_from_live_map()),
                thin_run_style(i));
    }
  }
  return plot.svg();
}

// Of the final trajectory: the scale of six seconds as a share of the whole run's.
std::string scale_view(const Runs& runs, const Truth& truth) {
  constexpr std::size_t kMostSamples = 400;
  Plot plot({"Scale over the way", {"true way, m"}, {"scale of six seconds / the run's"}, false, 520, 300});
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (!runs[i].metrics || !runs[i].metrics->final_metrics.absolute) continue;
    const Trajectory moved = truth_for(runs[i], truth);
    const std::vector<PosePair> pairs = pair_nearest(moved, runs[i].run.final_trajectory);
    std::vector<PosePair> samples;
    const std::size_t step = pairs.size() / kMostSamples + 1;
    for (std::size_t k = 0; k < pairs.size(); k += step) samples.push_back(pairs[k]);
    const double whole = runs[i].scale();
    plot.line(
        runs[i].name + ", final",
        over_the_way(moved, samples,
                     [&](const PosePair& pair) { return local_scale(pairs, pair.time_s, NAN) / whole; }),
        run_style(i));
  }
  plot.mark_y("", 1.0, {"#777", "3 3", 1.2});
  return plot.svg();
}

// Those over ten steps of the path: shorter ones end up to a step beyond their length.
std::vector<double> lengths_for(const std::vector<PosePair>& pairs) {
  constexpr double kFewestSteps = 10.0;
  constexpr std::array kLengths_m = {1.0,   2.0,   5.0,   10.0,  20.0,  50.0,  100.0,  200.0,
                                     300.0, 400.0, 500.0, 600.0, 700.0, 800.0, 1000.0, 2000.0};
  std::vector<double> steps_m, lengths_m;
  for (std::size_t i = 1; i < pairs.size(); ++i)
    steps_m.push_back((pairs[i].T_world_body.t - pairs[i - 1].T_world_body.t).norm());
  const double shortest_m = kFewestSteps * percentile(std::move(steps_m), 50.0);
  for (const double length_m : kLengths_m) {
    if (length_m >= shortest_m) lengths_m.push_back(length_m);
  }
  return lengths_m;
}

struct LengthView {
  const char* title;
  const char* y_label;
  double SegmentError::*error;
};

std::string length_view(const Runs& runs, const Truth& truth, const LengthView& view) {
  constexpr std::size_t kFewest = 5;
  Plot plot({view.title, {"length of the true path, m", true}, {view.y_label, false, 0.0}, false, 520, 300});
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (!runs[i].metrics || !runs[i].metrics->final_metrics.absolute) continue;
    PointList points;
    const std::vector<PosePair> pairs = pair_nearest(truth_for(runs[i], truth), runs[i].run.final_trajectory);
    for (const LengthError& e : segment_errors(pairs, runs[i].scale(), lengths_for(pairs))) {
      if (e.error.segments >= kFewest) points.emplace_back(e.length_m, e.error.*view.error);
    }
    plot.line(runs[i].name + ", final", points, run_style(i));
  }
  return plot.svg();
}

}  // namespace

std::string error_section(const Runs& runs, const Truth* truth) {
  if (runs.empty() || truth == nullptr) return {};
  std::vector<std::string> pictures = {error_view(runs, *truth), scale_view(runs, *truth)};
  if (truth->body.has_orientation) {
    pictures.push_back(length_view(runs, *truth,
                                   {"Relative error of position (RPE) by length",
                                    "mean error, % of the length", &SegmentError::translation_percent}));
    pictures.push_back(length_view(runs, *truth,
                                   {"Relative error of rotation (RPE) by length", "mean error, deg/m",
                                    &SegmentError::rotation_deg_per_m}));
  }
  return section(
      "Errors",
      "Position error after alignment. Scale: six seconds of the final trajectory aligned by themselves; "
      "where it departs from 1, the map's unit has drifted. RPE: mean over stretches of one length, begun "
      "at every tenth pose, where five of them fit and one has ten poses.",
      row_of(pictures));
}

}  // namespace farpoint::tools::report
