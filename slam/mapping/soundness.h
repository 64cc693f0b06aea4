// SPDX-License-Identifier: Apache-2.0
// Whether a map is sound: whether what bundle adjustment leaves in the residuals is what the measurements'
// errors leave, or something that bends the map: a rolling shutter under fast rotation, a wrong calibration,
// a scene that moves.
#pragma once

#include "slam/solver/bundle_problem.h"

namespace farpoint::slam {

struct Soundness {
  // Mean of the measurements' chi2 (two degrees of freedom; each cut off at kLargestChi2), each with the say
  // that its point's weight gives it in the adjustment. It tells how large the residuals are, and with that
  // also how rough the scene is and how coarse its pixels.
  double mean_chi2 = 0;
  // How much more of its residuals an affine field over the image explains than it would of independent ones
  // (an F statistic), mean over the free keyframes. About 1 (less by what the adjustment has fitted itself)
  // where nothing bends the map, however large the residuals are: errors of patches know nothing of each
  // other, those of a camera are a field. 0 where no keyframe has enough measurements to tell.
  double coherence = 0;
  // How large the field is, in terms of chi2.
  [[nodiscard]] double pattern() const { return mean_chi2 * coherence; }

  // Whether the map's poses can be called valid. What held before may waver.
  [[nodiscard]] bool holds(bool held_before) const;
  // Whether the map is good enough to refine the calibration from. How coherent the residuals are does not
  // matter here: those of a wrong calibration are, and refinement is what finds it out.
  [[nodiscard]] bool fits_well(bool held_before) const;
};

inline constexpr double kLargestChi2 = 20.0;

// Of a problem that evaluate_bundle has seen at its present state.
[[nodiscard]] Soundness soundness_of(const BundleProblem& problem);

}  // namespace farpoint::slam
