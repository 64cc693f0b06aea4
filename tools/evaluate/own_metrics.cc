// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluate/own_metrics.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

#include "slam/frame_result.h"

namespace farpoint::tools {
namespace {

// VMPs are counted a moment before the landmarks: their difference may not be negative.
MapCounts map_counts(std::int64_t keyframes, std::int64_t landmarks, std::int64_t vmps) {
  return {keyframes, std::max<std::int64_t>(landmarks - vmps, 0), vmps};
}

const char* unit_of(const RunLog* log) {
  if (log == nullptr) return "units";
  return log->scale_state == status_t::SCALE_UNKNOWN ? "map units" : "m";
}

void measure_validity(const std::vector<PublishedState>& published, OwnMetrics* metrics) {
  std::optional<double> last_valid_s;
  for (const PublishedState& frame : published) {
    const auto state = static_cast<std::size_t>(std::max<int>(frame.state, 0));
    metrics->state_percent.at(std::min(state, metrics->state_percent.size() - 1)) +=
        100.0 / static_cast<double>(published.size());
    if (last_valid_s)
      metrics->longest_blind_s =
          std::max(metrics->longest_blind_s.value_or(0.0), frame.time_s - *last_valid_s);
    if (!frame.valid) continue;
    if (!metrics->first_valid_s) metrics->first_valid_s = frame.time_s - published.front().time_s;
    last_valid_s = frame.time_s;
  }
}

Json to_json(const PathMetrics& path) {
  Json json = Json::object();
  json.set("poses", static_cast<std::int64_t>(path.poses));
  json.set("share", path.share);
  json.set("path", path.length);
  return json;
}

template <typename T>
Json or_null(const std::optional<T>& value) {
  return value ? Json(*value) : Json();
}

std::string state_key(std::size_t state) {
  return slam::to_string(static_cast<slam::State>(state));
}

std::string text_of(const std::optional<double>& value) {
  return value ? fmt::format("{:.2f}", *value) : "-";
}

std::string text_of(const std::optional<std::int64_t>& value) {
  return value ? std::to_string(*value) : "-";
}

std::string path_text(const PathMetrics& path, const char* unit) {
  return fmt::format("poses={} posed_share={:.4f} path={:.2f} {}\n", path.poses, path.share, path.length,
                     unit);
}

std::string states_text(const OwnMetrics& metrics) {
  std::string text;
  for (std::size_t i = 0; i < metrics.state_percent.size(); ++i) {
    if (metrics.state_percent[i] > 0.0)
      text += fmt::format(" {}={:.1f}", state_key(i), metrics.state_percent[i]);
  }
  return text;
}

}  // namespace

MapCounts map_counts(const summary_t& summary) {
  return map_counts(summary.keyframes, summary.landmarks, summary.vmps);
}

MapCounts map_counts(const status_t& status) {
  return map_counts(status.keyframes, status.landmarks, status.vmps);
}

PathMetrics measure_path(const Trajectory& trajectory, std::int64_t frames) {
  PathMetrics path;
  path.poses = trajectory.poses.size();
  if (frames > 0) path.share = static_cast<double>(path.poses) / static_cast<double>(frames);
  for (std::size_t i = 1; i < trajectory.poses.size(); ++i) {
    const TimedPose &a = trajectory.poses[i - 1], &b = trajectory.poses[i];
    if (a.map_id == b.map_id) path.length += (b.pose.t - a.pose.t).norm();
  }
  return path;
}

OwnMetrics measure_own(const RunLog* log, const Trajectory& final_trajectory, std::int64_t frames) {
  OwnMetrics metrics;
  metrics.length_unit = unit_of(log);
  metrics.final_path = measure_path(final_trajectory, frames);
  if (!final_trajectory.poses.empty())
    metrics.duration_s = final_trajectory.poses.back().time_s - final_trajectory.poses.front().time_s;
  if (log == nullptr) return metrics;
  metrics.live_path = measure_path(log->live_trajectory, frames);
  if (!log->published.empty())
    metrics.duration_s = log->published.back().time_s - log->published.front().time_s;
  measure_validity(log->published, &metrics);
  if (log->last_status) {
    metrics.frames_dropped = log->last_status->frames_dropped;
    metrics.keyframes_dropped = log->last_status->keyframes_dropped;
    metrics.map = map_counts(*log->last_status);
  }
  if (log->summary) metrics.map = map_counts(*log->summary);
  return metrics;
}

Json to_json(const OwnMetrics& metrics) {
  Json json = Json::object();
  json.set("length_unit", metrics.length_unit);
  json.set("duration_s", metrics.duration_s);
  json.set("final", to_json(metrics.final_path));
  json.set("live", metrics.live_path ? to_json(*metrics.live_path) : Json());
  json.set("first_valid_s", or_null(metrics.first_valid_s));
  json.set("longest_blind_s", or_null(metrics.longest_blind_s));
  Json states = Json::object();
  for (std::size_t i = 0; i < metrics.state_percent.size(); ++i)
    states.set(state_key(i), metrics.live_path ? Json(metrics.state_percent[i]) : Json());
  json.set("states_percent", std::move(states));
  json.set("frames_dropped", or_null(metrics.frames_dropped));
  json.set("keyframes_dropped", or_null(metrics.keyframes_dropped));
  json.set("keyframes", metrics.map ? Json(metrics.map->keyframes) : Json());
  json.set("points", metrics.map ? Json(metrics.map->points) : Json());
  json.set("vmps", metrics.map ? Json(metrics.map->vmps) : Json());
  return json;
}

std::string own_text(const std::string& run, const OwnMetrics& metrics) {
  std::string text = run + " final path: " + path_text(metrics.final_path, metrics.length_unit);
  if (!metrics.live_path) return text;
  text += run + " live path:  " + path_text(*metrics.live_path, metrics.length_unit);
  text += fmt::format(
      "{} validity: duration_s={:.1f} first_valid_s={} longest_blind_s={} frames_dropped={} "
      "keyframes_dropped={}\n",
      run, metrics.duration_s, text_of(metrics.first_valid_s), text_of(metrics.longest_blind_s),
      text_of(metrics.frames_dropped), text_of(metrics.keyframes_dropped));
  text += run + " states, % of the frames:" + states_text(metrics) + "\n";
  if (metrics.map)
    text += fmt::format("{} all maps: keyframes={} points={} vmps={}\n", run, metrics.map->keyframes,
                        metrics.map->points, metrics.map->vmps);
  return text;
}

}  // namespace farpoint::tools
