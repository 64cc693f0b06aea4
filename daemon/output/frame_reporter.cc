// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/frame_reporter.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <limits>

#include "daemon/output/rate.h"
#include "daemon/output/reasons.h"
#include "daemon/output/sensor_use.h"

namespace farpoint::daemon {
namespace {

// In memory reserved at the start.
void note_reason(const slam::FrameResult& result, bool contradicted, status_t* s) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const bool valid = slam::is_valid(result.state);
  const ipc::Reason reason = contradicted ? ipc::Reason::kCalibrationContradicted
                             : valid      ? ipc::Reason::kNone
                                          : reason_of(result);
  s->reason = static_cast<std::int8_t>(reason);
  s->reason_value = contradicted || valid ? kNone : result.refusal.value;
  s->reason_wanted = contradicted || valid ? kNone : result.refusal.wanted;
  std::array<char, ipc::kReasonText> text;
  s->message = ipc::reason_text(reason, s->reason_value, s->reason_wanted, text);
}

}  // namespace

FrameReporter::FrameReporter(const Config& config, const Names& names, std::vector<PoseSink*> sinks,
                             Publisher* publisher, MapBoard* maps, std::int64_t pool_bytes,
                             bool with_schedule)
    : status_rate_hz_(config.lcm.status_rate_hz),
      assumed_scale_(config.scale.assumed),
      deadline_ms_(config.realtime.deadline_ms),
      features_(config.estimator.extractor.features),
      with_schedule_(with_schedule),
      sinks_(std::move(sinks)),
      publisher_(publisher),
      maps_(maps),
      next_status_utime_(kAtOnce) {
  status_.assumed_scale = config.scale.assumed;
  status_.memory_pool_bytes = pool_bytes;
  status_.build = names.build;
  status_.configuration_hash = names.configuration_hash;
  status_.calibration_hash = names.calibration_hash;
  status_.boot_counter = names.boot_counter;
  status_.message.reserve(ipc::kReasonText);
}

const FrameOutput& FrameReporter::report(FramePackage* package, const OutputCounts& out) {
  const slam::FrameResult& result = package->result;
  {
    const StageScope scope(&package->clock, timing_t::STAGE_OUTPUT);
    silence_.result = since_odom_reset(result);
    frame_ = make_output(silence_.result);
    frame_.age_us = package->chance.age_us;
    frame_.calibration_contradicted = package->counts.mapping.calibration_contradicted;
    frame_.boot_counter = status_.boot_counter;
    if (package->due_s > 0.0) frame_.age_at_s = package->due_s + 1e-6 * static_cast<double>(frame_.age_us);
    ++status_.frames_tracked;
    if (frame_.valid) ++status_.frames_valid;
    if (is_late(frame_.age_us, deadline_ms_)) ++status_.deadlines_missed;
    for (PoseSink* sink : sinks_) sink->on_frame(frame_);
    publisher_->on_frame(frame_);
    publish_status(*package, out);
    maps_->publish_known(result.taken.replies, publisher_);
    if (with_schedule_) publish_schedule(*package);
  }
  note_state(frame_.result);
  silence_.counts = package->counts;
  silence_.chance = package->chance;
  silence_.camera = package->camera;
  if (publisher_->has_sinks()) {
    publisher_->publish(
        ipc::kTimingChannel, result.utime,
        package->clock.message(result.utime, result.sequence, package->chance.age_us, deadline_ms_));
  }
  return frame_;
}

FrameOutput FrameReporter::make_output(const slam::FrameResult& result) {
  FrameOutput output = make_frame_output(result, assumed_scale_of(result.map_id), lever_m_);
  if (output.valid && output.result.scale == slam::ScaleState::kAssumed && assumed_map_ < 0) {
    assumed_map_ = result.map_id;
    maps_->assume_scale_of(assumed_map_);
  }
  return output;
}

