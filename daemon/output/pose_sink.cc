// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/pose_sink.h"

#include <cmath>
#include <limits>

namespace farpoint::daemon {
namespace {

void scale_lengths(double scale, slam::FrameResult* r) {
  r->T_map_body.t *= scale;
  r->T_odom_body.t *= scale;
  r->map_from_odom.t *= scale;  // both frames change their unit: the ratio between them stays
  r->velocity_body.head<3>() *= scale;
  slam::OdometryErrors& odometry = r->odometry;
  for (slam::Matrix6d* m :
       {&r->covariance, &r->velocity_covariance, &odometry.noise, &odometry.drift, &odometry.drift_of_second})
    *m = slam::in_unit(*m, scale);
}

// From a body at the camera to the body itself. The origins of odom and map move with it, to its first place.
void move_body(const Eigen::Vector3d& lever_m, slam::FrameResult* r) {
  const slam::SE3 T_body_camera{Eigen::Quaterniond::Identity(), lever_m};
  for (slam::SE3* T : {&r->T_map_body, &r->T_odom_body}) *T = T_body_camera * *T * T_body_camera.inverse();
  slam::Sim3& S = r->map_from_odom;
  S.t += lever_m - S.scale * (S.q * lever_m);
  r->velocity_body = slam::adjoint(T_body_camera) * r->velocity_body;
  slam::OdometryErrors& odometry = r->odometry;
  for (slam::Matrix6d* m :
       {&r->covariance, &r->velocity_covariance, &odometry.noise, &odometry.drift, &odometry.drift_of_second})
    *m = slam::carried(T_body_camera, *m);
}

bool finite(const slam::FrameResult& r) {
  return r.T_map_body.is_finite() && r.T_odom_body.is_finite() && r.velocity_body.allFinite() &&
         r.map_from_odom.q.coeffs().allFinite() && r.map_from_odom.t.allFinite() &&
         std::isfinite(r.map_from_odom.scale);
}

}  // namespace

FrameOutput make_frame_output(const slam::FrameResult& result, double assumed_scale,
                              const Eigen::Vector3d& lever_m) {
  FrameOutput output{result, slam::is_valid(result.state) && result.has_pose && finite(result)};
  // A measured scale is better than an assumed one.
  if (assumed_scale <= 0.0 || result.scale == slam::ScaleState::kMetric) return output;
  slam::FrameResult& r = output.result;
  r.scale = slam::ScaleState::kAssumed;
  scale_lengths(assumed_scale, &r);
  if (!lever_m.isZero(0.0)) move_body(lever_m, &r);
  r.odometry.scale_sigma = std::numeric_limits<double>::quiet_NaN();  // none is given with the key
  return output;
}

}  // namespace farpoint::daemon
