// SPDX-License-Identifier: Apache-2.0
// Why a frame has no valid pose.
#pragma once

#include <cstdint>
#include <limits>

namespace farpoint::slam {

// Published: a number keeps its meaning. `value` and `wanted` of Refusal stand in brackets.
enum class Reason : std::uint8_t {
  kNone = 0,
  kNoImageYet = 1,
  kNoCamera = 2,
  kTooDark = 3,         // (features found, features needed): dark, blurred or empty
  kFewMatches = 4,      // with the first view of a map to be (matches found, matches needed)
  kStanding = 5,        // no motion since that view (rad, rad)
  kTurningOnly = 6,     // a rotation explains all matches (rad turned, -)
  kLittleParallax = 7,  // of a quarter of the matches (rad, rad)
  kAmbiguousStart = 8,  // a plane, or a direction of motion that is hardly fixed
  kNoCommonMotion = 9,  // no motion explains enough matches (share, share)
  kUnitUnsteady = 10,   // of the young map (change by the last adjustment, largest change)
  kField = 11,          // in the residuals: rolling shutter or lens (px, px)
  kExcess = 12,         // residuals beyond the noise: moving scene, wrong matches (chi2 a degree, most)
  kNoise = 13,          // residuals as a whole (px, px)
  kCalibrationContradicted = 14,  // (change of the focal length that the images ask for, -)
  kSoundAgain = 15,               // the map was unsound before (s, s)
  kDisagreement = 16,             // of the matched landmarks (share of inliers, least share)
  kFewLandmarks = 17,             // with known depth (number, number)
  kMovesWithCamera = 18,          // a part of the image: bonnet, rotor (share of features, largest share)
  kFrozenImage = 19,              // equal to the one before
  kLost = 20,
  kPlaceNotRecognised = 21,
};

struct Refusal {
  Reason reason = Reason::kNone;
  double value = std::numeric_limits<double>::quiet_NaN();
  double wanted = std::numeric_limits<double>::quiet_NaN();
};

}  // namespace farpoint::slam
