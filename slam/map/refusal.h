// SPDX-License-Identifier: Apache-2.0
// Why a frame has no valid pose.
#pragma once

#include <cstdint>
#include <limits>

namespace farpoint::slam {

// In brackets: `value` and `wanted` of Refusal.
enum class Reason : std::uint8_t {
  kNone,
  kTooDark,                  // (features found, features needed): dark, blurred or empty
  kFewMatches,               // with the first view of a map to be (matches found, matches needed)
  kStanding,                 // no motion since that view (rad, rad)
  kTurningOnly,              // a rotation explains all matches (rad turned, -)
  kLittleParallax,           // of a quarter of the matches (rad, rad)
  kAmbiguousStart,           // a plane, or a direction of motion that is hardly fixed
  kNoCommonMotion,           // no motion explains enough matches (share, share)
  kUnitUnsteady,             // of the young map (change by the last adjustment, largest change)
  kField,                    // in the residuals: rolling shutter or lens (px, px)
  kExcess,                   // residuals beyond the noise: moving scene, wrong matches (chi2 a degree, most)
  kNoise,                    // residuals as a whole (px, px)
  kCalibrationContradicted,  // (change of the focal length that the images ask for, -)
  kSoundAgain,               // the map was unsound before (s, s)
  kDisagreement,             // of the matched landmarks (share of inliers, least share)
  kFewLandmarks,             // with known depth (number, number)
  kMovesWithCamera,          // a part of the image: bonnet, rotor (share of features, largest share)
  kFrozenImage,              // equal to the one before
  kLost,
  kPlaceNotRecognised,
};

struct Refusal {
  Reason reason = Reason::kNone;
  double value = std::numeric_limits<double>::quiet_NaN();
  double wanted = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace farpoint::slam
