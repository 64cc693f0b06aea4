// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/epoch_predictor.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "daemon/output/extrapolation.h"
#include "daemon/output/reasons.h"

namespace farpoint::daemon {
namespace {

constexpr double kMicro = 1e-6;

void set_pose(const FrameOutput& frame, ipc::OdometryEpoch* epoch) {
  const slam::FrameResult& r = frame.result;
  const slam::SE3& T = epoch->map_frame ? r.T_map_body : r.T_odom_body;
  const ipc::EulerAngles angles = ipc::euler_angles({T.q.w(), T.q.x(), T.q.y(), T.q.z()});
  epoch->position_m = {T.t.x(), T.t.y(), T.t.z()};
  epoch->heading_rad = angles.heading_rad;
  epoch->roll_rad = angles.roll_rad;
  epoch->pitch_rad = angles.pitch_rad;
  const slam::Vector6d velocity = epoch->map_frame ? r.velocity_in_map() : r.velocity_body;
  epoch->velocity_m_s = {velocity[0], velocity[1], velocity[2]};
  epoch->yaw_rate_rad_s = velocity[5];
}

ipc::CanScaleSource scale_source(slam::ScaleState scale) {
  switch (scale) {
    case slam::ScaleState::kUnknown:
      return ipc::CanScaleSource::kNone;
    case slam::ScaleState::kAssumed:
      return ipc::CanScaleSource::kAssumed;
    case slam::ScaleState::kMetric:
      break;
  }
  return ipc::CanScaleSource::kNotAvailable;
}

}  // namespace

void EpochPredictor::take(const FrameOutput& frame, std::int64_t image_us) {
  last_ = frame;
  if (frame.result.state == slam::State::kNoCamera) return;
  if (has_image_) note_period(image_us);
  has_image_ = true;
  image_us_ = image_us;
}

void EpochPredictor::note_period(std::int64_t image_us) {
  if (image_us <= image_us_) return;
  periods_us_.at(next_period_) = image_us - image_us_;
  next_period_ = (next_period_ + 1) % periods_us_.size();
}

// The middle one of the last three, so that one gap does not count as a period.
std::int64_t EpochPredictor::frame_period_us() const {
  if (options_.frame_period_s > 0.0) return std::llround(options_.frame_period_s / kMicro);
  std::array<std::int64_t, 3> sorted = periods_us_;
  std::sort(sorted.begin(), sorted.end());
  return sorted[1] > 0 ? sorted[1] : sorted[2];
}

ipc::OdometryEpoch EpochPredictor::head(std::int64_t now_us) const {
  const slam::FrameResult& r = last_.result;
  ipc::OdometryEpoch epoch;
  epoch.state = static_cast<std::uint8_t>(r.state);
  epoch.map_frame = options_.pose_frame == CanPoseFrame::kMap;
  epoch.reset_counter = r.reset_counter;
  epoch.boot_counter = options_.boot_counter;
  epoch.map_id = r.map_id;
  epoch.age_s = std::numeric_limits<double>::quiet_NaN();
  epoch.send_time_us = now_us;
  // The estimator does not measure gravity.
  epoch.levelled = ipc::CanYesNo::kNo;
  epoch.body_is_camera = body_is_camera_;
  return epoch;
}

ipc::OdometryEpoch EpochPredictor::at(std::int64_t now_us) const {
  ipc::OdometryEpoch epoch = head(now_us);
  const slam::FrameResult& r = last_.result;
  epoch.scale_state = static_cast<std::uint8_t>(r.scale);
  epoch.scale_source = scale_source(r.scale);
  const std::int64_t age_us = std::max<std::int64_t>(now_us - image_us_, 0);
  const bool in_time = !has_image_ || age_us <= kLongest_us;
  if (has_image_) epoch.age_s = kMicro * static_cast<double>(age_us);
  epoch.reason = reason(in_time);
  if (!in_time && slam::is_valid(r.state)) epoch.state = ipc::kCanStateLost;
  if (!last_.valid || !in_time || !has_image_) return epoch;

  epoch.pose_valid = epoch.velocity_valid = true;
  epoch.from_vision = r.has_pose && r.from_vision && age_us <= frame_period_us();
  epoch.predicted = age_us > 0;
  epoch.quality = r.quality;
  set_pose(extrapolate(last_, epoch.age_s), &epoch);
  return epoch;
}

ipc::Reason EpochPredictor::reason(bool in_time) const {
  const slam::State state = last_.result.state;
  if (last_.calibration_contradicted) return ipc::Reason::kCalibrationContradicted;
  if (state == slam::State::kNoCamera) return ipc::Reason::kNoCamera;
  if (!in_time) return ipc::Reason::kNoPoseInTime;
  if (slam::is_valid(state) && !last_.valid) return ipc::Reason::kNumberOutOfRange;
  return reason_of(last_.result);
}

ipc::OdometryEpoch EpochPredictor::farewell(std::int64_t now_us) const {
  ipc::OdometryEpoch epoch = head(now_us);
  epoch.state = ipc::kCanStateStopped;
  epoch.reason = ipc::Reason::kStopped;
  epoch.levelled = epoch.body_is_camera = ipc::CanYesNo::kNotAvailable;
  return epoch;
}

}  // namespace farpoint::daemon
