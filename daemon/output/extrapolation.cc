#include "daemon/output/extrapolation.h"

#include <cmath>

namespace farpoint::daemon {
namespace {

constexpr double kAcceleration_m_s2 = 3.0, kAngularAcceleration_rad_s2 = 2.0;

// The turn is spread over the way: its half is a good direction for all of it.
slam::SE3 moved(const slam::SE3& T, const slam::Vector6d& velocity, double dt_s) {
  const Eigen::Vector3d turn = velocity.tail<3>() * dt_s;
  const Eigen::Vector3d way = slam::so3_exp(0.5 * turn) * (velocity.head<3>() * dt_s);
  return {(T.q * slam::so3_exp(turn)).normalized(), T.t + T.q * way};
}

}  // namespace

FrameOutput extrapolate(const FrameOutput& frame, double dt_s, double period_s) {
  FrameOutput out = frame;
  out.age_us += std::llround(1e6 * dt_s);
  if (!frame.valid) return out;
  slam::FrameResult& r = out.result;
  r.T_odom_body = moved(r.T_odom_body, r.velocity_body, dt_s);
  r.T_map_body = moved(r.T_map_body, r.velocity_body, dt_s);
  const double steps = period_s > 0.0 ? dt_s / period_s : 0.0;
  r.covariance *= 1.0 + 2.0 * steps * steps;
  const double way_m = 0.5 * kAcceleration_m_s2 * dt_s * dt_s;
  const double turn_rad = 0.5 * kAngularAcceleration_rad_s2 * dt_s * dt_s;
  r.covariance.diagonal().head<3>().array() += way_m * way_m;
  r.covariance.diagonal().tail<3>().array() += turn_rad * turn_rad;
  return out;
}

}  // namespace farpoint::daemon
