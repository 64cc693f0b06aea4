// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <tuple>

#include "tools/evaluate/statistics.h"
#include "tools/report/html.h"
#include "tools/report/plot.h"
#include "tools/report/sections.h"

namespace farpoint::tools::report {
namespace {

constexpr float kCertain = 0.30F;  // claimed relative sigma

struct Places {
  std::vector<Eigen::Vector2d> certain, uncertain, through_vmp;
};

Places places_of(const RunRecord& run) {
  Places places;
  const slam::Sim3 S = run.world_from_map();
  const std::int32_t map_id =
      run.run.final_trajectory.poses.empty() ? -1 : run.run.final_trajectory.poses.front().map_id;
  for (const landmark_t& l : run.landmarks()->landmarks) {
    if (l.map_id != map_id) continue;
    const Eigen::Vector2d p = (S * Eigen::Vector3d(l.position[0], l.position[1], l.position[2])).head<2>();
    if (l.relative_sigma >= kCertain)
      places.uncertain.push_back(p);
    else
      (l.through_vmp != 0 ? places.through_vmp : places.certain).push_back(p);
  }
  return places;
}

std::vector<Eigen::Vector2d> way_of(const RunRecord& run) {
  std::vector<Eigen::Vector2d> way;
  way.reserve(run.run.final_trajectory.poses.size());
  for (const TimedPose& p : run.run.final_trajectory.poses)
    way.emplace_back((run.world_from_map() * p.pose.t).head<2>());
  return way;
}

// A square about the middle of the way, and half its side.
std::pair<Eigen::Vector2d, double> square_around(const std::vector<Eigen::Vector2d>& way) {
  Eigen::Vector2d low = way.front(), high = way.front();
  for (const Eigen::Vector2d& p : way) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return {0.5 * (low + high), 0.5 * (high - low).maxCoeff()};
}

// Around the way: metres, or in map units a share of half the way's extent; never more than nearly all points
// need, since few far ones would leave the picture empty.
struct Margin {
  double metres, share;
};
constexpr double kNearlyAll_percent = 99.0;
// Of the near picture's side: a far picture that is hardly larger shows the same once more.
constexpr double kWider = 1.2;

double reach_of(const Places& places, const Eigen::Vector2d& middle) {
  std::vector<double> distances;
  for (const auto* some : {&places.certain, &places.uncertain, &places.through_vmp})
    for (const Eigen::Vector2d& p : *some) distances.push_back((p - middle).cwiseAbs().maxCoeff());
  return distances.empty() ? 0.0 : percentile(distances, kNearlyAll_percent);
}

// What the pictures of one run share.
struct MapView {
  std::vector<Eigen::Vector2d> way;
  Places places;
  Eigen::Vector2d middle;
  double half_way, reach;
};

MapView view_of(const RunRecord& run) {
  MapView view{way_of(run), places_of(run), {0, 0}, 0.0, 0.0};
  if (view.way.empty()) return view;
  std::tie(view.middle, view.half_way) = square_around(view.way);
  view.reach = std::max(1.1 * view.half_way, reach_of(view.places, view.middle));
  return view;
}

double half_side(const MapView& view, const Margin& margin, bool is_metric) {
  return std::min(view.half_way + (is_metric ? margin.metres : margin.share * view.half_way), view.reach);
}

std::string picture(const RunRecord& run, const MapView& view, const std::string& title, double half) {
  const std::string unit = run.length_unit();
  Plot plot({run.name + ": " + title,
             {"x, " + unit, false, view.middle.x() - half, view.middle.x() + half},
             {"y, " + unit, false, view.middle.y() - half, view.middle.y() + half},
             true,
             520,
             520});
  plot.dots("sigma 30 % and more", view.places.uncertain, "#bbb", 1.6);
  plot.dots("points", view.places.certain, "#333", 1.8);
  plot.dots("points through VMPs", view.places.through_vmp, "#d8702a", 2.4);
  plot.line("way", view.way, {"#0b3c78", "", 2.0});
  return plot.svg();
}

}  // namespace

std::string map_section(const Runs& runs) {
  std::vector<std::string> pictures;
  for (const RunRecord& run : runs) {
    if (run.landmarks() == nullptr || run.landmarks()->landmarks.empty()) continue;
    const MapView view = view_of(run);
    if (view.way.size() < 2) continue;
    const bool is_metric = run.length_unit() == "m";
    const double near = half_side(view, {60.0, 0.2}, is_metric);
    const double far = half_side(view, {1200.0, 3.0}, is_metric);
    pictures.push_back(picture(run, view, "near the way", near));
    if (far > kWider * near) pictures.push_back(picture(run, view, "distant points too", far));
  }
  return section("Map", "Points of the map with most frames, from above, at the end of the run.",
                 row_of(pictures));
}

}  // namespace farpoint::tools::report
