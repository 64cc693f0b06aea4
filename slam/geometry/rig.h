// SPDX-License-Identifier: Apache-2.0
// The cameras on the body and where each of them stands.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/geometry/image_mask.h"
#include "slam/geometry/se3.h"

namespace farpoint::slam {

// One camera on the body. T_body_camera maps camera coordinates into the body's.
struct RigCamera {
  std::string name;
  Camera camera;
  SE3 T_body_camera;
  std::shared_ptr<const ImageMask> mask = nullptr;  // of the camera's size; null: every pixel shows the world

  // Whether the square of half side `radius_px` around a pixel reaches into the mask.
  [[nodiscard]] bool is_masked(const Eigen::Vector2d& pixel, double radius_px) const {
    return mask != nullptr && mask->touches(pixel, radius_px);
  }
};

// Rotation of an upright camera that looks along the body's x axis (body axes: x forward, y left, z up).
[[nodiscard]] inline Eigen::Quaterniond q_body_forward_camera() {
  Eigen::Matrix3d R_body_camera;
  R_body_camera << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return Eigen::Quaterniond(R_body_camera);
}

// All cameras of one body.
struct Rig {
  std::vector<RigCamera> cameras;
};

// The rig with its body moved to the centre of camera `index`; the body's axes stay. For maps of unknown
// scale: the lever arm between body and camera is in metres, which such a map cannot express in its units.
// What is published as the body is then this camera's centre. A metric map keeps the rig as it is.
[[nodiscard]] inline Rig with_body_at_camera(Rig rig, std::size_t index) {
  const Eigen::Vector3d centre = rig.cameras[index].T_body_camera.t;
  for (RigCamera& c : rig.cameras) c.T_body_camera.t -= centre;
  return rig;
}

}  // namespace farpoint::slam
