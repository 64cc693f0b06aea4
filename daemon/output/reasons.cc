// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/reasons.h"

namespace farpoint::daemon {

namespace {

ipc::Reason by_state(slam::State state) {
  switch (state) {
    case slam::State::kStarting:
      return ipc::Reason::kNoImageYet;
    case slam::State::kInitialising:
      return ipc::Reason::kMapNotStarted;
    case slam::State::kSettling:
      return ipc::Reason::kMapSettling;
    case slam::State::kTracking:
      return ipc::Reason::kNone;
    case slam::State::kDegraded:
      return ipc::Reason::kFewLandmarks;
    case slam::State::kLost:
      return ipc::Reason::kTrackingLost;
    case slam::State::kRelocalising:
      return ipc::Reason::kPlaceNotRecognised;
    case slam::State::kNoCamera:
      return ipc::Reason::kNoCamera;
  }
  return ipc::Reason::kNotAvailable;
}

}  // namespace

ipc::Reason published(slam::Reason reason) {
  switch (reason) {
    case slam::Reason::kNone:
      return ipc::Reason::kNone;
    case slam::Reason::kTooDark:
      return ipc::Reason::kTooDark;
    case slam::Reason::kFewMatches:
      return ipc::Reason::kFewMatches;
    case slam::Reason::kStanding:
      return ipc::Reason::kStanding;
    case slam::Reason::kTurningOnly:
      return ipc::Reason::kTurningOnly;
    case slam::Reason::kLittleParallax:
      return ipc::Reason::kLittleParallax;
    case slam::Reason::kAmbiguousStart:
      return ipc::Reason::kAmbiguousStart;
    case slam::Reason::kNoCommonMotion:
      return ipc::Reason::kNoCommonMotion;
    case slam::Reason::kUnitUnsteady:
      return ipc::Reason::kMapSettling;
    case slam::Reason::kField:
      return ipc::Reason::kResidualField;
    case slam::Reason::kExcess:
      return ipc::Reason::kMovingScene;
    case slam::Reason::kNoise:
      return ipc::Reason::kLargeResiduals;
    case slam::Reason::kCalibrationContradicted:
      return ipc::Reason::kCalibrationContradicted;
    case slam::Reason::kSoundAgain:
      return ipc::Reason::kUnsoundBefore;
    case slam::Reason::kDisagreement:
      return ipc::Reason::kLandmarksDisagree;
    case slam::Reason::kFewLandmarks:
      return ipc::Reason::kFewLandmarks;
    case slam::Reason::kMovesWithCamera:
      return ipc::Reason::kViewBlocked;
    case slam::Reason::kFrozenImage:
      return ipc::Reason::kFrozenImage;
    case slam::Reason::kLost:
      return ipc::Reason::kTrackingLost;
    case slam::Reason::kPlaceNotRecognised:
      return ipc::Reason::kPlaceNotRecognised;
  }
  return ipc::Reason::kNotAvailable;
}

ipc::Reason reason_of(const slam::FrameResult& result) {
  const ipc::Reason reason = published(result.refusal.reason);
  return reason == ipc::Reason::kNone ? by_state(result.state) : reason;
}

}  // namespace farpoint::daemon
