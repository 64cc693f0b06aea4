// SPDX-License-Identifier: Apache-2.0
// Why no pose is valid: a code, the same on CAN (signal Reason) and LCM (status_t::reason), and its sentence.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace farpoint::ipc {

// 12 to 15 are reserved.
enum class Reason : std::uint8_t {
  kNone = 0,
  kNoImageYet = 1,
  kNoCamera = 2,
  kNoPoseInTime = 3,
  kMapNotStarted = 4,
  kMapSettling = 5,  // the young map's unit changes
  kTrackingLost = 6,
  kPlaceNotRecognised = 7,
  kFewLandmarks = 8,
  kCalibrationContradicted = 9,
  kNumberOutOfRange = 10,
  kStopped = 11,
  kViewBlocked = 16,  // a part of the image moves with the camera
  kTooDark = 17,
  kFewMatches = 18,
  kStanding = 19,
  kTurningOnly = 20,
  kLittleParallax = 21,
  kAmbiguousStart = 22,
  kNoCommonMotion = 23,
  kResidualField = 24,
  kMovingScene = 25,
  kLargeResiduals = 26,
  kUnsoundBefore = 27,
  kLandmarksDisagree = 28,
  kFrozenImage = 29,
  kNotAvailable = 31,
};

// Codes are below.
inline constexpr std::size_t kReasons = 32;
// Longest sentence, bytes.
inline constexpr std::size_t kReasonText = 160;

// Writes the sentence into `buffer`, which holds kReasonText bytes; empty for kNone. `value`, `wanted`: what
// was measured and what is needed or allowed, units as the sentence says; NaN where there is none. No heap.
[[nodiscard]] std::string_view reason_text(Reason reason, double value, double wanted,
                                           std::span<char> buffer);

}  // namespace farpoint::ipc