slam::FrameResult FrameReporter::since_odom_reset(const slam::FrameResult& result) {
  if (result.has_pose && reset_odom_.exchange(false, std::memory_order_relaxed)) {
    T_odom_start_ = result.T_odom_body;
    drift_start_ = result.odometry.drift - slam::carried(T_odom_start_, result.odometry.noise);
    drift_resets_ = result.reset_counter;
    ++odom_resets_;
  }
  if (odom_resets_ == 0) return result;
  slam::FrameResult r = result;
  r.T_odom_body = T_odom_start_.inverse() * result.T_odom_body;
  // The drift of a map that began later begins with it.
  const slam::Matrix6d before = result.reset_counter == drift_resets_ && drift_start_.allFinite()
                                    ? drift_start_
                                    : slam::Matrix6d::Zero();
  r.odometry.drift = slam::carried(T_odom_start_.inverse(), result.odometry.drift - before);
  r.odometry.drift_of_second = slam::carried(T_odom_start_.inverse(), result.odometry.drift_of_second);
  // What the map frame says stays as it is: map_from_odom takes up the difference.
  const slam::Sim3& S = result.map_from_odom;
  r.map_from_odom = {S.scale, (S.q * T_odom_start_.q).normalized(), S * T_odom_start_.t};
  r.reset_counter += odom_resets_;
  return r;
}

const FrameOutput& FrameReporter::report_silence(std::int64_t utime, std::int64_t age_us,
                                                 const InputCounts& in, const OutputCounts& out) {
  slam::FrameResult& r = silence_.result;
  r.utime = utime;
  r.state = slam::State::kNoCamera;
  r.has_pose = false;
  r.quality = -1;
  r.features = r.matches = r.inliers = r.aligned = 0;
  r.keyframe = false;
  silence_.in = in;
  frame_ = make_output(r);
  frame_.age_us = age_us;
  frame_.boot_counter = status_.boot_counter;
  frame_.age_at_s = 1e-6 * static_cast<double>(utime);
  for (PoseSink* sink : sinks_) sink->on_frame(frame_);
  // Its time is that of the news, not of a measurement.
  frame_.age_us = 0;
  publisher_->on_frame(frame_);
  publish_status(silence_, out);
  note_state(frame_.result);
  return frame_;
}

void FrameReporter::publish_status(const FramePackage& package, const OutputCounts& out) {
  fill_status(package, out);
  const bool changed = frame_.result.state != last_state_;
  const double rate_hz = status_rate_hz_.load(std::memory_order_relaxed);
  const bool on_time = due(frame_.result.utime, rate_hz, &next_status_utime_);
  if (changed || on_time) publisher_->publish(ipc::kStatusChannel, frame_.result.utime, status_);
}

void FrameReporter::publish_schedule(const FramePackage& package) {
  const slam::FrameResult& r = package.result;
  schedule_t m{};
  m.utime = r.utime;
  m.sequence = r.sequence;
  m.replies_taken = static_cast<std::int64_t>(r.taken.replies);
  m.view_sequence = static_cast<std::int64_t>(r.view_sequence);
  m.job = static_cast<std::int64_t>(r.job);
  m.frames_dropped = package.chance.frames_dropped;
  m.age_us = package.chance.age_us;
  m.capture_queue = package.chance.capture_queue;
  m.publish_queue = package.chance.publish_queue;
  m.features_asked = package.chance.features_asked;
  m.imu_taken = static_cast<std::int64_t>(r.taken.imu);
  m.wheels_taken = static_cast<std::int64_t>(r.taken.wheels);
  m.samples_dropped = static_cast<std::int64_t>(package.counts.imu.dropped + package.counts.wheels.dropped);
  publisher_->publish(ipc::kScheduleChannel, r.utime, m);
}

