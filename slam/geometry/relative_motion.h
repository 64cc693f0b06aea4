// SPDX-License-Identifier: Apache-2.0
// Models that relate unit bearings of two views - essential motion, homography of a plane, rotation alone -
// with angular residuals that hold for any field of view, and their refinement.
//
// Residuals are squared angles in rad^2: divided by the variance of one bearing component (both views alike)
// they follow a chi-square distribution with the degrees of freedom stated. Every span pair has matching
// indices.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "slam/geometry/se3.h"

namespace farpoint::slam {

using Bearings = std::span<const Eigen::Vector3d>;
using Mask = std::span<const uint8_t>;

// --- general motion ---

// First-order (Sampson) squared distance from the epipolar constraint; 1 degree of freedom. T_2_1.t of unit
// length. Infinity where both bearings lie on the baseline.
[[nodiscard]] double epipolar_residual2_rad2(const SE3& T_2_1, const Eigen::Vector3d& bearing_1,
                                             const Eigen::Vector3d& bearing_2);

// The four motions of an essential matrix: two rotations, each with both signs of a unit translation.
[[nodiscard]] std::array<SE3, 4> decompose_essential(const Eigen::Matrix3d& essential);

// Mask of the matches whose epipolar residual is below limit_rad and most of whose neighbours in the order of
// parallax fit too. A wrong match lies on its epipolar line by chance, mostly far along it, among others that
// do not fit. Few as such matches are, the large parallax gives them a leverage over the translation that
// hundreds of right ones with small parallax do not outweigh, so their residual alone cannot give them away.
[[nodiscard]] std::vector<uint8_t> supported_matches(Bearings bearings_1, Bearings bearings_2,
                                                     const SE3& T_2_1, double limit_rad);

// Memory of the two functions below, kept from call to call: no call allocates that has at most as many
// matches as reserve() was given.
struct MotionWorkspace {
  struct Entry {
    double parallax;
    size_t match;
    bool fits;
  };
  void reserve(size_t matches);
  [[nodiscard]] size_t bytes() const;

  std::vector<Entry> by_parallax;
  std::vector<size_t> fitting_before;
  std::vector<uint8_t> supported;  // the result of supported_matches
  std::vector<size_t> use;
};
// The same, in the workspace's memory; the result is the workspace's until the next call.
const std::vector<uint8_t>& supported_matches(Bearings bearings_1, Bearings bearings_2, const SE3& T_2_1,
                                              double limit_rad, MotionWorkspace* workspace);

struct MotionFit {
  SE3 T_2_1;  // unit translation
  double translation_sigma_rad =
      0;            // largest 1-sigma of the translation's direction; infinity where not fixed
  size_t used = 0;  // matches within 3 sigma in the last round
};

// Minimises the Huber cost of the epipolar residuals over rotation and direction of translation (5 degrees of
// freedom, Levenberg-Marquardt, exact derivatives). The matches that take part are chosen anew in each of
// five rounds, within 8 sigma at first and 3 at last.
[[nodiscard]] MotionFit refine_motion(Bearings bearings_1, Bearings bearings_2, double sigma_rad,
                                      const SE3& T_2_1);
[[nodiscard]] MotionFit refine_motion(Bearings bearings_1, Bearings bearings_2, double sigma_rad,
                                      const SE3& T_2_1, MotionWorkspace* workspace);

// --- plane ---

// bearing_2 ~ H bearing_1. First-order (Sampson) squared distance; 2 degrees of freedom. Infinity where the
// transferred bearing points away from bearing_2.
[[nodiscard]] double homography_residual2_rad2(const Eigen::Matrix3d& homography,
                                               const Eigen::Vector3d& bearing_1,
                                               const Eigen::Vector3d& bearing_2);

// Linear homography of the matches whose mask is set (at least four), weights alike, scaled to Frobenius norm
// 1 and the sign that maps bearings forward. False where they fix none.
[[nodiscard]] bool fit_homography(Bearings bearings_1, Bearings bearings_2, Mask used,
                                  Eigen::Matrix3d* homography);

// Maximum-likelihood homography: Gauss-Newton on the Sampson residuals with Huber weights; the matches are
// chosen anew in each step, within 8 sigma at first and 3 at last.
[[nodiscard]] Eigen::Matrix3d refine_homography(Bearings bearings_1, Bearings bearings_2, double sigma_rad,
                                                const Eigen::Matrix3d& homography);

struct PlaneMotion {
  SE3 T_2_1;  // translation of unit length
  Eigen::Vector3d normal_1 =
      Eigen::Vector3d::UnitZ();  // of the plane, towards the points: normal_1 . point_1 > 0
};
struct PlaneMotions {
  std::array<PlaneMotion, 4> motion;
  size_t count = 0;  // 4, or 0 where the homography is a rotation to the precision of doubles
};

// All motions that make the homography (Ma, Soatto, Kosecka, Sastry, "An Invitation to 3-D Vision",
// section 5.3.3), two of them mirrored in the sign of normal and translation.
[[nodiscard]] PlaneMotions decompose_homography(const Eigen::Matrix3d& homography);

// --- rotation alone ---

// |bearing_2 - R bearing_1|^2 / 2; 2 degrees of freedom.
[[nodiscard]] double rotation_residual2_rad2(const Eigen::Matrix3d& R_2_1, const Eigen::Vector3d& bearing_1,
                                             const Eigen::Vector3d& bearing_2);

// Least-squares rotation of the matches whose mask is set (two that are not parallel suffice); Kabsch 1976.
[[nodiscard]] Eigen::Matrix3d fit_rotation(Bearings bearings_1, Bearings bearings_2, Mask used);

}  // namespace farpoint::slam
