// SPDX-License-Identifier: Apache-2.0
// Random rotations, poses and numbers for the geometry tests. Fixed seeds only.
#pragma once

#include <Eigen/Geometry>
#include <numbers>
#include <random>
#include <vector>

#include "slam/geometry/se3.h"

namespace farpoint::slam::testing {

using Rng = std::mt19937_64;

inline double uniform(Rng& rng, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(rng);
}
inline double gauss(Rng& rng) {
  return std::normal_distribution<double>()(rng);
}

inline Eigen::Vector3d gauss3(Rng& rng) {
  const double x = gauss(rng), y = gauss(rng), z = gauss(rng);
  return {x, y, z};
}
inline Eigen::Vector3d direction(Rng& rng) {
  return gauss3(rng).normalized();
}

inline SE3 random_pose(Rng& rng, double max_angle_rad, double max_translation) {
  const Eigen::Vector3d phi = direction(rng) * uniform(rng, 0.0, max_angle_rad);
  const Eigen::Vector3d t = direction(rng) * uniform(rng, 0.0, max_translation);
  return {so3_exp(phi), t};
}

// Unit bearing turned by Gaussian noise of sigma_rad in each of two directions across it.
inline Eigen::Vector3d noisy(Rng& rng, const Eigen::Vector3d& bearing, double sigma_rad) {
  const Eigen::Vector3d e1 = bearing.unitOrthogonal(), e2 = bearing.cross(e1);
  const double a = gauss(rng), b = gauss(rng);
  return (bearing + sigma_rad * (a * e1 + b * e2)).normalized();
}

// Rotation vectors on which series, quotients and signs go wrong first: zero, tiny, around the switch between
// series and closed form, and up to pi, along axes and askew.
inline std::vector<Eigen::Vector3d> special_rotation_vectors() {
  std::vector<Eigen::Vector3d> all = {Eigen::Vector3d::Zero()};
  const double pi = std::numbers::pi;
  for (const double angle : {1e-300, 1e-16, 1e-12, 1e-10, 1e-8, 1e-5, 9.999e-5, 1e-4, 1.001e-4, 1e-3, 0.1,
                             1.0, 0.5 * pi, 3.0, pi - 1e-3, pi - 1e-6, pi - 1e-9, pi - 1e-12}) {
    for (const Eigen::Vector3d& axis :
         {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, 0, -1),
          Eigen::Vector3d(1, -2, 3).normalized(), Eigen::Vector3d(-1, 1e-9, 1e-5).normalized()}) {
      all.emplace_back(angle * axis);
    }
  }
  return all;
}

}  // namespace farpoint::slam::testing
