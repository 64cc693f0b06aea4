// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/extrapolation.h"

#include <cmath>

namespace farpoint::daemon {
namespace {

// The turn is spread over the way: its half is a good direction for all of it.
slam::SE3 moved(const slam::SE3& T, const slam::Vector6d& velocity, double dt_s) {
  const Eigen::Vector3d turn = velocity.tail<3>() * dt_s;
  const Eigen::Vector3d way = slam::so3_exp(0.5 * turn) * (velocity.head<3>() * dt_s);
  return {(T.q * slam::so3_exp(turn)).normalized(), T.t + T.q * way};
}

}  // namespace

FrameOutput extrapolate(const FrameOutput& frame, double dt_s) {
  FrameOutput out = frame;
  out.age_us += std::llround(1e6 * dt_s);
  if (!frame.valid) return out;
  slam::FrameResult& r = out.result;
  r.T_odom_body = moved(r.T_odom_body, r.velocity_body, dt_s);
  r.T_map_body = moved(r.T_map_body, r.velocity_in_map(), dt_s);
  return out;
}

}  // namespace farpoint::daemon
