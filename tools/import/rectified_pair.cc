// SPDX-License-Identifier: Apache-2.0
#include "tools/import/rectified_pair.h"

#include <cmath>

#include "daemon/config/yaml_file.h"

namespace farpoint::tools {
namespace {

bool rotation_of(const Rectification& rectification, slam::SE3* rotation) {
  Eigen::Matrix<double, 3, 4> matrix = Eigen::Matrix<double, 3, 4>::Zero();
  matrix.leftCols<3>() = rectification.R;
  return matrix.allFinite() && daemon::to_rigid_motion(matrix, rotation);
}

}  // namespace

Rectification rectification_of(std::span<const double, 9> r, std::span<const double, 12> p) {
  return {Eigen::Map<const Eigen::Matrix3d>(r.data()).transpose(), -p[3] / p[0]};
}

std::optional<slam::SE3> second_camera(const Rectification& first, const Rectification& second) {
  constexpr double kMinBaseline_m = 1e-6, kMaxBaseline_m = 10.0;
  const double right_m = second.right_m - first.right_m;
  slam::SE3 R_first, R_second;
  // Not finite without a focal length in P.
  if (!(std::abs(right_m) > kMinBaseline_m && std::abs(right_m) < kMaxBaseline_m)) return {};
  if (!rotation_of(first, &R_first) || !rotation_of(second, &R_second)) return {};
  return R_first.inverse() * slam::SE3{Eigen::Quaterniond::Identity(), {right_m, 0.0, 0.0}} * R_second;
}

}  // namespace farpoint::tools
