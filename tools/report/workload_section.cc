// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <functional>

#include "tools/evaluate/statistics.h"
#include "tools/report/html.h"
#include "tools/report/sections.h"
#include "tools/report/svg.h"

namespace farpoint::tools::report {
namespace {

// Recordings whose figures lie within this factor of each other are work of the same kind.
constexpr double kAlikeFactor = 1.5;

template <typename Figure>
double median_of_frames(const RunRecord& run, Figure&& figure) {
  std::vector<double> values;
  for (const PublishedFrame& frame : run.frames) {
    if (frame.valid) values.push_back(figure(frame));
  }
  return percentile(values, 50.0);
}

template <typename Figure>
double median_of_landmarks(const RunRecord& run, Figure&& figure) {
  std::vector<double> values;
  if (run.landmarks() != nullptr) {
    for (const landmark_t& l : run.landmarks()->landmarks) {
      if (l.nsightings > 0) values.push_back(figure(l));
    }
  }
  return percentile(values, 50.0);
}

double stage_ms(const RunRecord& run, int stage) {
  std::vector<double> values;
  for (const timing_t& t : run.timings) {
    if (t.cpu_ms[stage] >= 0.0) values.push_back(t.cpu_ms[stage]);
  }
  return percentile(values, 50.0);
}

double keyframes_percent(const RunRecord& run) {
  const summary_t* s = run.summary();
  if (s == nullptr || s->frames == 0) return NAN;
  return 100.0 * static_cast<double>(s->keyframes_made) / static_cast<double>(s->frames);
}

struct Figure {
  std::string name;
  std::function<double(const RunRecord&)> value;
};

std::vector<Figure> figures() {
  const auto stage = [](int index) { return [index](const RunRecord& run) { return stage_ms(run, index); }; };
  const auto frame = [](auto member) {
    return [member](const RunRecord& run) {
      return median_of_frames(run,
                              [member](const PublishedFrame& f) { return static_cast<double>(f.*member); });
    };
  };
  return {{"features a frame", frame(&PublishedFrame::features)},
          {"matches a frame", frame(&PublishedFrame::matches)},
          {"inliers a frame", frame(&PublishedFrame::inliers)},
          {"inliers of the matches, %",
           [](const RunRecord& run) {
             return median_of_frames(
                 run, [](const PublishedFrame& f) { return 100.0 * f.inliers / std::max(f.matches, 1); });
           }},
          {"keyframes that see a point",
           [](const RunRecord& run) {
             return median_of_landmarks(
                 run, [](const landmark_t& l) { return static_cast<double>(l.nsightings); });
           }},
          {"time from a point's first to its last keyframe, s",
           [](const RunRecord& run) {
             return median_of_landmarks(run, [](const landmark_t& l) {
               return seconds_between(l.sighting_utime.front(), l.sighting_utime.back());
             });
           }},
          {"keyframes, % of the frames", keyframes_percent},
          {"tracking, CPU ms", stage(timing_t::STAGE_TRACKING)},
          {"extraction, CPU ms", stage(timing_t::STAGE_EXTRACTION)},
          {"matching, CPU ms", stage(timing_t::STAGE_MATCHING)},
          {"alignment, CPU ms", stage(timing_t::STAGE_ALIGNMENT)},
          {"pose, CPU ms", stage(timing_t::STAGE_POSE)},
          {"mapping, CPU ms a keyframe", stage(timing_t::STAGE_MAPPING)},
          {"triangulation, CPU ms a keyframe", stage(timing_t::STAGE_TRIANGULATION)},
          {"local BA, CPU ms a keyframe", stage(timing_t::STAGE_LOCAL_BA)}};
}

std::string ratio_text(double ratio) {
  if (!std::isfinite(ratio)) return "-";
  const bool alike = ratio < kAlikeFactor && ratio > 1.0 / kAlikeFactor;
  return number(ratio, 2) + (alike ? "" : " !");
}

}  // namespace

std::string workload_section(const Runs& runs) {
  std::vector<std::vector<std::string>> rows = {{"median over the run"}};
  for (const RunRecord& run : runs) rows[0].push_back(run.name);
  for (std::size_t i = 1; i < runs.size(); ++i) rows[0].push_back(runs[i].name + " / " + runs[0].name);
  for (const Figure& figure : figures()) {
    std::vector<std::string> row = {figure.name};
    std::vector<double> values;
    for (const RunRecord& run : runs) values.push_back(figure.value(run));
    // Threaded runs do not time the parts of tracking and mapping.
    if (std::none_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); })) continue;
    for (const double value : values) row.push_back(number(value, value < 10.0 ? 2 : 1));
    for (std::size_t i = 1; i < values.size(); ++i) row.push_back(ratio_text(values[i] / values[0]));
    rows.push_back(row);
  }
  return section("Work",
                 "What the images gave the estimator to do. Ratios beyond a factor of 1.5 are marked (!): a "
                 "simulated world's figures tell how far it stands in for a recorded drive.",
                 table(rows));
}

}  // namespace farpoint::tools::report
