// SPDX-License-Identifier: Apache-2.0
// Where a frame's outcome goes: one interface, whether it is a network, a bus or a file.
#pragma once

#include "slam/frame_result.h"

namespace farpoint::daemon {

// What is published of one frame. Lengths are in metres where result.scale is assumed or metric, in map units
// where it is unknown.
struct FrameOutput {
  slam::FrameResult result;
  // The pose counts: published as valid, part of the live trajectory.
  bool valid = false;
  // From when the frame was due to its output; 0 in lockstep, which has no clock.
  std::int64_t age_us = 0;
  // Steady clock: when it was of that age. What takes time between then and its sending must not make it
  // younger. 0: there is no common clock.
  double age_at_s = 0;
  bool calibration_contradicted = false;  // by the images: no pose is valid
  std::int32_t boot_counter = 0;          // of this start of the daemon; 0 in replay
};

// The estimator's result with scale.assumed applied (0: none) and its validity decided. A result that is
// marked valid but holds a number that is not finite is taken for invalid: nothing wrong goes out as valid.
// `lever_m`: the estimator's body in the body's axes, from the body's origin; a map of unknown unit cannot
// hold it, so that the estimator's body stands at the camera. With the assumed scale the result is the
// body's.
[[nodiscard]] FrameOutput make_frame_output(const slam::FrameResult& result, double assumed_scale,
                                            const Eigen::Vector3d& lever_m = Eigen::Vector3d::Zero());

// Receives every frame in order. Errors of the outside (no route, bus off) are counted, never thrown.
class PoseSink {
 public:
  virtual ~PoseSink() = default;
  virtual void on_frame(const FrameOutput& frame) = 0;
};

}  // namespace farpoint::daemon
