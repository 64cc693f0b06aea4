// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

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

double reach_of(const Places& places, const Eigen::Vector2d& middle) {
  std::vector<double> distances;
  for (const auto* some : {&places.certain, &places.uncertain, &places.through_vmp})
    for (const Eigen::Vector2d& p : *some) distances.push_back((p - middle).cwiseAbs().maxCoeff());
  return distances.empty() ? 0.0 : percentile(distances, kNearlyAll_percent);
}

std::string picture(const RunRecord& run, const std::string& title, const Margin& margin) {
  const std::vector<Eigen::Vector2d> way = way_of(run);
  if (way.size() < 2) return {};
  const std::string unit = run.length_unit();
  const auto [middle, half_way] = square_around(way);
  const Places places = places_of(run);
  const double room = unit == "m" ? margin.metres : margin.share * half_way;
  const double half = std::min(half_way + room, std::max(1.1 * half_way, reach_of(places, middle)));
  Plot plot({run.name + ": " + title,
             {"x, " + unit, false, middle.x() - half, middle.x() + half},
             {"y, " + unit, false, middle.y() - half, middle.y() + half},
             true,
             520,
             520});
  plot.dots("sigma 30 % and more", places.uncertain, "#bbb", 1.6);
  plot.dots("points", places.certain, "#333", 1.8);
  plot.dots("points through VMPs", places.through_vmp, "#d8702a", 2.4);
  plot.line("way", way, {"#0b3c78", "", 2.0});
  return plot.svg();
}

}  // namespace

std::string map_section(const Runs& runs) {
  std::vector<std::string> pictures;
  for (const RunRecord& run : runs) {
    if (run.landmarks() == nullptr || run.landmarks()->landmarks.empty()) continue;
    pictures.push_back(picture(run, "near the way", {60.0, 0.2}));
    pictures.push_back(picture(run, "distant points too", {1200.0, 3.0}));
  }
  return section("Map", "Points of the map with most frames, from above, at the end of the run.",
                 row_of(pictures));
}

}  // namespace farpoint::tools::report
