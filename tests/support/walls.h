// SPDX-License-Identifier: Apache-2.0
// Textured walls before two cameras: images whose depths and matches are known exactly.
#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "slam/geometry/camera.h"
#include "slam/geometry/se3.h"
#include "tests/image/test_images.h"

namespace farpoint::slam::testing {

// Two walls with a step between them, seen from around the origin along z.
class Walls {
 public:
  explicit Walls(double shortest_wave) : near_(11, shortest_wave, 40), far_(12, shortest_wave, 40) {}

  // The first wall that a ray from `centre` meets, and its brightness there.
  struct Hit {
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    double grey = 0;
    int wall = 0;
  };
  [[nodiscard]] Hit look(const Eigen::Vector3d& centre, const Eigen::Vector3d& ray) const {
    Hit near = meet(centre, ray, kNearNormal, kNearOffset, 1);
    if (near.wall != 0 && near.point.x() < kEdge) return near;
    return meet(centre, ray, kFarNormal, kFarOffset, 2);
  }

 private:
  // n . x = offset
  static inline const Eigen::Vector3d kNearNormal{0.25, 0.1, 1.0}, kFarNormal{-0.2, 0.15, 1.0};
  static constexpr double kNearOffset = 5.0, kFarOffset = 14.0, kEdge = -0.3;

  [[nodiscard]] Hit meet(const Eigen::Vector3d& centre, const Eigen::Vector3d& ray,
                         const Eigen::Vector3d& normal, double offset, int wall) const {
    const double along = normal.dot(ray);
    if (!(along > 1e-6)) return {};
    const Eigen::Vector3d point = centre + (offset - normal.dot(centre)) / along * ray;
    const Texture& texture = wall == 1 ? near_ : far_;
    // Brightness by angle from the origin: waves of a few pixels on both walls.
    constexpr double kTexels = 420;
    const double x = kTexels * point.x() / point.z(), y = kTexels * point.y() / point.z();
    return {point, texture(x, y), wall};
  }

  Texture near_, far_;
};

struct CameraPair {
  Camera host, target;
  SE3 T_target_host;
};

inline OwnedImage photograph(const Walls& walls, const Camera& camera, const SE3& T_host_camera,
                             std::uint64_t seed) {
  constexpr double kNoise = 1.5;
  return render(
      camera.width_px(), camera.height_px(),
      [&](double x, double y) {
        Eigen::Vector3d bearing;
        if (!camera.unproject({x, y}, &bearing)) return 0.0;
        return walls.look(T_host_camera.t, T_host_camera.q * bearing).grey;
      },
      kNoise, seed);
}

// Not rectified: other focal lengths, sizes and models, turned by degrees about every axis.
inline CameraPair crooked_pair() {
  Camera::Parameters host;
  host.width_px = 480, host.height_px = 360;
  host.fx_px = host.fy_px = 400, host.cx_px = 236, host.cy_px = 183;
  host.distortion = {-0.12, 0.02, 0.0005, -0.0003, 0};
  Camera::Parameters target = host;
  target.model = CameraModel::kKannalaBrandt;
  target.width_px = 520, target.height_px = 400;
  target.fx_px = 330, target.fy_px = 335, target.cx_px = 262, target.cy_px = 195;
  target.distortion = {0.01, -0.002, 0, 0, 0};
  return {Camera(host), Camera(target), {so3_exp({0.04, -0.06, 0.12}), {-0.4, 0.05, 0.03}}};
}

inline CameraPair rectified_pair() {
  Camera::Parameters p;
  p.width_px = 480, p.height_px = 360;
  p.fx_px = p.fy_px = 400, p.cx_px = 240, p.cy_px = 180;
  return {Camera(p), Camera(p), {Eigen::Quaterniond::Identity(), {-0.4, 0, 0}}};
}

}  // namespace farpoint::slam::testing
