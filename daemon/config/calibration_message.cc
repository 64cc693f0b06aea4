// SPDX-License-Identifier: Apache-2.0
#include "daemon/config/calibration_message.h"

#include <algorithm>

namespace farpoint::daemon {

void set_vector(const Eigen::Vector3d& v, double* out) {
  std::copy(v.data(), v.data() + 3, out);
}

void set_quaternion(const Eigen::Quaterniond& q, double* out) {
  out[0] = q.w();
  out[1] = q.x();
  out[2] = q.y();
  out[3] = q.z();
}

void set_pose(const slam::SE3& T, double* position, double* orientation) {
  set_vector(T.t, position);
  set_quaternion(T.q, orientation);
}

camera_calibration_t camera_message(const std::string& name, const slam::Camera::Parameters& parameters,
                                    const slam::SE3& T_body_camera, double rate_hz, double row_time_s) {
  const slam::Camera::Parameters& p = parameters;
  camera_calibration_t message{};
  message.name = name;
  message.model = p.model == slam::CameraModel::kKannalaBrandt ? "kannala-brandt" : "pinhole-radtan";
  message.width = p.width_px;
  message.height = p.height_px;
  message.fx = p.fx_px;
  message.fy = p.fy_px;
  message.cx = p.cx_px;
  message.cy = p.cy_px;
  std::copy(p.distortion.begin(), p.distortion.end(), message.distortion);
  set_pose(T_body_camera, message.position, message.orientation);
  message.rate_hz = rate_hz;
  message.row_time_s = row_time_s;
  return message;
}

}  // namespace farpoint::daemon
