// SPDX-License-Identifier: Apache-2.0
// Geometry to calibration messages. rig.h converts the other way.
#pragma once

#include <string>

#include "ipc/message.h"
#include "slam/config.h"

namespace farpoint::daemon {

// Arrays of three, and of four: w, x, y, z.
void set_vector(const Eigen::Vector3d& v, double* out);
void set_quaternion(const Eigen::Quaterniond& q, double* out);
void set_pose(const slam::SE3& T, double* position, double* orientation);

// One camera of a calibration. rate_hz: nominal, 0 unknown. row_time_s: rolling shutter, one row to the next;
// 0 global, negative unknown.
[[nodiscard]] camera_calibration_t camera_message(const std::string& name,
                                                  const slam::Camera::Parameters& parameters,
                                                  const slam::SE3& T_body_camera, double rate_hz,
                                                  double row_time_s);

}  // namespace farpoint::daemon
