// SPDX-License-Identifier: Apache-2.0
#include "slam/geometry/triangulation.h"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>

namespace farpoint::slam {

namespace {

// sin of the angle between bearing and baseline below which the epipolar plane is only rounding noise.
constexpr double kMinBaselineSine = 1e-9;
// Ratio of the second smallest to the largest singular value below which the rays leave a line of solutions.
constexpr double kMinRankRatio = 1e-10;

using Row4 = Eigen::Matrix<double, 1, 4>;

// Two unit vectors that complete the unit vector b to an orthogonal base.
void perpendicular_base(const Eigen::Vector3d& b, Eigen::Vector3d* e1, Eigen::Vector3d* e2) {
  *e1 = b.unitOrthogonal();
  *e2 = b.cross(*e1);
}

// Upper triangular factor of [factor; two rows]: keeps A^T A, needs no more memory however many rays come.
void append_rows(const Row4& row_1, const Row4& row_2, Eigen::Matrix4d* factor) {
  Eigen::Matrix<double, 6, 4> stacked;
  stacked.topRows<4>() = *factor;
  stacked.row(4) = row_1;
  stacked.row(5) = row_2;
  const Eigen::HouseholderQR<Eigen::Matrix<double, 6, 4>> qr(stacked);
  *factor = qr.matrixQR().topRows<4>().triangularView<Eigen::Upper>();
}

}  // namespace

double parallax_angle(const Eigen::Vector3d& ray_1, const Eigen::Vector3d& ray_2) {
  return std::atan2(ray_1.cross(ray_2).norm(), ray_1.dot(ray_2));
}

InverseDepth triangulate_inverse_depth(const Eigen::Vector3d& bearing_host, const SE3& T_target_host,
                                       const Eigen::Vector3d& bearing_target) {
  InverseDepth result;
  // In the target's axes the point's direction is a + rho t: it moves from a towards t as rho grows from 0.
  const Eigen::Vector3d a = T_target_host.q * bearing_host;
  const Eigen::Vector3d& t = T_target_host.t;
  result.parallax_rad = parallax_angle(a, bearing_target);
  const Eigen::Vector3d n = a.cross(t);
  const double t_norm = t.norm();
  if (!(n.norm() > kMinBaselineSine * t_norm) || !(t_norm > 0.0)) return result;
  // The closest direction is bearing_target projected into the epipolar plane; it is parallel to a + rho t
  // where n . (bearing_target x (a + rho t)) = 0. (The part of bearing_target along n drops out of this
  // product.)
  const double numerator = -n.dot(bearing_target.cross(a));
  const double denominator = n.dot(bearing_target.cross(t));
  const double rho = numerator / denominator;
  if (!std::isfinite(rho)) return result;
  result.inverse_depth = rho;
  result.ok = rho >= 0.0 && bearing_target.dot(a + rho * t) > 0.0;
  return result;
}

double inverse_depth_sigma(const Eigen::Vector3d& bearing_host, const SE3& T_target_host,
                           double inverse_depth, double sigma_target_rad, double sigma_host_rad) {
  const Eigen::Vector3d a = T_target_host.q * bearing_host;
  const Eigen::Vector3d& t = T_target_host.t;
  const Eigen::Vector3d direction = a + inverse_depth * t;
  const double length2 = direction.squaredNorm();
  // The direction turns in the epipolar plane by |a x t| / |a + rho t|^2 rad a unit of inverse depth.
  const double turn = a.cross(t).norm() / length2;
  if (!(turn > 0.0)) return std::numeric_limits<double>::infinity();
  // An error of the host's bearing turns the direction by cos(parallax) / |a + rho t| of itself.
  const double host_turn = a.dot(direction) / length2;
  return std::hypot(sigma_target_rad, host_turn * sigma_host_rad) / turn;
}

TriangulatedPoint triangulate_dlt(std::span<const Eigen::Vector3d> bearings_c,
                                  std::span<const SE3> T_camera_world) {
  TriangulatedPoint result;
  const size_t n = std::min(bearings_c.size(), T_camera_world.size());
  if (n < 2) return result;
  // Coordinates relative to the first camera, in units of the longest baseline: keeps the columns comparable.
  const Eigen::Vector3d origin_w = T_camera_world[0].inverse().t;
  double unit = 0.0;
  for (size_t i = 1; i < n; ++i) unit = std::max(unit, (T_camera_world[i] * origin_w).norm());
  if (!(unit > 0.0)) return result;

  Eigen::Matrix4d factor = Eigen::Matrix4d::Zero();
  for (size_t i = 0; i < n; ++i) {
    Eigen::Vector3d e1, e2;
    perpendicular_base(bearings_c[i], &e1, &e2);
    const Eigen::Matrix3d r = T_camera_world[i].rotation();
    const Eigen::Vector3d t = (T_camera_world[i] * origin_w) / unit;
    Row4 row_1, row_2;
    row_1 << e1.transpose() * r, e1.dot(t);
    row_2 << e2.transpose() * r, e2.dot(t);
    append_rows(row_1, row_2, &factor);
  }
  const Eigen::JacobiSVD<Eigen::Matrix4d> svd(factor, Eigen::ComputeFullV);
  const Eigen::Vector4d s = svd.singularValues();
  if (!(s(2) > kMinRankRatio * s(0))) return result;
  const Eigen::Vector4d h = svd.matrixV().col(3);
  const Eigen::Vector3d point = h.head<3>() / h(3);
  if (!point.allFinite()) return result;
  result.point_w = origin_w + unit * point;
  result.ok = true;
  for (size_t i = 0; i < n; ++i) {
    result.ok = result.ok && bearings_c[i].dot(T_camera_world[i] * result.point_w) > 0.0;
  }
  return result;
}

}  // namespace farpoint::slam
