// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "tools/evaluate/statistics.h"
#include "tools/report/histogram.h"
#include "tools/report/html.h"
#include "tools/report/plot.h"
#include "tools/report/sections.h"

namespace farpoint::tools::report {
namespace {

// Depths of points less certain than this are left out.
constexpr float kMaxRelativeSigma = 0.30F;

std::vector<double> creation_depths(const RunRecord& run) {
  std::vector<double> depths;
  for (const landmark_t& l : run.landmarks()->landmarks) {
    if (l.creation_relative_sigma < kMaxRelativeSigma) depths.push_back(run.scale() * l.creation_depth);
  }
  return depths;
}

// Share of the points beyond each distance.
std::vector<Eigen::Vector2d> shares_beyond(std::vector<double> distances) {
  std::sort(distances.begin(), distances.end());
  std::vector<Eigen::Vector2d> points;
  for (std::size_t i = 0; i < distances.size(); ++i) {
    points.emplace_back(distances[i], 100.0 * static_cast<double>(distances.size() - i) /
                                          static_cast<double>(distances.size()));
  }
  return points;
}

std::string depth_histogram(const Runs& runs) {
  const std::string unit = runs[0].length_unit();
  const std::vector<double> bins = edges(1.0, 2000.0, 48, true);
  Plot plot({"Distance at which points were made",
             {"distance, " + unit, true, 1.0, 2000.0},
             {"points, % a bin"},
             false,
             520,
             320});
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (runs[i].landmarks() != nullptr)
      plot.steps(runs[i].name, bins, shares_percent(creation_depths(runs[i]), bins), run_style(i));
  }
  return plot.svg();
}

std::string beyond_view(const Runs& runs) {
  const std::string unit = runs[0].length_unit();
  Plot plot({"Points made beyond a distance",
             {"distance, " + unit, true, 10.0, 2000.0},
             {"share of all points, %", true, 0.01, 100.0},
             false,
             520,
             320});
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (runs[i].landmarks() != nullptr)
      plot.line(runs[i].name, shares_beyond(creation_depths(runs[i])), run_style(i));
  }
  return plot.svg();
}

std::string truth_view(const Runs& runs, const char* title, const char* y_label, double DistanceBin::*solid,
                       const char* solid_name, double DistanceBin::*thin, const char* thin_name) {
  constexpr std::size_t kFewest = 10;
  Plot plot({title, {"true distance, m", true}, {y_label, true}, false, 520, 340});
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (!runs[i].metrics || !runs[i].metrics->landmarks) continue;
    std::vector<Eigen::Vector2d> first, second;
    for (const DistanceBin& bin : runs[i].metrics->landmarks->bins) {
      if (bin.count < kFewest) continue;
      const double middle = std::sqrt(std::max(bin.from_m, 5.0) * bin.to_m);
      first.emplace_back(middle, bin.*solid);
      if (thin != nullptr) second.emplace_back(middle, bin.*thin);
    }
    plot.line(runs[i].name + ", " + solid_name, first, run_style(i));
    Style style = run_style(i);
    style.width_px = 0.9;
    if (thin != nullptr) plot.line(runs[i].name + ", " + thin_name, second, style);
  }
  return plot.svg();
}

std::vector<std::string> births_row(const RunRecord& run, const FarBirths& far) {
  return {run.name + ", beyond " + number(far.beyond_m, 0) + " m",
          std::to_string(far.count),
          number(far.share_percent, 2),
          std::to_string(far.through_vmp),
          number(far.wait_s, 2),
          number(far.wait_m, 1),
          number(far.parallax_deg, 2),
          number(far.born_at_m, 0)};
}

std::string births(const Runs& runs) {
  std::vector<std::vector<std::string>> rows = {{"points by true distance", "points", "share %",
                                                 "through a VMP", "made after s", "after m",
                                                 "at parallax deg", "at distance m"}};
  for (const RunRecord& run : runs) {
    if (!run.metrics || !run.metrics->landmarks) continue;
    for (const FarBirths& far : run.metrics->landmarks->far) rows.push_back(births_row(run, far));
  }
  return table(rows);
}

