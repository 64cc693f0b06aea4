#include "daemon/session.h"

#include <spdlog/spdlog.h>

#include <cmath>
#include <limits>

#include "daemon/build_info.h"

namespace farpoint::daemon {
namespace {

constexpr std::int64_t kAtOnce = std::numeric_limits<std::int64_t>::min();

// True where a message of this rate is due. The next one is due a period after this frame, so that a gap in
// the recording is not followed by a burst.
bool due(std::int64_t utime, double rate_hz, std::int64_t* next_utime) {
  if (rate_hz <= 0.0 || utime < *next_utime) return false;
  // Frames do not come at multiples of the period: half a millisecond early is on time.
  constexpr std::int64_t kTolerance_us = 500;
  *next_utime = utime + std::llround(1e6 / rate_hz) - kTolerance_us;
  return true;
}

std::size_t sum_bytes(const std::vector<std::pair<std::string, std::size_t>>& table) {
  std::size_t sum = 0;
  for (const auto& [name, bytes] : table) sum += bytes;
  return sum;
}

void print_memory_table(const std::vector<std::pair<std::string, std::size_t>>& table, std::size_t sum) {
  constexpr double kMegabyte = 1e6;
  for (const auto& [name, bytes] : table)
    spdlog::info("memory {:<32} {:>9.3f} MB", name, double(bytes) / kMegabyte);
  spdlog::info("memory {:<32} {:>9.3f} MB", "in all", double(sum) / kMegabyte);
}

void print_calibration(const slam::CalibrationInfo& c) {
  spdlog::info(
      "calibration found: focal length {:+.2f} +- {:.2f} %, centre {:+.2f} +- {:.2f}, {:+.2f} +- {:.2f} px, "
      "k1 {:+.5f} +- {:.5f}, against the given one",
      100.0 * std::expm1(c.focal_scale), 100.0 * c.focal_scale_sigma, c.cx_px, c.cx_sigma_px, c.cy_px,
      c.cy_sigma_px, c.k1, c.k1_sigma);
}

}  // namespace

Session::Session(const Config& config, const slam::Rig& rig, std::string calibration_hash,
                 std::vector<PoseSink*> sinks, Publisher* publisher)
    : config_(config),
      calibration_hash_(std::move(calibration_hash)),
      config_hash_(fmt::format("{:016x}", config_hash(config))),
      build_(build_text()),
      estimator_(config.estimator, rig),
      sinks_(std::move(sinks)),
      publisher_(publisher),
      next_status_utime_(kAtOnce),
      next_map_utime_(kAtOnce) {
  const auto table = estimator_.memory_table();
  pool_bytes_ = sum_bytes(table);
  print_memory_table(table, pool_bytes_);
}

const FrameOutput& Session::process(const slam::FrameInput& input, const InputCounts& in,
                                    const OutputCounts& out, StageClock* clock) {
  {
    const StageScope scope(clock, timing_t::STAGE_FRAME);
    estimator_.listen(clock);
    frame_ = make_frame_output(estimator_.process(input), config_.scale.assumed);
    estimator_.listen(nullptr);
  }
  if (!frame_.result.followed()) clock->forget(timing_t::STAGE_TRACKING);
  ++end_.frames;
  end_.utime = input.utime;
  end_.last = frame_.result;
  if (frame_.valid) {
    ++end_.frames_valid;
    end_.live_utimes.push_back(frame_.result.utime);
  }
  {
    const StageScope scope(clock, timing_t::STAGE_OUTPUT);
    for (PoseSink* sink : sinks_) sink->on_frame(frame_);
    publisher_->on_frame(frame_);
    publish_status(frame_, in, out);
    publish_map(frame_);
  }
  note_state(frame_.result);
  if (publisher_->has_sinks()) {
    publisher_->publish(ipc::kTimingChannel, input.utime, clock->message(input.utime, input.sequence));
  }
  return frame_;
}

const RunEnd& Session::finish(const InputCounts& in) {
  estimator_.finish();
  if (config_.estimator.calibration.refine) print_calibration(estimator_.calibration());
  end_.counts = estimator_.counts();
  end_.trajectories = estimator_.trajectories();
  end_.landmarks = estimator_.landmarks();
  end_.unit_scale = unit_scale(end_.last.scale);
  end_.observation_distances.assign(end_.trajectories.size(), {});
  estimator_.visit_observation_distances([&](std::int32_t map_id, double distance) {
    for (std::size_t i = 0; i < end_.trajectories.size(); ++i) {
      if (end_.trajectories[i].map_id == map_id) end_.observation_distances[i].push_back(distance);
    }
  });
  publisher_->publish_result(ipc::kTrajectoryChannel, end_.utime, make_trajectory(end_));
  summary_t summary = make_summary(end_, config_);
  summary.times_backwards = in.times_backwards;
  summary.images_undecodable = in.undecodable;
  summary.images_wrong_size = in.wrong_size;
  summary.messages_undecodable = in.messages_undecodable;
  summary.log_damages = in.log_damages;
  summary.configuration_hash = config_hash_;
  summary.calibration_hash = calibration_hash_;
  summary.build = build_;
  publisher_->publish_result(ipc::kSummaryChannel, end_.utime, summary);
  return end_;
}

void Session::note_state(const slam::FrameResult& result) {
  if (result.state == last_state_) return;
  spdlog::debug("frame {} at {:.6f} s: {} -> {} (map {}, {} of {} features matched, {} agree)",
                result.sequence, 1e-6 * double(result.utime), slam::to_string(last_state_),
                slam::to_string(result.state), result.map_id, result.matches, result.features,
                result.inliers);
  last_state_ = result.state;
}

void Session::publish_status(const FrameOutput& frame, const InputCounts& in, const OutputCounts& out) {
  const bool changed = frame.result.state != last_state_;
  const bool on_time = due(frame.result.utime, config_.lcm.status_rate_hz, &next_status_utime_);
  if (!changed && !on_time) return;
  publisher_->publish(ipc::kStatusChannel, frame.result.utime, make_status(frame, in, out));
}

void Session::publish_map(const FrameOutput& frame) {
  if (!publisher_->has_sinks() || !due(frame.result.utime, config_.lcm.map_rate_hz, &next_map_utime_)) return;
  const MapContent content{estimator_.landmarks(), estimator_.keyframe_poses()};
  publisher_->publish(ipc::kMapChannel, frame.result.utime,
                      make_map(frame, content, config_.lcm.map_points, unit_scale(frame.result.scale)));
}

status_t Session::make_status(const FrameOutput& frame, const InputCounts& in,
                              const OutputCounts& out) const {
  const slam::FrameResult& r = frame.result;
  const slam::EstimatorCounts& counts = estimator_.counts();
  status_t s{};
  s.utime = r.utime;
  s.state = static_cast<std::int8_t>(r.state);
  s.scale_state = static_cast<std::int8_t>(r.scale);
  s.assumed_scale = config_.scale.assumed;
  s.quality = static_cast<std::int8_t>(frame.valid ? r.quality : -1);
  s.map_id = r.map_id;
  s.reset_counter = static_cast<std::int32_t>(r.reset_counter);
  s.frames_received = in.images;
  s.frames_tracked = end_.frames;
  s.frames_valid = end_.frames_valid;
  s.images_wrong_size = in.wrong_size;
  s.images_undecodable = in.undecodable;
  s.images_unknown_camera = in.unknown_camera;
  s.times_backwards = in.times_backwards;
  s.messages_undecodable = in.messages_undecodable;
  s.log_damages = in.log_damages;
  s.can_send_errors = out.can_send_errors;
  s.lcm_send_errors = static_cast<std::int64_t>(publisher_->network_errors());
  s.log_write_errors = static_cast<std::int64_t>(publisher_->log_errors());
  s.maps = static_cast<std::int32_t>(counts.maps);
  s.keyframes = static_cast<std::int32_t>(counts.keyframes);
  s.landmarks = static_cast<std::int32_t>(counts.landmarks);
  s.vmps = static_cast<std::int32_t>(counts.vmps);
  s.times_lost = static_cast<std::int64_t>(counts.lost);
  s.memory_pool_bytes = static_cast<std::int64_t>(pool_bytes_);
  s.build = build_;
  s.configuration_hash = config_hash_;
  s.calibration_hash = calibration_hash_;
  return s;
}

double Session::unit_scale(slam::ScaleState scale) const {
  return scale == slam::ScaleState::kAssumed ? config_.scale.assumed : 1.0;
}

}  // namespace farpoint::daemon
