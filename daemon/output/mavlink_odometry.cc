// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/mavlink_odometry.h"

#include <algorithm>
#include <cmath>

#include "daemon/output/epoch_predictor.h"

namespace farpoint::daemon {
namespace {

using ipc::mavlink::Triangle;
using slam::Matrix6d;

// Forward-left-up to forward-right-down, and back.
const Eigen::Vector3d kFrdFlu(1, -1, -1);

std::array<float, 3> frd(const Eigen::Vector3d& flu) {
  return {static_cast<float>(flu.x()), static_cast<float>(-flu.y()), static_cast<float>(-flu.z())};
}

Eigen::Quaterniond frd(const Eigen::Quaterniond& flu) {
  return {flu.w(), flu.x(), -flu.y(), -flu.z()};
}

Matrix6d turned(const Matrix6d& covariance, const Eigen::Matrix3d& of_translation,
                const Eigen::Matrix3d& of_rotation) {
  Matrix6d J = Matrix6d::Zero();
  J.topLeftCorner<3, 3>() = of_translation;
  J.bottomRightCorner<3, 3>() = of_rotation;
  return J * covariance * J.transpose();
}

// Derivatives of roll, pitch and yaw (R = Rz(yaw) Ry(pitch) Rx(roll)) by a small rotation about the body's
// axes. Nothing near a pitch of a quarter turn, where they have none.
std::optional<Eigen::Matrix3d> d_angles_d_rotation(const Eigen::Matrix3d& R) {
  const double sin_pitch = -R(2, 0), cos_pitch = std::hypot(R(2, 1), R(2, 2));
  constexpr double kLeastCosine = 0.02;  // within a degree of straight up or down
  if (cos_pitch < kLeastCosine) return std::nullopt;
  const double sin_roll = R(2, 1) / cos_pitch, cos_roll = R(2, 2) / cos_pitch;
  Eigen::Matrix3d J;
  J << 1, sin_roll * sin_pitch / cos_pitch, cos_roll * sin_pitch / cos_pitch,  //
      0, cos_roll, -sin_roll,                                                  //
      0, sin_roll / cos_pitch, cos_roll / cos_pitch;
  return J;
}

Triangle triangle_of(const Matrix6d& m) {
  if (!m.allFinite()) return ipc::mavlink::kUnknownTriangle;
  Triangle triangle{};
  std::size_t next = 0;
  for (int row = 0; row < 6; ++row)
    for (int column = row; column < 6; ++column) triangle.at(next++) = static_cast<float>(m(row, column));
  return triangle;
}

void set_covariances(const MeasurementNoise& noise, const Eigen::Matrix3d& R_local_body,
                     ipc::mavlink::Odometry* out) {
  const Eigen::Matrix3d F = kFrdFlu.asDiagonal();
  out->velocity_covariance = triangle_of(turned(noise.velocity, F, F));
  if (const auto d_angles = d_angles_d_rotation(R_local_body))
    out->pose_covariance = triangle_of(turned(noise.pose, R_local_body * F, *d_angles * F));
}

// The daemon's start weighs so much that a reset or two of the run before do not make up for it.
std::uint8_t reset_counter(const FrameOutput& frame) {
  constexpr std::uint32_t kOfAStart = 61;
  return static_cast<std::uint8_t>(
      (frame.result.reset_counter + kOfAStart * static_cast<std::uint32_t>(frame.boot_counter)) & 0xFF);
}

}  // namespace

MavlinkHold hold_of(const FrameOutput& frame, std::int64_t image_age_us) {
  if (!frame.valid || image_age_us > EpochPredictor::kLongest_us) return MavlinkHold::kNoPose;
  if (frame.result.scale == slam::ScaleState::kUnknown) return MavlinkHold::kNoScale;
  return MavlinkHold::kNone;
}

ipc::mavlink::Odometry mavlink_odometry(const FrameOutput& frame,
                                        const std::optional<MeasurementNoise>& noise, std::uint64_t time_us) {
  const slam::FrameResult& r = frame.result;
  ipc::mavlink::Odometry out;
  out.time_us = time_us;
  const Eigen::Quaterniond q = frd(r.T_odom_body.q).normalized();
  out.position_m = frd(r.T_odom_body.t);
  out.orientation_wxyz = {static_cast<float>(q.w()), static_cast<float>(q.x()), static_cast<float>(q.y()),
                          static_cast<float>(q.z())};
  out.velocity_m_s = frd(Eigen::Vector3d(r.velocity_body.head<3>()));
  out.rates_rad_s = frd(Eigen::Vector3d(r.velocity_body.tail<3>()));
  if (noise) set_covariances(*noise, q.toRotationMatrix(), &out);
  out.reset_counter = reset_counter(frame);
  // MAVLink: 0 is unknown, 1 the worst.
  out.quality = static_cast<std::int8_t>(r.quality < 0 ? 0 : std::clamp(r.quality, 1, 100));
  return out;
}

}  // namespace farpoint::daemon
