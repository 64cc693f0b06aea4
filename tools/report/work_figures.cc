// SPDX-License-Identifier: Apache-2.0
#include "tools/report/work_figures.h"

#include <algorithm>
#include <cmath>

#include "tools/evaluate/run_times.h"
#include "tools/evaluate/statistics.h"

namespace farpoint::tools::report {
namespace {

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

Json memory_figures(const RunRecord& run) {
  Json json = Json::object();
  const RunLog* log = run.run.log ? &*run.run.log : nullptr;
  const std::int64_t peak_bytes = log == nullptr ? 0 : log->peak_resident_bytes;
  json.set("peak_mb", peak_bytes > 0 ? Json(1e-6 * static_cast<double>(peak_bytes)) : Json());
  json.set("pool_mb", run.statuses.empty()
                          ? Json()
                          : Json(1e-6 * static_cast<double>(run.statuses.back().memory_pool_bytes)));
  const std::optional<SteadinessMetrics> steadiness =
      log == nullptr ? std::nullopt : measure_steadiness(log->timed_frames);
  json.set("steadiness", steadiness ? to_json(*steadiness) : Json());
  return json;
}

Json frame_figures(const RunRecord& run) {
  Json json = Json::object();
  const summary_t* summary = run.summary();
  json.set("tracked", summary == nullptr ? Json() : Json(summary->frames));
  json.set("valid", summary == nullptr ? Json() : Json(summary->frames_valid));
  const bool told = !run.statuses.empty();
  json.set("dropped", told ? Json(run.statuses.back().frames_dropped) : Json());
  json.set("deadlines_missed", told ? Json(run.statuses.back().deadlines_missed) : Json());
  return json;
}

}  // namespace

std::vector<WorkFigure> work_figures() {
  const auto stage = [](int index) { return [index](const RunRecord& run) { return stage_ms(run, index); }; };
  const auto frame = [](auto member) {
    return [member](const RunRecord& run) {
      return median_of_frames(run,
                              [member](const PublishedFrame& f) { return static_cast<double>(f.*member); });
    };
  };
  return {{"features", "features a frame", frame(&PublishedFrame::features)},
          {"matches", "matches a frame", frame(&PublishedFrame::matches)},
          {"inliers", "inliers a frame", frame(&PublishedFrame::inliers)},
          {"inliers_percent", "inliers of the matches, %",
           [](const RunRecord& run) {
             return median_of_frames(
                 run, [](const PublishedFrame& f) { return 100.0 * f.inliers / std::max(f.matches, 1); });
           }},
          {"keyframes_a_point", "keyframes that see a point",
           [](const RunRecord& run) {
             return median_of_landmarks(
                 run, [](const landmark_t& l) { return static_cast<double>(l.nsightings); });
           }},
          {"seconds_a_point", "time from a point's first to its last keyframe, s",
           [](const RunRecord& run) {
             return median_of_landmarks(run, [](const landmark_t& l) {
               return seconds_between(l.sighting_utime.front(), l.sighting_utime.back());
             });
           }},
          {"keyframes_percent", "keyframes, % of the frames", keyframes_percent},
          {"tracking_ms", "tracking, CPU ms", stage(timing_t::STAGE_TRACKING)},
          {"extraction_ms", "extraction, CPU ms", stage(timing_t::STAGE_EXTRACTION)},
          {"matching_ms", "matching, CPU ms", stage(timing_t::STAGE_MATCHING)},
          {"alignment_ms", "alignment, CPU ms", stage(timing_t::STAGE_ALIGNMENT)},
          {"pose_ms", "pose, CPU ms", stage(timing_t::STAGE_POSE)},
          {"mapping_ms", "mapping, CPU ms a keyframe", stage(timing_t::STAGE_MAPPING)},
          {"triangulation_ms", "triangulation, CPU ms a keyframe", stage(timing_t::STAGE_TRIANGULATION)},
          {"local_ba_ms", "local BA, CPU ms a keyframe", stage(timing_t::STAGE_LOCAL_BA)}};
}

Json run_figures(const RunRecord& run) {
  Json work = Json::object();
  for (const WorkFigure& figure : work_figures()) work.set(figure.key, figure.value(run));
  Json json = Json::object();
  json.set("name", run.name);
  json.set("work", std::move(work));
  json.set("frames", frame_figures(run));
  json.set("memory", memory_figures(run));
  return json;
}

}  // namespace farpoint::tools::report
