#include "daemon/output/can_sink.h"

#include <cmath>

#include "daemon/output/extrapolation.h"
#include "daemon/system/stage_clock.h"

namespace farpoint::daemon {
namespace {

// Standard deviation; NaN, which the codec sends as 'not available', where the variance is none.
double sigma(double variance) {
  return std::sqrt(variance);
}

// d(roll, pitch, heading) / d(rotation about the body's axes) for R = Rz(heading) Ry(pitch) Rx(roll).
Eigen::Matrix3d euler_jacobian(const ipc::EulerAngles& angles) {
  const double sin_roll = std::sin(angles.roll_rad), cos_roll = std::cos(angles.roll_rad);
  const double tan_pitch = std::tan(angles.pitch_rad), cos_pitch = std::cos(angles.pitch_rad);
  Eigen::Matrix3d J;
  J << 1.0, sin_roll * tan_pitch, cos_roll * tan_pitch,  //
      0.0, cos_roll, -sin_roll,                          //
      0.0, sin_roll / cos_pitch, cos_roll / cos_pitch;
  return J;
}

void set_sigmas(const slam::Matrix6d& covariance, const slam::SE3& T, const ipc::EulerAngles& angles,
                ipc::OdometryEpoch* epoch) {
  // The covariance is in body axes, the position in the frame's.
  const Eigen::Matrix3d R = T.rotation();
  const Eigen::Matrix3d of_position = R * covariance.topLeftCorner<3, 3>() * R.transpose();
  for (int i = 0; i < 3; ++i) epoch->sigma_position_m[static_cast<std::size_t>(i)] = sigma(of_position(i, i));
  const Eigen::Matrix3d J = euler_jacobian(angles);
  const Eigen::Matrix3d of_angles = J * covariance.bottomRightCorner<3, 3>() * J.transpose();
  epoch->sigma_roll_rad = sigma(of_angles(0, 0));
  epoch->sigma_pitch_rad = sigma(of_angles(1, 1));
  epoch->sigma_heading_rad = sigma(of_angles(2, 2));
}

}  // namespace

ipc::OdometryEpoch make_epoch(const FrameOutput& frame, CanPoseFrame pose_frame, double age_s) {
  const slam::FrameResult& r = frame.result;
  ipc::OdometryEpoch epoch;
  epoch.state = static_cast<std::uint8_t>(r.state);
  epoch.scale_state = static_cast<std::uint8_t>(r.scale);
  epoch.pose_valid = frame.valid;
  epoch.velocity_valid = frame.valid;
  epoch.from_vision = r.has_pose;
  epoch.map_frame = pose_frame == CanPoseFrame::kMap;
  epoch.reset_counter = r.reset_counter;
  epoch.map_id = r.map_id;
  epoch.quality = frame.valid ? r.quality : -1;
  epoch.age_s = age_s;
  // The estimator gives no uncertainty of the velocity yet.
  epoch.sigma_velocity_m_s.fill(-1.0);
  epoch.sigma_yaw_rate_rad_s = -1.0;
  if (!frame.valid) return epoch;

  const slam::SE3& T = epoch.map_frame ? r.T_map_body : r.T_odom_body;
  const ipc::EulerAngles angles = ipc::euler_angles({T.q.w(), T.q.x(), T.q.y(), T.q.z()});
  epoch.position_m = {T.t.x(), T.t.y(), T.t.z()};
  epoch.heading_rad = angles.heading_rad;
  epoch.roll_rad = angles.roll_rad;
  epoch.pitch_rad = angles.pitch_rad;
  epoch.velocity_m_s = {r.velocity_body[0], r.velocity_body[1], r.velocity_body[2]};
  epoch.yaw_rate_rad_s = r.velocity_body[5];
  set_sigmas(r.covariance, T, angles, &epoch);
  return epoch;
}

void CanSink::on_frame(const FrameOutput& frame) {
  const double age_s = 1e-6 * static_cast<double>(frame.age_us);
  const ipc::CanEpoch frames = encoder_.encode(make_epoch(frame, pose_frame_, age_s));
  if (bus_) bus_->send(frames);
  if (bus_ && steady_period_s_ > 0.0) {
    last_ = frame;
    last_s_ = frame.age_at_s > 0.0 ? frame.age_at_s : steady_s();
    next_due_s_ = last_s_ + steady_period_s_;
  }
  if (!log_) return;
  if (frame.result.utime >= 0) {
    log_->write(frame.result.utime, frames);
  } else {
    ++not_logged_;
  }
}

void CanSink::send_steadily(double rate_hz, double frame_period_s) {
  steady_period_s_ = rate_hz > 0.0 ? 1.0 / rate_hz : 0.0;
  frame_period_s_ = frame_period_s;
}

bool CanSink::tick(double now_s, wheels_t* wheels) {
  constexpr double kMaintainEvery_s = 1.0;
  if (!bus_) return false;
  if (now_s >= next_maintenance_s_) {
    next_maintenance_s_ = now_s + kMaintainEvery_s;
    bus_->maintain();
  }
  if (now_s >= next_due_s_) send_carried_on(now_s);
  ipc::CanFrame frame;
  std::int64_t age_us = 0;
  while (bus_->receive(&frame, &age_us)) {
    // Whoever looks only now and then must not make wheels younger than they are.
    const auto utime = static_cast<std::int64_t>(std::llround(1e6 * now_s)) - age_us;
    if (wheels_ && wheels_->take(frame, utime, wheels)) return true;
  }
  return false;
}

void CanSink::send_carried_on(double now_s) {
  // Longer than this nobody knows where the body went: its age alone goes on.
  constexpr double kLongest_s = 0.25;
  // From tick to tick, and not late for ever where one came late.
  next_due_s_ = std::max(next_due_s_ + steady_period_s_, now_s);
  const double dt_s = now_s - last_s_;
  FrameOutput frame = extrapolate(last_, dt_s, frame_period_s_);
  if (dt_s > kLongest_s) frame.valid = false;
  bus_->send(encoder_.encode(make_epoch(frame, pose_frame_, 1e-6 * static_cast<double>(frame.age_us))));
}

std::int64_t CanSink::errors() const {
  return not_logged_ + (bus_ ? static_cast<std::int64_t>(bus_->counts().not_sent) : 0);
}

void CanSink::close() {
  if (log_) log_->close();
}

}  // namespace farpoint::daemon
