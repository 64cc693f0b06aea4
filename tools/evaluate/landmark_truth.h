// SPDX-License-Identifier: Apache-2.0
// Judges the landmarks of a run by the world of a simulated recording. The recording's SIMULATION message
// makes that world again; a ray through the pixel that first saw a landmark gives its true distance.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "ipc/message.h"
#include "tools/evaluate/accuracy.h"
#include "tools/simulate/simulation.h"

namespace farpoint::tools {

// Content of the pixel that a landmark's bearing comes from.
enum class LandmarkTarget {
  kSurface,
  kSky,      // clouds: no depth at all
  kMoving,   // a car: depth, but no place
  kOutline,  // near and far surfaces meet within two pixels; ambiguous
};

struct JudgedLandmark {
  LandmarkTarget target = LandmarkTarget::kSurface;
  bool through_vmp = false;
  double true_distance_m = 0.0;   // from the camera that first saw it; of an outline: the nearer surface
  double distance_m = 0.0;        // estimated, in metres by the scale of the stretch where it was seen
  double relative_sigma = 0.0;    // claimed: of inverse distance, as a share of it
  double sigmas = 0.0;            // error of inverse distance in claimed sigmas
  double position_error_m = 0.0;  // in the world, after the run's alignment; drift of the path is in it
  // From its first kept sighting to the keyframe at which it became a point.
  double wait_s = 0.0, wait_m = 0.0;
  double parallax_rad = 0.0;  // true angle between those two rays
  double born_at_m = 0.0;     // true distance then
};

struct JudgedLandmarks {
  std::vector<JudgedLandmark> landmarks;
  std::size_t refused = 0;  // camera, pixel or time outside the recording, or a number that is not finite
};

// Keeps the world and the rays already cast.
class SimulatedWorld {
 public:
  // Throws InputError if the message's world cannot be made again.
  explicit SimulatedWorld(const simulation_t& message);

  // Judges the landmarks of one map, frame by frame. `pairs`: truth and estimate at the same point of the
  // vehicle; `map_to_world` is the run's alignment.
  [[nodiscard]] JudgedLandmarks judge(const landmarks_t& landmarks, std::int32_t map_id,
                                      const std::vector<PosePair>& pairs, const MapToWorld& map_to_world);

 private:
  [[nodiscard]] bool is_of_recording(const landmark_t& landmark) const;
  [[nodiscard]] bool is_during_recording(std::int64_t utime) const;
  [[nodiscard]] JudgedLandmark judge_one(const landmark_t& landmark, const simulate::SeenPoint& seen,
                                         double scale, const MapToWorld& map_to_world) const;
  void judge_place(const landmark_t& landmark, const MapToWorld& map_to_world, JudgedLandmark* judged) const;

  simulate::Simulation simulation_;
};

// Metres a map unit around a time: aligned over three seconds before and after it, where the vehicle moved
// enough; else `fallback`.
[[nodiscard]] double local_scale(const std::vector<PosePair>& pairs, double time_s, double fallback);

}  // namespace farpoint::tools
