// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/pose_sink.h"

#include <cmath>

namespace farpoint::daemon {
namespace {

// The covariance of (translation, rotation) when the unit of length shrinks by `scale`.
slam::Matrix6d scaled_covariance(const slam::Matrix6d& covariance, double scale) {
  slam::Matrix6d scaled = covariance;
  scaled.topRows<3>() *= scale;
  scaled.leftCols<3>() *= scale;
  return scaled;
}

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
  r.covariance = scaled_covariance(r.covariance, assumed_scale);
  return output;
}

}  // namespace farpoint::daemon
