// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/pose_sink.h"

#include <cmath>
#include <limits>

namespace farpoint::daemon {
namespace {

bool finite(const slam::FrameResult& r) {
  return r.T_map_body.is_finite() && r.T_odom_body.is_finite() && r.velocity_body.allFinite() &&
         r.map_from_odom.q.coeffs().allFinite() && r.map_from_odom.t.allFinite() &&
         std::isfinite(r.map_from_odom.scale);
}

}  // namespace

FrameOutput make_frame_output(const slam::FrameResult& result, double assumed_scale) {
  FrameOutput output{result, slam::is_valid(result.state) && result.has_pose && finite(result)};
  // A measured scale is better than an assumed one.
  if (assumed_scale <= 0.0 || result.scale == slam::ScaleState::kMetric) return output;
  slam::FrameResult& r = output.result;
  r.scale = slam::ScaleState::kAssumed;
  r.T_map_body.t *= assumed_scale;
  r.T_odom_body.t *= assumed_scale;
  r.map_from_odom.t *= assumed_scale;  // both frames change their unit: the ratio between them stays
  r.velocity_body.head<3>() *= assumed_scale;
  for (slam::Matrix6d* m : {&r.covariance, &r.velocity_covariance, &r.odometry.noise, &r.odometry.drift})
    *m = slam::in_unit(*m, assumed_scale);
  r.odometry.scale_sigma = std::numeric_limits<double>::quiet_NaN();  // none is given with the key
  return output;
}

}  // namespace farpoint::daemon
