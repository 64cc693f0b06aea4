// SPDX-License-Identifier: Apache-2.0
// Geometry of two views for automatic initialisation: motion up to scale, inliers and structure from matched
// bearings with outliers, or the reason why there is none.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "slam/geometry/relative_motion.h"
#include "slam/geometry/se3.h"

namespace farpoint::slam {

enum class TwoViewStatus {
  kOk,
  kTooFewMatches,
  kNoParallax,  // rotation alone explains the matches to the noise level
  kAmbiguous,   // two different motions explain them equally well (a plane seen twice), or the direction of
                // translation is hardly fixed
  kPoorModel,   // no motion explains enough of them
};

enum class TwoViewModel { kNone, kEssential, kHomography };

[[nodiscard]] const char* name(TwoViewStatus status);

struct TwoViewOptions {
  size_t min_matches = 20;
  size_t min_inliers = 20;
  double min_inlier_share = 0.3;
  // Of the matches that a general motion explains, the share that a rotation does not: at most this, no
  // parallax.
  double max_unexplained_share = 0.1;
  // Two motions are equally good where their costs (sums of truncated chi-squares) differ by less than this
  // many standard deviations of the difference, as its spread over the matches shows (Vuong, Econometrica
  // 1989).
  double ambiguity_sigmas = 3.0;
  double max_translation_sigma_rad = 0.15;
  int max_samples = 400;  // a model; fewer where the inlier share allows
  uint64_t seed = 0x5eed;
};

struct TwoViewResult {
  TwoViewStatus status = TwoViewStatus::kTooFewMatches;
  TwoViewModel model = TwoViewModel::kNone;
  // Unit translation norm. For kNoParallax the rotation with zero translation, for kAmbiguous the best found.
  SE3 T_2_1;
  // One entry a match. An inlier fits the motion and does not lie behind a view beyond its noise; an inlier
  // without a valid depth is far away or close to the direction of motion.
  std::vector<uint8_t> inlier;
  std::vector<double> inverse_depth;   // along bearing_1, in 1 / baseline; <= 0: invalid
  std::vector<double> parallax_rad;    // between the two rays in common axes
  double median_parallax_rad = 0.0;    // over the inliers with valid depth
  double translation_sigma_rad = 0.0;  // 1-sigma of the direction of translation
  size_t matches = 0;
  size_t inliers = 0;
  size_t valid_depths = 0;
  size_t essential_inliers = 0, homography_inliers = 0, rotation_inliers = 0;
  double unexplained_share = 0.0;  // see max_unexplained_share
  double rival_sigmas =
      0.0;  // how much worse the best different motion is, see ambiguity_sigmas; infinity: none
};

// bearings_1[i] and bearings_2[i] (unit, any field of view) are matched; sigma_rad is the standard deviation
// of one bearing component in each view (pixel sigma / focal length). Deterministic: equal input gives equal
// bits.
//
// Rotation alone, homography and essential motion are each fitted by RANSAC with truncated chi-square costs
// (MSAC; Torr & Zisserman, CVIU 2000). Homography against essential motion is decided by Torr's GRIC (Torr,
// Fitzgibbon, Zisserman, IJCV 1999), which weighs residuals of different degrees of freedom. All motions that
// either model allows are refined and compared by one cost, epipolar residual and cheirality together, so
// that the twofold solution of a plane is seen as such whichever model found it.
[[nodiscard]] TwoViewResult estimate_two_view(std::span<const Eigen::Vector3d> bearings_1,
                                              std::span<const Eigen::Vector3d> bearings_2, double sigma_rad,
                                              const TwoViewOptions& options = {});

// What a match is under one motion.
struct MatchGeometry {
  enum class Side : uint8_t { kFront, kBehind, kNoDepth };

  double chi2 = 0.0;  // epipolar residual
  Side side = Side::kNoDepth;
  bool supported = true;  // see supported_matches
  double inverse_depth = 0.0;
  double inverse_depth_sigma = 0.0;
  double parallax_rad = 0.0;
};

// Memory of estimate_two_view(), kept from call to call: no call allocates that has at most as many matches
// as reserve() was given.
struct TwoViewWorkspace {
  void reserve(size_t matches);
  [[nodiscard]] size_t bytes() const;

  Eigen::ArrayXXf columns;    // of the matches, in single precision
  std::vector<uint8_t> mask;  // of the matches that a rotation explains
  std::vector<double> plane_chi2, values;
  std::vector<MatchGeometry> geometry;
  MotionWorkspace motion;
  TwoViewResult result;
};
// The same, in the workspace's memory; the result is the workspace's until the next call.
const TwoViewResult& estimate_two_view(std::span<const Eigen::Vector3d> bearings_1,
                                       std::span<const Eigen::Vector3d> bearings_2, double sigma_rad,
                                       const TwoViewOptions& options, TwoViewWorkspace* workspace);

}  // namespace farpoint::slam
