// SPDX-License-Identifier: Apache-2.0
#include "ipc/reason.h"

#include <fmt/format.h>

#include <algorithm>

#include <cmath>

namespace farpoint::ipc {

namespace {

constexpr double kPercent = 100.0;

struct Sentence {
  const char* with_numbers;  // value, wanted; null: none
  const char* plain;
  double factor = 1.0;  // of both numbers
};

Sentence sentence_of(Reason reason) {
  switch (reason) {
    case Reason::kNoImageYet:
      return {nullptr, "no image yet"};
    case Reason::kNoCamera:
      return {nullptr, "no camera: none answers, or it is silent"};
    case Reason::kNoPoseInTime:
      return {nullptr, "no pose in time"};
    case Reason::kMapNotStarted:
      return {nullptr, "map not started"};
    case Reason::kMapSettling:
      return {"the young map's unit changes: {:.1f} % by the last adjustment, {:.1f} % allowed",
              "the young map's unit is not known to hold yet", kPercent};
    case Reason::kTrackingLost:
      return {"tracking lost: {:.0f} landmarks found, {:.0f} needed", "tracking lost"};
    case Reason::kPlaceNotRecognised:
      return {nullptr, "place not recognised yet"};
    case Reason::kFewLandmarks:
      return {"few landmarks of known depth: {:.0f}, {:.0f} needed", "few landmarks"};
    case Reason::kCalibrationContradicted:
      return {
          nullptr,
          "the images contradict the calibration (another camera, focus or resolution?): no pose is valid"};
    case Reason::kNumberOutOfRange:
      return {nullptr, "a number of the pose is not finite"};
    case Reason::kStopped:
      return {nullptr, "stopped"};
    case Reason::kViewBlocked:
      return {
          "{:.0f} % of the features move with the camera, {:.0f} % allowed: bonnet or rotor? see camera.mask",
          "a part of the image moves with the camera", kPercent};
    case Reason::kTooDark:
      return {"too dark, blurred or empty: {:.0f} features, {:.0f} needed", "too dark, blurred or empty"};
    case Reason::kFewMatches:
      return {"few matches with the first view: {:.0f}, {:.0f} needed", "few matches with the first view"};
    case Reason::kStanding:
      return {nullptr, "waiting for motion: the camera stands"};
    case Reason::kTurningOnly:
      return {nullptr, "turning without moving: a map needs sideways motion"};
    case Reason::kLittleParallax:
      return {"waiting for sideways motion: {:.4f} of {:.4f} rad", "waiting for sideways motion"};
    case Reason::kAmbiguousStart:
      return {nullptr,
              "the first motion is ambiguous: one plane fills the image, or the camera hardly moved"};
    case Reason::kNoCommonMotion:
      return {"no motion explains the matches: {:.0f} % agree, {:.0f} % needed",
              "no motion explains the matches", kPercent};
    case Reason::kResidualField:
      return {"a residual field of {:.2f} px, {:.2f} allowed: rolling shutter or lens", "a residual field"};
    case Reason::kMovingScene:
      return {"residuals {:.1f} times the noise, {:.1f} allowed: the scene moves, or matches are wrong",
              "residuals beyond the noise"};
    case Reason::kLargeResiduals:
      return {"residuals of {:.1f} px, {:.1f} allowed: blur, or a wrong lens model", "large residuals"};
    case Reason::kUnsoundBefore:
      return {"the map was unsound before: sound for {:.1f} of {:.1f} s", "the map was unsound before"};
    case Reason::kLandmarksDisagree:
      return {"landmarks disagree: {:.0f} % agree with the pose, {:.0f} % needed: something large moves?",
              "landmarks disagree", kPercent};
    case Reason::kFrozenImage:
      return {"{:.0f} % of the features repeat those of the image before: a frozen image",
              "the image repeats the one before: a frozen stream", kPercent};
    case Reason::kNone:
    case Reason::kNotAvailable:
      break;
  }
  return {nullptr, ""};
}

}  // namespace

std::string_view reason_text(Reason reason, double value, double wanted, std::span<char> buffer) {
  const Sentence s = sentence_of(reason);
  if (s.with_numbers == nullptr || !std::isfinite(value)) return s.plain;
  const auto end = fmt::format_to_n(buffer.data(), buffer.size(), fmt::runtime(s.with_numbers),
                                    s.factor * value, s.factor * wanted);
  return {buffer.data(), std::min(end.size, buffer.size())};
}

}  // namespace farpoint::ipc
