// SPDX-License-Identifier: Apache-2.0
// The stages of a frame's way, announced to a listener. The estimator has no clock: the listener notes the
// time.
#pragma once

#include <cstdint>

namespace farpoint::slam {

enum class Stage : std::uint8_t {
  kTracking,    // image to pose: all that the tracking thread does with a frame, keyframe hand-over included
  kPyramid,     // of tracking
  kExtraction,  // of tracking: corners and descriptors
  kMatching,    // of tracking: local view projected, features found
  kAlignment,   // of tracking: patches aligned to a fraction of a pixel
  kPose,        // of tracking
  kKeyframe,    // of tracking: decision and hand-over
  kMapping,     // all that the mapping thread does with a keyframe
  kTriangulation,  // of mapping: virtual map points and points
  kFusing,         // of mapping: duplicates
  kLocalBa,        // of mapping
  kCalibration,    // of mapping: the camera refined from the map
  kCulling,        // of mapping
};

class StageListener {
 public:
  virtual ~StageListener() = default;
  // Stages nest, and may run several times in a frame. Called on the hot path: must neither wait nor
  // allocate.
  virtual void begin(Stage stage) = 0;
  virtual void end(Stage stage) = 0;
};

// A stage for the lifetime of the object. The listener may be null.
class StageSpan {
 public:
  StageSpan(StageListener* listener, Stage stage) : listener_(listener), stage_(stage) {
    if (listener_ != nullptr) listener_->begin(stage_);
  }
  ~StageSpan() {
    if (listener_ != nullptr) listener_->end(stage_);
  }
  StageSpan(const StageSpan&) = delete;
  StageSpan& operator=(const StageSpan&) = delete;

 private:
  StageListener* listener_;
  Stage stage_;
};

// Suspends a running stage for the lifetime of the object: lockstep does another thread's work in it.
class StagePause {
 public:
  StagePause(StageListener* listener, Stage stage) : listener_(listener), stage_(stage) {
    if (listener_ != nullptr) listener_->end(stage_);
  }
  ~StagePause() {
    if (listener_ != nullptr) listener_->begin(stage_);
  }
  StagePause(const StagePause&) = delete;
  StagePause& operator=(const StagePause&) = delete;

 private:
  StageListener* listener_;
  Stage stage_;
};

}  // namespace farpoint::slam
