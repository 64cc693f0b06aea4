// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

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

// Half of the values of a normal deviate lie within this many sigmas.
constexpr double kMedianOfNormal = 0.6745;

// Share of the points beyond each distance.
std::vector<Eigen::Vector2d> shares_beyond(std::vector<double> distances) {
  std::erase_if(distances, [](double d) { return !std::isfinite(d); });
  std::sort(distances.begin(), distances.end());
  std::vector<Eigen::Vector2d> points;
  for (std::size_t i = 0; i < distances.size(); ++i) {
    points.emplace_back(distances[i], 100.0 * static_cast<double>(distances.size() - i) /
                                          static_cast<double>(distances.size()));
  }
  return points;
}

// From nearly the nearest to the farthest point of all runs; empty without points.
std::optional<std::pair<double, double>> range_of_depths(const Runs& runs) {
  double low = 1e300, high = 0.0;
  for (const RunRecord& run : runs) {
    if (run.landmarks() == nullptr) continue;
    std::vector<double> depths = creation_depths(run);
    std::erase_if(depths, [](double d) { return !(d > 0.0 && d < 1e9); });
    if (depths.empty()) continue;
    low = std::min(low, percentile(depths, 0.2));
    high = std::max(high, *std::max_element(depths.begin(), depths.end()));
  }
  if (!(low < high)) return std::nullopt;
  return std::pair(low, 1.05 * high);
}

std::string depth_histogram(const Runs& runs) {
  const auto range = range_of_depths(runs);
  if (!range) return {};
  const std::vector<double> bins = edges(range->first, range->second, 48, true);
  Plot plot({"Distance at which points were made",
             {"distance, " + runs[0].length_unit(), true, range->first, range->second},
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
  const auto range = range_of_depths(runs);
  if (!range) return {};
  Plot plot({"Points made beyond a distance",
             {"distance, " + runs[0].length_unit(), true, range->first, range->second},
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

struct DistanceCurve {
  const char* name;
  double DistanceBin::*value;
  double factor = 1.0;
};

// The first curve thick, the second thin.
std::string truth_view(const Runs& runs, const char* title, const char* y_label,
                       const std::array<DistanceCurve, 2>& curves) {
  constexpr std::size_t kFewest = 10;
  Plot plot({title, {"true distance, m", true}, {y_label, true}, false, 520, 340});
  for (std::size_t i = 0; i < runs.size(); ++i) {
    if (!runs[i].metrics || !runs[i].metrics->landmarks) continue;
    for (std::size_t k = 0; k < curves.size(); ++k) {
      std::vector<Eigen::Vector2d> points;
      for (const DistanceBin& bin : runs[i].metrics->landmarks->bins) {
        const double middle = std::sqrt(std::max(bin.from_m, 5.0) * bin.to_m);
        if (bin.count >= kFewest) points.emplace_back(middle, curves[k].factor * (bin.*curves[k].value));
      }
      plot.line(runs[i].name + ", " + curves[k].name, points, k == 0 ? run_style(i) : thin_run_style(i));
    }
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

double median_step_s(const std::vector<double>& times_s) {
  std::vector<double> steps_s;
  for (std::size_t i = 1; i < times_s.size(); ++i) steps_s.push_back(times_s[i] - times_s[i - 1]);
  return percentile(std::move(steps_s), 50.0);
}

// Bins that the spacing of the keyframes, at which points begin and end as VMPs, does not show in.
std::vector<double> life_edges(const Runs& runs) {
  constexpr int kMostBins = 40;
  double frame_s = 0.0, keyframe_s = 0.0;
  for (const RunRecord& run : runs) {
    std::vector<double> frames_s, keyframes_s;
    for (const PublishedFrame& f : run.frames) {
      frames_s.push_back(f.time_s);
      if (f.keyframe) keyframes_s.push_back(f.time_s);
    }
    const double frame = median_step_s(frames_s), keyframe = median_step_s(keyframes_s);
    if (frame > frame_s && frame < 1e3) frame_s = frame;
    if (keyframe > keyframe_s && keyframe < 1e3) keyframe_s = keyframe;
  }
  const double longest_s = longest_life_s(runs);
  if (frame_s <= 0.0 || keyframe_s < frame_s || keyframe_s > longest_s)
    return edges(0.0, longest_s, kMostBins);
  return keyframe_edges(longest_s, frame_s, static_cast<int>(std::lround(keyframe_s / frame_s)), kMostBins);
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
        "scale is that of the six seconds around it. Half of the errors of an honest claim lie within 0.67 "
        "of its "
        "sigma.</p>\n";
    content +=
        row_of({truth_view(runs, "Error of distance", "error, % of the true distance",
                           {{{"median", &DistanceBin::error_p50_percent},
                             {"90th percentile", &DistanceBin::error_p90_percent}}}),
                truth_view(runs, "Median error against 0.67 of the claimed sigma", "% of the true distance",
                           {{{"median error", &DistanceBin::error_p50_percent},
                             {"0.67 sigma claimed", &DistanceBin::claimed_percent, kMedianOfNormal}}})});
    content += births(runs);
  }
  return section(
      "Landmarks",
      "Points alive at the end, at the distance from the keyframe that made them; only those whose "
      "claimed sigma was then under 30 %.",
      content);
}

std::string vmp_section(const Runs& runs) {
  const std::vector<double> bins = life_edges(runs);
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
