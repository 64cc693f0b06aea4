// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/epoch_predictor.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "daemon/output/attitude.h"
#include "daemon/output/extrapolation.h"
#include "daemon/output/reasons.h"
#include "daemon/output/sensor_use.h"

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

// Standard deviations of what set_pose() puts in.
void set_sigmas(const FrameOutput& frame, ipc::OdometryEpoch* epoch) {
  const slam::FrameResult& r = frame.result;
  const slam::SE3& T = epoch->map_frame ? r.T_map_body : r.T_odom_body;
  const slam::Matrix6d pose = epoch->map_frame ? r.covariance : r.odometry.without_scale(r.T_odom_body);
  const Eigen::Matrix3d R = T.rotation();
  const Eigen::Vector3d position = (R * pose.topLeftCorner<3, 3>() * R.transpose()).diagonal().cwiseSqrt();
  epoch->sigma_position_m = {position.x(), position.y(), position.z()};
  if (const auto d_angles = d_angles_d_rotation(R)) {
    const Eigen::Vector3d angles =
        (*d_angles * pose.bottomRightCorner<3, 3>() * d_angles->transpose()).diagonal().cwiseSqrt();
    epoch->sigma_roll_rad = angles.x();
    epoch->sigma_pitch_rad = angles.y();
    epoch->sigma_heading_rad = angles.z();
  }
  slam::Vector6d velocity = r.velocity_covariance.diagonal().cwiseSqrt();
  if (epoch->map_frame) velocity.head<3>() *= r.map_from_odom.scale;
  epoch->sigma_velocity_m_s = {velocity[0], velocity[1], velocity[2]};
  epoch->sigma_yaw_rate_rad_s = velocity[5];
  epoch->scale_sigma = r.odometry.scale_sigma;
}

ipc::CanScaleSource scale_source(const slam::FrameResult& result) {
  switch (result.scale) {
    case slam::ScaleState::kUnknown:
      return ipc::CanScaleSource::kNone;
    case slam::ScaleState::kAssumed:
      return ipc::CanScaleSource::kAssumed;
    case slam::ScaleState::kMetric:
      break;
  }
  return result.metre == slam::MetreSource::kWheels ? ipc::CanScaleSource::kWheels
                                                    : ipc::CanScaleSource::kSecondCamera;
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
  epoch.scale_source = scale_source(r);
  epoch.wheels = wheel_use(r);
  // A map of unknown unit has no place for the lever arm.
  if (r.scale == slam::ScaleState::kUnknown && body_is_camera_ == ipc::CanYesNo::kNo)
    epoch.body_is_camera = ipc::CanYesNo::kYes;
  const std::int64_t age_us = std::max<std::int64_t>(now_us - image_us_, 0);
  const bool in_time = !has_image_ || age_us <= kLongest_us;
  if (has_image_) epoch.age_s = kMicro * static_cast<double>(age_us);
  epoch.reason = reason(in_time);
  if (!in_time && slam::is_valid(r.state)) epoch.state = ipc::kCanStateLost;
  if (!last_.valid || !in_time || !has_image_) return epoch;

  epoch.pose_valid = true;
  epoch.velocity_valid = r.knows_velocity();
  epoch.from_vision = r.has_pose && r.from_vision && age_us <= frame_period_us();
  epoch.predicted = age_us > 0;
  epoch.quality = r.quality;
  const FrameOutput now = extrapolate(last_, epoch.age_s);
  set_pose(now, &epoch);
  set_sigmas(now, &epoch);
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
