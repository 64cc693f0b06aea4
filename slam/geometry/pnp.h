// SPDX-License-Identifier: Apache-2.0
// Absolute pose of a camera from bearings and known points, with outliers: for relocalisation.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "slam/geometry/se3.h"

namespace farpoint::slam {

struct PoseCandidates {
  std::array<SE3, 4> T_camera_world;
  size_t count = 0;
};

// Poses for which three world points lie along three unit bearings (any field of view), in front of the
// camera. Grunert's solution by a quartic in the ratio of two distances, in the form of Haralick, Lee,
// Ottenberg, Noelle, "Review and analysis of solutions of the three point perspective pose estimation
// problem", IJCV 1994. No heap.
[[nodiscard]] PoseCandidates solve_p3p(std::span<const Eigen::Vector3d, 3> bearings_c,
                                       std::span<const Eigen::Vector3d, 3> points_w);

struct PnpOptions {
  size_t min_inliers = 10;
  double min_inlier_share = 0.0;
  int max_samples = 500;  // of three matches; fewer where the inlier share allows
  uint64_t seed = 0x5eed;
};

struct PnpResult {
  bool ok = false;  // false: too few matches or inliers; the rest then holds the best found
  SE3 T_camera_world;
  std::vector<uint8_t> inlier;  // one a match: within the 99 % limit of chi-square with 2 degrees of freedom
  size_t inliers = 0;
  int samples = 0;       // of three matches that were tried; 0 where none gave a pose
  double rms_rad = 0.0;  // of the inliers' bearing errors, per component
};

// bearings_c[i] (unit, camera axes) sees points_w[i]; sigma_rad is the standard deviation of one bearing
// component (pixel sigma / focal length). RANSAC over three-point poses with a truncated chi-square cost,
// then refinement. Deterministic: equal input gives equal bits.
[[nodiscard]] PnpResult solve_pnp(std::span<const Eigen::Vector3d> bearings_c,
                                  std::span<const Eigen::Vector3d> points_w, double sigma_rad,
                                  const PnpOptions& options = {});

// Memory of solve_pnp(), kept from call to call: with it no call allocates that has at most as many matches
// as reserve() was given.
struct PnpWorkspace {
  void reserve(size_t matches);
  std::vector<Eigen::Vector3d> points;  // relative to their centre
  std::vector<size_t> use;
  PnpResult result;
};
// The same, in the workspace's memory; the result is the workspace's until the next call.
const PnpResult& solve_pnp(std::span<const Eigen::Vector3d> bearings_c,
                           std::span<const Eigen::Vector3d> points_w, double sigma_rad,
                           const PnpOptions& options, PnpWorkspace* workspace);

// Minimises the Huber cost of the bearing errors from a close pose; takes the matches within 3 sigma (8 at
// first) anew in each round.
[[nodiscard]] SE3 refine_pose(std::span<const Eigen::Vector3d> bearings_c,
                              std::span<const Eigen::Vector3d> points_w, double sigma_rad,
                              const SE3& T_camera_world);

}  // namespace farpoint::slam
