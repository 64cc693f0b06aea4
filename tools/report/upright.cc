// SPDX-License-Identifier: Apache-2.0
#include "tools/report/upright.h"

#include <array>
#include <cmath>

namespace farpoint::tools::report {
namespace {

// Cosine of 30 degrees: the images' mean up direction is not further from an axis.
constexpr double kLeastAlong = 0.866;

// The axis nearest to a direction, with its sign.
Eigen::Vector3d nearest_axis(const Eigen::Vector3d& direction) {
  Eigen::Index axis = 0;
  direction.cwiseAbs().maxCoeff(&axis);
  return std::copysign(1.0, direction[axis]) * Eigen::Vector3d::Unit(axis);
}

std::string axis_name(const Eigen::Vector3d& axis) {
  constexpr std::array kNames = {"x", "y", "z"};
  Eigen::Index index = 0;
  axis.cwiseAbs().maxCoeff(&index);
  return std::string(axis[index] < 0.0 ? "-" : "") + kNames.at(static_cast<std::size_t>(index));
}

double extent_along(const Eigen::Vector3d& axis, const Trajectory& path) {
  double low = axis.dot(path.poses.front().pose.t), high = low;
  for (const TimedPose& p : path.poses) {
    low = std::min(low, axis.dot(p.pose.t));
    high = std::max(high, axis.dot(p.pose.t));
  }
  return high - low;
}

}  // namespace

std::string turn_upright(Truth* truth) {
  const bool is_text_file = truth->frame_utimes.empty();
  if (!truth->is_known() || is_text_file || truth->world || !truth->body.has_orientation) return {};
  Eigen::Vector3d mean_up = Eigen::Vector3d::Zero();
  for (const TimedPose& p : truth->body.poses)
    mean_up += (p.pose.q * truth->T_body_camera0.q) * -Eigen::Vector3d::UnitY();
  mean_up /= static_cast<double>(truth->body.poses.size());
  const Eigen::Vector3d up = nearest_axis(mean_up);
  if (up.z() > 0.0 || up.dot(mean_up) < kLeastAlong) return {};
  if (extent_along(up, truth->body) >= extent_along(Eigen::Vector3d::UnitZ(), truth->body)) return {};

  const Eigen::Vector3d view =
      (truth->body.poses.front().pose.q * truth->T_body_camera0.q) * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d ahead = nearest_axis(view - up.dot(view) * up), left = up.cross(ahead);
  Eigen::Matrix3d R_page_truth;
  R_page_truth << ahead.transpose(), left.transpose(), up.transpose();
  const slam::SE3 T_page_truth{Eigen::Quaterniond(R_page_truth), Eigen::Vector3d::Zero()};
  for (TimedPose& p : truth->body.poses) p.pose = T_page_truth * p.pose;
  return "Its axis " + axis_name(up) + " points up; x, y, z are here its " + axis_name(ahead) + ", " +
         axis_name(left) + ", " + axis_name(up) + ".";
}

}  // namespace farpoint::tools::report
