// SPDX-License-Identifier: Apache-2.0
// What reports, pictures and statistics read of the maps. Reads only, and copies what it gives.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

#include "slam/geometry/se3.h"

namespace farpoint::slam {

class BackEnd;

struct PosedFrame {
  std::int64_t utime = 0;
  SE3 T_map_body;
};

// One map's frames, posed through their reference keyframes after the last optimisation, ascending in time.
struct MapTrajectory {
  std::int32_t map_id = 0;
  std::vector<PosedFrame> frames;
};

// One landmark for statistics and pictures.
struct LandmarkInfo {
  std::uint64_t id = 0;
  std::int32_t map_id = 0;
  Eigen::Vector3d position_map = Eigen::Vector3d::Zero();  // map units
  double inverse_depth = 0, inverse_depth_sigma = 0;       // 1/map units, at the host
  double creation_depth = 0;  // distance from the newest observing keyframe when it was made, map units
  double creation_relative_sigma = 0;  // sigma(depth)/depth then
  bool through_vmp = false;
  bool full = false;  // else bearing or weak
  int observations = 0;
  // Where its bearing comes from: the first frame that saw it, the pixel there, and that camera's centre.
  std::int64_t anchor_utime = 0;
  int anchor_camera = 0;
  Eigen::Vector2d anchor_pixel = Eigen::Vector2d::Zero();
  Eigen::Vector3d anchor_map = Eigen::Vector3d::Zero();  // map units
  std::int64_t created_utime = 0;  // of the keyframe at which it became a point; bearings: when it was made
  std::uint32_t slot = 0, generation = 0;  // its handle in the map (Inspection::sightings)
};

// Where a keyframe saw a landmark.
struct LandmarkSighting {
  std::int64_t utime = 0;
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  // level-0 pixel
};

// Camera 0's calibration as refined from the map, relative to the given one; zero where refinement is off.
struct CalibrationInfo {
  double focal_scale = 0, cx_px = 0, cy_px = 0, k1 = 0;  // focal_scale: log of the factor
  double focal_scale_sigma = 0, cx_sigma_px = 0, cy_sigma_px = 0, k1_sigma = 0;  // 1 sigma
  bool contradicted = false;
  double focal_scale_of_images = 0;  // by the images alone, without the given calibration as a prior
};

// Valid while its estimator lives. Belongs to mapping's thread, or to any thread while none maps.
class Inspection {
 public:
  explicit Inspection(const BackEnd& back_end) : back_end_(back_end) {}

  // All maps, the one with most frames first. Empty without capacity.whole_trajectory.
  [[nodiscard]] std::vector<MapTrajectory> trajectories() const;
  // Alive, of all maps.
  [[nodiscard]] std::vector<LandmarkInfo> landmarks() const;
  // By ascending keyframe; empty where the landmark is no longer alive.
  [[nodiscard]] std::vector<LandmarkSighting> sightings(const LandmarkInfo& landmark) const;
  // Calls visit(map, distance) for every observation of full and weak landmarks. Distance from camera to
  // point, map units.
  void visit_observation_distances(
      const std::function<void(std::int32_t map_id, double distance)>& visit) const;
  // T_map_body of all maps, oldest first.
  [[nodiscard]] std::vector<SE3> keyframe_poses() const;
  [[nodiscard]] CalibrationInfo calibration() const;

 private:
  const BackEnd& back_end_;
};

}  // namespace farpoint::slam
