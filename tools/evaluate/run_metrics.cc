// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluate/run_metrics.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tools/common/errors.h"
#include "tools/evaluate/statistics.h"

namespace farpoint::tools {
namespace {

// Depths of points less certain than this are left out.
constexpr double kMaxRelativeDepthSigma = 0.30;

const char* scale_state_name(const Run& run) {
  if (!run.log) return "not told by a text file";
  switch (run.log->scale_state) {
    case status_t::SCALE_UNKNOWN:
      return "unknown";
    case status_t::SCALE_ASSUMED:
      return "assumed";
    case status_t::SCALE_METRIC:
      return "metric";
    default:
      return "?";
  }
}

// A text file does not say whether its scale is known: aligning with a scale says that it is not.
bool scale_is_metric(const Run& run, const EvaluationOptions& options) {
  if (run.log) return run.log->scale_state == status_t::SCALE_METRIC;
  return options.alignment && *options.alignment != Alignment::kSim3;
}

bool compare_at_camera0(const Run& run, const Truth& truth, const EvaluationOptions& options) {
  if (options.truth_point == TruthPoint::kBody) return false;
  if (options.truth_point == TruthPoint::kAuto) {
    return truth.names_body && truth.body.has_orientation && !scale_is_metric(run, options);
  }
  if (!truth.names_body) {
    throw InputError(
        "--truth-point camera0: needs a truth log whose CALIBRATION says where camera 0 stands on the body");
  }
  if (!truth.body.has_orientation) {
    throw InputError("--truth-point camera0: the truth has positions only, expected one with orientation");
  }
  return true;
}

std::int64_t count_frames(const Run& run, const Truth& truth, const EvaluationOptions& options) {
  if (options.frames) return *options.frames;
  if (!truth.frame_utimes.empty()) return static_cast<std::int64_t>(truth.frame_utimes.size());
  if (run.log && run.log->frames > 0) return run.log->frames;
  return static_cast<std::int64_t>(run.final_trajectory.poses.size());
}

TrajectoryMetrics measure(const Trajectory& truth, const Trajectory& estimate, Alignment alignment,
                          bool planar, std::int64_t frames) {
  TrajectoryMetrics metrics;
  const std::vector<PosePair> pairs = pair_nearest(truth, estimate);
  metrics.poses = estimate.poses.size();
  metrics.paired = pairs.size();
  if (frames > 0) metrics.share = static_cast<double>(pairs.size()) / static_cast<double>(frames);
  metrics.absolute = absolute_error(pairs, alignment, planar);
  if (truth.has_orientation && estimate.has_orientation) {
    const double scale = metrics.absolute ? metrics.absolute->scale : 1.0;
    metrics.segments = segment_error(pairs, scale);
    metrics.one_second = one_second_error(truth, estimate, scale);
  }
  return metrics;
}

Spread spread_of(const std::vector<double>& values) {
  return {values.size(), percentile(values, 10.0), percentile(values, 50.0), percentile(values, 90.0)};
}

double percent_over(const std::vector<double>& values, double limit) {
  const auto over = std::count_if(values.begin(), values.end(), [limit](double v) { return v > limit; });
  return 100.0 * static_cast<double>(over) / static_cast<double>(values.size());  // 0/0: NaN
}

DepthMetrics depth_metrics(const map_summary_t& map, double scale) {
  std::vector<double> depths_m;
  for (std::size_t i = 0; i < map.creation_depth.size(); ++i) {
    if (map.creation_relative_sigma[i] < kMaxRelativeDepthSigma)
      depths_m.push_back(scale * map.creation_depth[i]);
  }
  DepthMetrics metrics;
  metrics.triangulation_m = spread_of(depths_m);
  metrics.over_50_m_percent = percent_over(depths_m, 50.0);
  metrics.over_100_m_percent = percent_over(depths_m, 100.0);
  metrics.observation_m = {static_cast<std::size_t>(std::max<std::int64_t>(map.observations, 0)),
                           scale * map.observation_distance_p10, scale * map.observation_distance_median,
                           scale * map.observation_distance_p90};
  return metrics;
}

// By the alignment; without truth by the run itself, where its scale is not unknown.
std::optional<double> metres_a_unit(const RunMetrics& metrics, std::int8_t scale_state) {
  if (metrics.final_metrics.absolute) return metrics.final_metrics.absolute->scale;
  if (metrics.compared || scale_state == status_t::SCALE_UNKNOWN) return std::nullopt;
  return 1.0;
}

void add_summary(const summary_t& summary, std::int8_t scale_state, RunMetrics* metrics) {
  if (summary.frames > 0) {
    metrics->tracked_percent =
        100.0 * static_cast<double>(summary.frames_valid) / static_cast<double>(summary.frames);
  }
  metrics->times_lost = summary.times_lost;
  metrics->maps = summary.maps_made;
  if (summary.landmarks_made > 0) {
    metrics->vmp_percent =
        100.0 * static_cast<double>(summary.vmp_promoted) / static_cast<double>(summary.landmarks_made);
  }
  if (summary.maps.empty()) return;
  metrics->map_points = summary.maps[0].landmarks;
  if (const std::optional<double> scale = metres_a_unit(*metrics, scale_state))
    metrics->depth = depth_metrics(summary.maps[0], *scale);
}

void add_landmarks(const RunLog& log, const Trajectory& truth_at_point, SimulatedWorld* world,
                   RunMetrics* metrics) {
  const std::optional<AbsoluteError>& absolute = metrics->final_metrics.absolute;
  if (!log.landmarks || !absolute || log.final_trajectory.poses.empty()) return;
  JudgedLandmarks judged =
      world->judge(*log.landmarks, log.final_trajectory.poses.front().map_id,
                   pair_nearest(truth_at_point, log.final_trajectory), absolute->map_to_world);
  metrics->judged = std::move(judged.landmarks);
  metrics->landmarks = measure_landmarks(metrics->judged);
  metrics->landmarks->refused = judged.refused;
}

// Time range of a segment: by the recording's frames where they are known, else by the estimate's own poses.
std::pair<double, double> segment_times(const FrameRange& range, const Truth& truth,
                                        const Trajectory& estimate) {
  const bool by_recording = !truth.frame_utimes.empty();
  const std::size_t frames = by_recording ? truth.frame_utimes.size() : estimate.poses.size();
  if (range.from >= range.to || range.to > frames) {
    throw InputError("--segments " + std::to_string(range.from) + ":" + std::to_string(range.to) +
                     ": expected FROM < TO <= " + std::to_string(frames) + ", the number of frames");
  }
  const auto time_of = [&](std::size_t frame) {
    return by_recording ? seconds_of(truth.frame_utimes[frame]) : estimate.poses[frame].time_s;
  };
  return {time_of(range.from), time_of(range.to - 1)};
}

std::vector<SegmentScale> segment_scales(const Trajectory& truth_at_point, const Truth& truth,
                                         const Trajectory& estimate, const EvaluationOptions& options) {
  std::vector<SegmentScale> result;
  const std::vector<PosePair> pairs = pair_nearest(truth_at_point, estimate);
  for (const FrameRange& range : options.segments) {
    if (estimate.poses.empty()) break;
    const auto [begin_s, end_s] = segment_times(range, truth, estimate);
    std::vector<PosePair> inside;
    for (const PosePair& pair : pairs) {
      if (pair.time_s >= begin_s && pair.time_s <= end_s) inside.push_back(pair);
    }
    SegmentScale segment{range, inside.size(), std::nullopt, std::nullopt};
    if (const auto map_to_world = align(inside, Alignment::kSim3, options.planar))
      segment.scale = map_to_world->scale;
    if (segment.scale && !result.empty() && result.front().scale) {
      segment.ratio_to_first = *segment.scale / *result.front().scale;
    }
    result.push_back(segment);
  }
  return result;
}

// ---- JSON ----

template <typename T>
Json or_null(const std::optional<T>& value) {
  return value ? Json(*value) : Json();
}

Json count(std::size_t n) {
  return static_cast<std::int64_t>(n);
}

Json to_json(const TrajectoryMetrics& metrics, bool compared) {
  Json json = Json::object();
  const std::optional<AbsoluteError>& a = metrics.absolute;
  json.set("n", compared ? count(metrics.paired) : Json());
  json.set("share", compared ? Json(metrics.share) : Json());
  json.set("path_m", a ? Json(a->path_m) : Json());
  json.set("scale", a ? Json(a->scale) : Json());
  json.set("ate_rmse_m", a ? Json(a->rmse_m) : Json());
  json.set("ate_median_m", a ? Json(a->median_m) : Json());
  json.set("ate_max_m", a ? Json(a->max_m) : Json());
  json.set("ate_percent", a ? Json(a->percent) : Json());
  json.set("poses", count(metrics.poses));
  const std::optional<SegmentError>& s = metrics.segments;
  json.set("rpe_translation_percent", s ? Json(s->translation_percent) : Json());
  json.set("rpe_rotation_deg_per_m", s ? Json(s->rotation_deg_per_m) : Json());
  const std::optional<OneSecondError>& o = metrics.one_second;
  json.set("rpe_1s_translation_m", o ? Json(o->translation_rmse_m) : Json());
  json.set("rpe_1s_rotation_deg", o ? Json(o->rotation_rmse_deg) : Json());
  json.set("max_1s_translation_m", o ? Json(o->translation_max_m) : Json());
  json.set("max_1s_rotation_deg", o ? Json(o->rotation_max_deg) : Json());
  return json;
}

Json to_json(const Spread& spread) {
  Json json = Json::object();
  json.set("count", count(spread.count));
  json.set("p10", spread.p10);
  json.set("p50", spread.p50);
  json.set("p90", spread.p90);
  return json;
}

Json times_to_json(const std::vector<double>& times_ms) {
  if (times_ms.empty()) return {};
  Json json = Json::object();
  json.set("mean", mean(times_ms));
  json.set("p50", percentile(times_ms, 50.0));
  json.set("p99", percentile(times_ms, 99.0));
  json.set("max", *std::max_element(times_ms.begin(), times_ms.end()));
  return json;
}

Json segments_to_json(const std::vector<SegmentScale>& segments) {
  Json::Array items;
  for (const SegmentScale& segment : segments) {
    Json json = Json::object();
    json.set("from", count(segment.range.from));
    json.set("to", count(segment.range.to));
    json.set("n", count(segment.paired));
    json.set("scale", or_null(segment.scale));
    json.set("ratio_to_first", or_null(segment.ratio_to_first));
    items.push_back(json);
  }
  return items;
}

}  // namespace

Truth read_truth(const std::filesystem::path& file, bool with_world) {
  Truth truth = read_reference(file, with_world);
  if (!truth.is_known())
    throw InputError(file.string() + ": no GROUND_TRUTH messages, expected a recording with truth");
  return truth;
}

Truth read_reference(const std::filesystem::path& file, bool with_world) {
  Truth truth;
  if (!is_lcm_log(file)) {
    truth.body = read_tum(file);
    return truth;
  }
  RecordingLog log = read_recording_log(file);
  truth.T_body_camera0 = log.T_body_camera0();
  truth.names_body = log.calibration && !log.calibration->body_name.empty();
  truth.body = std::move(log.truth);
  truth.frame_utimes = std::move(log.frame_utimes);
  if (with_world && log.simulation) truth.world = std::make_shared<SimulatedWorld>(*log.simulation);
  return truth;
}

Run read_run(const std::filesystem::path& file) {
  Run run;
  run.name = file.stem().string();
  if (is_lcm_log(file)) {
    run.log = read_run_log(file);
    run.final_trajectory = run.log->final_trajectory;
  } else {
    run.final_trajectory = read_tum(file);
  }
  return run;
}

RunMetrics evaluate_run(const Run& run, const Truth& truth, const EvaluationOptions& options) {
  RunMetrics metrics;
  metrics.name = run.name;
  metrics.compared = truth.is_known();
  metrics.alignment =
      options.alignment.value_or(scale_is_metric(run, options) ? Alignment::kSe3 : Alignment::kSim3);
  metrics.planar = options.planar;
  metrics.scale_state = scale_state_name(run);
  metrics.images = count_frames(run, truth, options);
  metrics.own = measure_own(run.log ? &*run.log : nullptr, run.final_trajectory, metrics.images);

  const bool at_camera0 = compare_at_camera0(run, truth, options);
  metrics.truth_point = at_camera0 ? "camera0" : "body";
  Trajectory truth_at_point = truth.body;
  // The estimate keeps the body's axes there, so only the position moves.
  const slam::SE3 lever_arm{Eigen::Quaterniond::Identity(), truth.T_body_camera0.t};
  if (at_camera0) move_reference_point(lever_arm, &truth_at_point);

  const auto measured = [&](const Trajectory& estimate) {
    return measure(truth_at_point, estimate, metrics.alignment, options.planar, metrics.images);
  };
  metrics.final_metrics = measured(run.final_trajectory);
  metrics.segments = segment_scales(truth_at_point, truth, run.final_trajectory, options);
  if (!run.log) return metrics;
  metrics.live_metrics = measured(run.log->live_trajectory);
  metrics.resets = run.log->resets;
  metrics.tracking_ms = tracking_times_ms(run.log->timed_frames);
  metrics.frame_ms = run.log->frame_ms;
  if (!metrics.tracking_ms.empty() || !metrics.frame_ms.empty())
    metrics.deadline_misses = run.log->deadline_misses;
  if (run.log->peak_resident_bytes > 0)
    metrics.peak_resident_mb = 1e-6 * static_cast<double>(run.log->peak_resident_bytes);
  metrics.latency = measure_latency(run.log->timed_frames);
  metrics.steadiness = measure_steadiness(run.log->timed_frames);
  if (run.log->summary) add_summary(*run.log->summary, run.log->scale_state, &metrics);
  if (truth.world) add_landmarks(*run.log, truth_at_point, truth.world.get(), &metrics);
  return metrics;
}

Json to_json(const RunMetrics& metrics) {
  Json json = Json::object();
  json.set("name", metrics.name);
  json.set("align", metrics.compared ? Json(to_string(metrics.alignment)) : Json());
  json.set("planar", metrics.planar);
  json.set("truth_point", metrics.compared ? Json(metrics.truth_point) : Json());
  json.set("scale_state", metrics.scale_state);
  json.set("images", metrics.images);
  json.set("tracked_percent", or_null(metrics.tracked_percent));
  json.set("resets", or_null(metrics.resets));
  json.set("times_lost", or_null(metrics.times_lost));
  json.set("maps", or_null(metrics.maps));
  json.set("tracking_ms", times_to_json(metrics.tracking_ms));
  json.set("frame_ms", times_to_json(metrics.frame_ms));
  json.set("deadline_misses", or_null(metrics.deadline_misses));
  json.set("peak_resident_mb", or_null(metrics.peak_resident_mb));
  json.set("latency", metrics.latency ? to_json(*metrics.latency) : Json());
  json.set("steadiness", metrics.steadiness ? to_json(*metrics.steadiness) : Json());
  json.set("triangulation_depth_m", metrics.depth ? to_json(metrics.depth->triangulation_m) : Json());
  json.set("depth_over_50_m_percent", metrics.depth ? Json(metrics.depth->over_50_m_percent) : Json());
  json.set("depth_over_100_m_percent", metrics.depth ? Json(metrics.depth->over_100_m_percent) : Json());
  json.set("observation_distance_m", metrics.depth ? to_json(metrics.depth->observation_m) : Json());
  json.set("map_points", or_null(metrics.map_points));
  json.set("vmp_percent", or_null(metrics.vmp_percent));
  json.set("landmarks", metrics.landmarks ? to_json(*metrics.landmarks) : Json());
  json.set("final", to_json(metrics.final_metrics, metrics.compared));
  json.set("live", metrics.live_metrics ? to_json(*metrics.live_metrics, metrics.compared) : Json());
  json.set("segments", segments_to_json(metrics.segments));
  json.set("compared_with_truth", metrics.compared);
  json.set("own", to_json(metrics.own));
  return json;
}

}  // namespace farpoint::tools
