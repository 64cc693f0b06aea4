// SPDX-License-Identifier: Apache-2.0
// The faces that may be seen in one frame, gathered once for all its passes.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "slam/geometry/se3.h"
#include "tools/simulate/render/ray_table.h"
#include "tools/simulate/world/scene.h"

namespace farpoint::tools::simulate {

// Cone-like bounds of what a camera sees over an exposure.
struct ViewBounds {
  Eigen::Vector3f axis_w;    // viewing direction, world axes
  float half_angle_rad = 0;  // of a cone that holds the whole image, with a margin for motion
  float focal_px = 1;
  // Planes through the camera that hold the image between them; empty for very wide lenses. Inward normals.
  std::vector<Eigen::Vector3f> planes_w;
};

[[nodiscard]] ViewBounds make_view_bounds(const RayTable& rays, const slam::SE3& T_world_camera,
                                          double focal_px, double margin_rad);

struct VisibleFace {
  const Face* face = nullptr;
  Eigen::Vector3f offset;  // chunk's origin from the camera's reference position, world axes
  float sway_m = 0, sway_phase = 0;
  const Chunk* chunk = nullptr;  // nothing for moving objects
};

// Consecutive faces that lie within a sphere.
struct VisibleGroup {
  std::size_t first = 0, last = 0;  // faces, last not included
  Eigen::Vector3f centre;           // from the camera's reference position, world axes
  float radius_m = 0;
};

class VisibleFaces {
 public:
  // Static faces around the camera's place, and moving objects as they stand at `time_s`.
  void gather(const Scene& scene, const ViewBounds& bounds, const Eigen::Vector3d& camera_position,
              double time_s);
  // Puts the moving objects where they are at `time_s`.
  void move_objects(const Scene& scene, double time_s);

  [[nodiscard]] const std::vector<VisibleFace>& faces() const { return faces_; }
  // The faces that do not move, nearest group first.
  [[nodiscard]] const std::vector<VisibleGroup>& groups() const { return groups_; }
  // From here on they belong to moving objects.
  [[nodiscard]] std::size_t first_moving() const { return first_moving_; }
  [[nodiscard]] const Eigen::Vector3d& reference() const { return reference_; }

 private:
  struct VisibleCluster {
    float distance_m;
    std::uint32_t order;  // as gathered: clusters at the same distance keep it
    const Chunk* chunk;
    const Cluster* cluster;
  };
  void gather_cluster(const Chunk& chunk, const Cluster& cluster, const Eigen::Vector3f& offset);

  std::vector<VisibleCluster> clusters_;

  std::vector<VisibleFace> faces_;
  std::vector<VisibleGroup> groups_;
  std::size_t first_moving_ = 0;
  Eigen::Vector3d reference_ = Eigen::Vector3d::Zero();
  std::vector<MovingObject> objects_;
  std::vector<Face> moved_faces_;
};

}  // namespace farpoint::tools::simulate