std::vector<double> vmp_lives_s(const RunRecord& run) {
  std::vector<double> lives_s;
  for (const landmark_t& l : run.landmarks()->landmarks) {
    if (l.through_vmp != 0) lives_s.push_back(seconds_between(l.anchor_utime, l.created_utime));
  }
  return lives_s;
}

// Where nearly all of the lives have ended: the few that take much longer would flatten the picture.
double longest_life_s(const Runs& runs) {
  double longest = 0.0;
  for (const RunRecord& run : runs) {
    if (run.landmarks() == nullptr) continue;
    const std::vector<double> lives_s = vmp_lives_s(run);
    if (!lives_s.empty()) longest = std::max(longest, percentile(lives_s, 99.5));
  }
  return std::max(std::ceil(longest), 1.0);
}

}  // namespace

std::string landmark_section(const Runs& runs) {
  if (std::none_of(runs.begin(), runs.end(), [](const RunRecord& r) { return r.landmarks() != nullptr; }))
    return {};
  std::string content = row_of({depth_histogram(runs), beyond_view(runs)});
  const bool judged = std::any_of(runs.begin(), runs.end(), [](const RunRecord& r) {
    return r.metrics && r.metrics->landmarks && r.metrics->landmarks->count > 0;
  });
  if (judged) {
    content +=
        "<p>Against the simulated world: true distance from the camera that first saw a landmark. The "
        "scale is that of the six seconds around it.</p>\n";
    content += row_of({truth_view(runs, "Error of distance", "error, % of the true distance",
                                  &DistanceBin::error_p50_percent, "median", &DistanceBin::error_p90_percent,
                                  "90th percentile"),
                       truth_view(runs, "Claimed sigma against real error", "% of the true distance",
                                  &DistanceBin::error_p50_percent, "median error",
                                  &DistanceBin::claimed_percent, "claimed sigma")});
    content += births(runs);
  }
  return section(
      "Landmarks",
      "Points alive at the end, at the distance from the keyframe that made them; only those whose "
      "claimed sigma was then under 30 %.",
      content);
}

std::string vmp_section(const Runs& runs) {
  const std::vector<double> bins = edges(0.0, longest_life_s(runs), 40);
  Plot life(
      {"Life as a virtual map point", {"first sighting to point, s"}, {"points, % a bin"}, false, 520, 320});
  Plot promoted({"Points made through virtual map points",
                 {"time since the first frame, s"},
                 {"points alive at the end, so far"},
                 false,
                 520,
                 320});
  std::vector<std::vector<std::string>> rows = {{"run", "VMPs made", "sightings attached", "merged",
                                                 "promoted", "rejected", "evicted", "alive at the end"}};
  bool any = false;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const summary_t* s = runs[i].summary();
    if (s == nullptr || runs[i].landmarks() == nullptr || s->vmp_made == 0) continue;
    any = true;
    std::vector<double> born_s;
    for (const landmark_t& l : runs[i].landmarks()->landmarks) {
      if (l.through_vmp != 0) born_s.push_back(seconds_of(l.created_utime) - runs[i].start_s);
    }
    std::sort(born_s.begin(), born_s.end());
    std::vector<Eigen::Vector2d> curve;
    for (std::size_t k = 0; k < born_s.size(); ++k) curve.emplace_back(born_s[k], static_cast<double>(k + 1));
    life.steps(runs[i].name, bins, shares_percent(vmp_lives_s(runs[i]), bins), run_style(i));
    promoted.line(runs[i].name, curve, run_style(i));
    rows.push_back({runs[i].name, std::to_string(s->vmp_made), std::to_string(s->vmp_attached),
                    std::to_string(s->vmp_merged), std::to_string(s->vmp_promoted),
                    std::to_string(s->vmp_rejected), std::to_string(s->vmp_evicted),
                    std::to_string(s->vmps)});
  }
  if (!any) return {};
  return section(
      "Virtual map points",
      "A virtual map point links the sightings of a landmark before its depth is known. Life times "
      "and promotions of those that became points and are still alive.",
      row_of({life.svg(), promoted.svg()}) + table(rows));
}

}  // namespace farpoint::tools::report
