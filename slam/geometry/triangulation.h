// SPDX-License-Identifier: Apache-2.0
// Triangulation from unit bearings, sound for nearly parallel rays and for fields of view beyond 90 degrees.
//
// A landmark is its host's bearing and the inverse depth along it: p_host = bearing_host / inverse_depth, in
// units of the translation. Inverse depth 0 is a point at infinity.
#pragma once

#include <Eigen/Core>
#include <span>

#include "slam/geometry/se3.h"

namespace farpoint::slam {

// Angle in [0, pi] between two vectors of any length in the same axes. Full relative precision near 0 and pi,
// where acos of the cosine loses half of its digits.
[[nodiscard]] double parallax_angle(const Eigen::Vector3d& ray_1, const Eigen::Vector3d& ray_2);

struct InverseDepth {
  // True where the point lies in front of both views or at infinity. False where the rays meet behind the
  // host or the target (inverse_depth then still holds the signed solution, so that a caller who knows its
  // sigma may take a slightly negative one for infinity), and where the bearing runs along the baseline and
  // holds no depth at all (inverse_depth is then 0).
  bool ok = false;
  double inverse_depth = 0.0;  // 1 / units of T_target_host's translation
  double parallax_rad = 0.0;   // between the two rays in common axes, measurement noise included
};

// Inverse depth along bearing_host that minimises the angle between bearing_target and the point's direction
// in the target (optimal for noise in the target; the host's bearing is kept as it is). Both bearings are of
// unit length.
[[nodiscard]] InverseDepth triangulate_inverse_depth(const Eigen::Vector3d& bearing_host,
                                                     const SE3& T_target_host,
                                                     const Eigen::Vector3d& bearing_target);

// First-order 1-sigma of that inverse depth. sigma_target_rad is the standard deviation of one bearing
// component (pixel sigma / focal length) in the target, sigma_host_rad the host's; 0 takes the host's bearing
// as exact. Infinity where the motion moves the landmark's image nowhere (no translation, or bearing along
// the baseline).
[[nodiscard]] double inverse_depth_sigma(const Eigen::Vector3d& bearing_host, const SE3& T_target_host,
                                         double inverse_depth, double sigma_target_rad,
                                         double sigma_host_rad = 0.0);

struct TriangulatedPoint {
  // False for fewer than two rays, rays that fix no point (all parallel or one centre), or a point not in
  // front of every camera.
  bool ok = false;
  Eigen::Vector3d point_w = Eigen::Vector3d::Zero();
};

// Linear triangulation from N >= 2 rays: the direct linear transform, solved by SVD (Hartley & Zisserman,
// Multiple View Geometry, 2nd ed., section 12.2), two equations a ray, with bearings in place of image
// points. bearings_c[i] is of unit length in the axes of camera i, T_camera_world[i] that camera's pose. No
// heap.
[[nodiscard]] TriangulatedPoint triangulate_dlt(std::span<const Eigen::Vector3d> bearings_c,
                                                std::span<const SE3> T_camera_world);

}  // namespace farpoint::slam