void FrameReporter::fill_status(const FramePackage& package, const OutputCounts& out) {
  const slam::FrameResult& r = frame_.result;
  const slam::EstimatorCounts& counts = package.counts;
  const InputCounts& in = package.in;
  const FrameChance& chance = package.chance;
  status_t& s = status_;
  s.utime = r.utime;
  s.state = static_cast<std::int8_t>(r.state);
  s.scale_state = static_cast<std::int8_t>(r.scale);
  s.metre_source = static_cast<std::int8_t>(r.metre);
  s.wheels = static_cast<std::int8_t>(wheel_use(r));
  s.quality = static_cast<std::int8_t>(frame_.valid ? r.quality : -1);
  s.map_id = r.map_id;
  s.reset_counter = static_cast<std::int32_t>(r.reset_counter);
  s.frames_received = in.images;
  s.frames_dropped = chance.frames_dropped;
  s.keyframes_dropped = static_cast<std::int64_t>(counts.keyframes_dropped);
  s.images_wrong_size = in.wrong_size;
  s.images_undecodable = in.undecodable;
  s.images_missing = in.missing;
  s.images_flagged = in.flagged;
  s.camera_losses = in.camera_losses;
  s.stereo_pairs = in.stereo_pairs;
  s.stereo_left_alone = in.stereo_left_alone;
  s.stereo_right_alone = in.stereo_right_alone;
  s.stereo_skew_us = in.stereo_skew_us;
  s.images_unknown_camera = in.unknown_camera;
  s.times_backwards = in.times_backwards;
  s.times_unknown = in.times_unknown;
  s.messages_undecodable = in.messages_undecodable;
  s.log_damages = in.log_damages;
  s.imu_invalid = in.imu_invalid;
  s.imu_used = static_cast<std::int64_t>(counts.imu.used);
  s.imu_late = static_cast<std::int64_t>(counts.imu.late);
  s.imu_dropped = static_cast<std::int64_t>(counts.imu.dropped);
  s.wheels_used = static_cast<std::int64_t>(counts.wheels.used);
  s.wheels_late = static_cast<std::int64_t>(counts.wheels.late);
  s.wheels_dropped = static_cast<std::int64_t>(counts.wheels.dropped);
  s.wheels_invalid = in.wheels_invalid;
  s.can_send_errors = out.can_send_errors;
  s.can_bus_offs = out.can_bus_offs;
  s.can_received = out.can_received;
  s.can_state = out.can_state;
  s.lcm_send_errors = static_cast<std::int64_t>(publisher_->network_errors());
  s.mavlink_sent = out.mavlink_sent;
  s.mavlink_without_scale = out.mavlink_without_scale;
  s.mavlink_without_pose = out.mavlink_without_pose;
  s.mavlink_send_errors = out.mavlink_send_errors;
  s.mavlink_received = out.mavlink_received;
  s.mavlink_round_trip_us = out.mavlink_round_trip_us;
  s.images_not_recorded = in.not_recorded;
  s.log_write_errors = static_cast<std::int64_t>(publisher_->log_errors()) + out.can_not_logged;
  s.side_missing = out.side_missing;
  s.side_failures = out.side_failures;
  s.maps = static_cast<std::int32_t>(counts.maps);
  s.keyframes = static_cast<std::int32_t>(counts.keyframes);
  s.landmarks = static_cast<std::int32_t>(counts.landmarks);
  s.vmps = static_cast<std::int32_t>(counts.mapping.vmp_alive);
  note_reason(r, counts.mapping.calibration_contradicted, &s);
  s.times_lost = static_cast<std::int64_t>(counts.lost);
  const CameraNote& camera = package.camera;
  s.camera_format = camera.format == drivers::CameraFormat::kAuto ? "" : to_string(camera.format);
  s.camera_rate_hz = camera.rate_hz;
  s.camera_exposure_us = camera.exposure_us;
  s.camera_gain = camera.gain;
  s.capture_queue = chance.capture_queue;
  s.mapping_queue = r.jobs_under_way;
  s.publish_queue = chance.publish_queue;
  s.features_asked = chance.features_asked > 0 ? chance.features_asked : features_;
  s.capture_queue_max = std::max(s.capture_queue_max, s.capture_queue);
  s.mapping_queue_max = std::max(s.mapping_queue_max, s.mapping_queue);
  s.publish_queue_max = std::max(s.publish_queue_max, s.publish_queue);
}

void FrameReporter::note_state(const slam::FrameResult& result) {
  if (result.state == last_state_) return;
  spdlog::debug("frame {} at {:.6f} s: {} -> {} (map {}, {} of {} features matched, {} agree)",
                result.sequence, 1e-6 * static_cast<double>(result.utime), slam::to_string(last_state_),
                slam::to_string(result.state), result.map_id, result.matches, result.features,
                result.inliers);
  last_state_ = result.state;
}

}  // namespace farpoint::daemon
