// SPDX-License-Identifier: Apache-2.0
// Whether a map is sound: whether what bundle adjustment leaves in the residuals is what the measurements'
// errors leave, or something that bends the map: a rolling shutter under fast rotation, a wrong calibration,
// a scene that moves.
#pragma once

#include "slam/map/refusal.h"
#include "slam/solver/bundle_problem.h"

namespace farpoint::slam {

struct Soundness {
  // Noise, excess and field are those of the first camera, which holds the map's shape.
  //
  // Mean of the measurements' chi2 (two degrees of freedom; each cut off at kLargestChi2), each with the
  // weight of its point in the adjustment. Tells how large the residuals are in claimed sigmas.
  double mean_chi2 = 0;
  // The measurements' noise as the residuals show it, in claimed sigmas and in pixels: of inliers, beside the
  // field below. 0 without measurements.
  double noise_sigmas = 0, noise_px = 0;
  // Chi2 a degree of freedom, by that noise: 1 for errors of a normal distribution, more where the scene
  // moves or matches are wrong.
  double excess = 0;
  // RMS in pixels of an affine field over the first camera's image, in the residuals of the free keyframes;
  // what independent errors give by chance is taken off. Errors of patches are independent of each other,
  // those of a camera are a field. Does not depend on the number of measurements. 0 where no keyframe has
  // enough of them.
  double field_px = 0;
  // The same of further cameras' views, and how many measurements a view has: what those share.
  double further_field_px = 0, further_measurements = 0;
  // Claimed, RMS, px.
  double further_sigma_px = 0;

  // Why the map's poses cannot be called valid; no reason where they can. What held before may waver.
  [[nodiscard]] Refusal refusal(bool held_before) const;
  // Whether the map is good enough to refine the calibration from. A field does not matter here: a wrong
  // calibration leaves one, and refinement finds it out.
  [[nodiscard]] bool fits_well(bool held_before) const;
};

inline constexpr double kLargestChi2 = 20.0;

// Of a problem that evaluate_bundle has seen at its present state.
[[nodiscard]] Soundness soundness_of(const BundleProblem& problem);

}  // namespace farpoint::slam
