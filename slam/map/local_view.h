// SPDX-License-Identifier: Apache-2.0
// What tracking sees of the map: an immutable copy of the landmarks around the vehicle, made by mapping and
// handed over whole. Everything the tracker needs of a landmark is here, in world axes, so that it never
// touches the map.
#pragma once

#include <memory>
#include <vector>

#include "slam/config.h"
#include "slam/map/landmark.h"
#include "slam/map/map_judgement.h"

namespace farpoint::slam {

struct ViewLandmark {
  LandmarkHandle handle;
  Eigen::Vector4d point_w = Eigen::Vector4d::Zero();   // homogeneous: xyz / rho
  Eigen::Vector3d anchor_w = Eigen::Vector3d::Zero();  // centre of the anchor camera
  Eigen::Matrix<double, 3, 2> d_point_d_pixel = Eigen::Matrix<double, 3, 2>::Zero();  // of xyz, world axes
  double inverse_depth_sigma = 0;
  Descriptor descriptor;
  Patch patch;
  std::uint8_t host_level = 0;
  bool in_reference = false;  // seen by the reference keyframe
  bool confirmed = false;     // state full
  float found_share = 0;      // of the frames in which it projected into the image, those that found it
  double nearness = 0;        // in_reference: 1 / distance from the reference's camera, 1 / map units
};

// Two views of one map hold the correction of a keyframe between them, a similarity:
// S_world_body of the newer one * inverse of that of the older one.
struct ViewKeyframe {
  std::uint64_t id = 0;
  SE3 T_world_body;
  double scale = 1.0;  // Keyframe::scale
};

struct LocalView {
  std::uint64_t sequence = 0;
  std::int32_t map_id = 0;
  Rig rig;                         // with the calibration as refined so far
  std::uint64_t reference_id = 0;  // newest keyframe
  SE3 T_world_reference;
  double reference_scale = 1.0;         // Keyframe::scale of the reference
  std::vector<ViewKeyframe> keyframes;  // the window, for re-expressing older poses
  std::vector<ViewLandmark> landmarks;
  int reference_landmarks = 0;    // full landmarks in the reference keyframe
  double reference_nearness = 0;  // theirs in sum
  int map_keyframes = 0;          // alive in this map
  double median_depth = 1.0;      // of the reference keyframe's landmarks, map units
  MapJudgement judgement;

  // Keyframe::S_world_body of the reference.
  [[nodiscard]] Sim3 S_world_reference() const {
    return {reference_scale, T_world_reference.q, T_world_reference.t};
  }
};

}  // namespace farpoint::slam
