// SPDX-License-Identifier: Apache-2.0
// The one landmark type of every mode: a bearing in an anchor camera, inverse depth along it, and its sigma.
#pragma once

#include <cstdint>
#include <memory_resource>
#include <vector>

#include "slam/geometry/se3.h"
#include "slam/image/feature.h"
#include "slam/map/pool.h"

namespace farpoint::slam {

struct Keyframe;
struct Landmark;
using KeyframeHandle = Handle<Keyframe>;
using LandmarkHandle = Handle<Landmark>;

// bearing: a virtual map point (VMP): features linked over keyframes, no depth yet.
// weak:    has a depth, not yet confirmed by enough observations.
// full:    a map point.
enum class LandmarkState : std::uint8_t { kBearing, kWeak, kFull };

// What one camera of a keyframe saw of a landmark. The host's own sighting is one too: it defines the
// bearing, and bundle adjustment skips it.
struct Observation {
  KeyframeHandle keyframe;
  std::int32_t feature = -1;                        // index in the camera's features
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  // measured (aligned) level-0 pixel
  float sigma_px = 1.0F;                            // its error, level-0 pixels
  std::uint8_t level = 0;                           // of the corner; the map fills it in
  std::uint8_t camera = 0;                          // of the rig

  // By the same camera of the same keyframe.
  [[nodiscard]] bool is_by(KeyframeHandle observer, int observer_camera) const {
    return keyframe == observer && camera == observer_camera;
  }
};

// One camera of a keyframe.
struct Observer {
  KeyframeHandle keyframe;
  int camera = 0;
};

struct Landmark {
  std::uint64_t id = 0;
  std::int32_t map_id = 0;
  LandmarkState state = LandmarkState::kBearing;

  // Geometry. The anchor camera is rigidly attached to the host keyframe's body. At first it is the camera
  // that saw the landmark. When the host is removed, the anchor stays in place and is attached to the next
  // host: bearing, depth and patch stay valid. Point in host-body axes: (R_host_anchor f + rho t_host_anchor)
  // / rho.
  KeyframeHandle host;
  SE3 T_host_anchor;
  Eigen::Vector3d bearing = Eigen::Vector3d::UnitZ();  // f, unit, anchor axes
  Eigen::Matrix<double, 3, 2> d_bearing_d_pixel = Eigen::Matrix<double, 3, 2>::Zero();  // at the host pixel
  Eigen::Vector2d host_pixel = Eigen::Vector2d::Zero();  // level-0 pixel of the anchor camera
  int host_camera = 0;
  std::int64_t anchor_utime = 0;  // of the frame that host_pixel was seen in
  double inverse_depth = 0;       // rho >= 0, 1 / distance along f, 1 / map units
  double inverse_depth_sigma = 0;
  double max_parallax_rad = 0;       // largest angle between the anchor's ray and an observation's
  KeyframeHandle parallax_keyframe;  // the observation that gives it: keyframe and camera
  std::uint8_t parallax_camera = 0;

  Patch patch;
  Descriptor descriptor;
  std::uint8_t host_level = 0;
  // By ascending keyframe id, then camera; in the memory of its map.
  std::pmr::vector<Observation> observations;

  // Statistics for culling and reports.
  std::uint64_t created_keyframe = 0;  // id of the keyframe at which it was made (bearing) or promoted
  std::int64_t created_utime = 0;      // of that keyframe
  std::uint64_t last_seen_keyframe = 0;
  std::uint32_t visible = 1, found = 1;  // frames in which it should have been, and was, seen
  std::uint8_t failures = 0;             // failed promotions
  bool through_vmp = false;
  double creation_depth = 0;
  double creation_relative_sigma = 0;
};

}  // namespace farpoint::slam
