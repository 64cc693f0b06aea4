// SPDX-License-Identifier: Apache-2.0
#include "tools/simulate/render/visible_faces.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace farpoint::tools::simulate {
namespace {

// A cluster that covers less than this is left out: its light would be lost among its surroundings.
constexpr float kMinClusterRadius_px = 0.35F;
// A face counts as turned away only beyond this: between passes the camera moves.
constexpr float kBackFaceMargin_m = 0.3F;

bool outside(const ViewBounds& bounds, const Eigen::Vector3f& centre, float radius) {
  for (const Eigen::Vector3f& plane : bounds.planes_w) {
    if (plane.dot(centre) < -radius) return true;
  }
  if (!bounds.planes_w.empty()) return false;
  const float distance = centre.norm();
  if (distance <= radius) return false;
  const float angle = std::acos(std::clamp(bounds.axis_w.dot(centre) / distance, -1.0F, 1.0F));
  return angle - std::asin(std::min(1.0F, radius / distance)) > bounds.half_angle_rad;
}

}  // namespace

ViewBounds make_view_bounds(const RayTable& rays, const slam::SE3& T_world_camera, double focal_px,
                            double margin_rad) {
  const Eigen::Matrix3f R = T_world_camera.rotation().cast<float>();
  ViewBounds bounds;
  bounds.focal_px = static_cast<float>(focal_px);
  bounds.axis_w = R.col(2);
  if (rays.views.size() > 1) {
    float min_z = 1.0F;
    for (std::size_t i = 0; i < rays.cell.size(); i += 7) min_z = std::min(min_z, rays.z[i]);
    bounds.half_angle_rad = std::acos(min_z) + static_cast<float>(margin_rad) + 0.02F;
    return bounds;
  }
  const RasterView& view = rays.views[0];
  const float margin = static_cast<float>(std::tan(margin_rad)) + 0.003F;
  const float left = view.centre_x / view.focal_x + margin;
  const float right = (static_cast<float>(view.width) - view.centre_x) / view.focal_x + margin;
  const float up = view.centre_y / view.focal_y + margin;
  const float down = (static_cast<float>(view.height) - view.centre_y) / view.focal_y + margin;
  for (const Eigen::Vector3f& plane : {Eigen::Vector3f(1, 0, left), Eigen::Vector3f(-1, 0, right),
                                       Eigen::Vector3f(0, 1, up), Eigen::Vector3f(0, -1, down)}) {
    bounds.planes_w.push_back(R * plane.normalized());
  }
  return bounds;
}

void VisibleFaces::gather_cluster(const Chunk& chunk, const Cluster& cluster, const Eigen::Vector3f& offset) {
  const std::size_t first = faces_.size();
  for (std::uint32_t i = cluster.first; i < cluster.first + cluster.count; ++i) {
    const Face& face = chunk.mesh.faces[i];
    const float in_front = -face.normal.dot(face.corners[0] + offset);
    if (!face.two_sided && in_front < -kBackFaceMargin_m) continue;
    faces_.push_back({&face, offset, cluster.sway_m, cluster.sway_phase, &chunk});
  }
  if (faces_.size() > first)
    groups_.push_back({first, faces_.size(), cluster.centre + offset, cluster.radius_m});
}

void VisibleFaces::gather(const Scene& scene, const ViewBounds& bounds,
                          const Eigen::Vector3d& camera_position, double time_s) {
  faces_.clear();
  groups_.clear();
  clusters_.clear();
  reference_ = camera_position;
  for (const Chunk* chunk : scene.chunks) {
    const Eigen::Vector3f offset = (chunk->origin - camera_position).cast<float>();
    for (const Cluster& cluster : chunk->mesh.clusters) {
      const Eigen::Vector3f centre = cluster.centre + offset;
      const float distance = centre.norm();
      if (cluster.radius_m * bounds.focal_px < kMinClusterRadius_px * distance) continue;
      if (outside(bounds, centre, cluster.radius_m)) continue;
      clusters_.push_back(
          {distance - cluster.radius_m, static_cast<std::uint32_t>(clusters_.size()), chunk, &cluster});
    }
  }
  // The nearest first: what they hide is then turned down with one comparison a cell.
  std::sort(clusters_.begin(), clusters_.end(), [](const VisibleCluster& a, const VisibleCluster& b) {
    return a.distance_m != b.distance_m ? a.distance_m < b.distance_m : a.order < b.order;
  });
  for (const VisibleCluster& c : clusters_) {
    gather_cluster(*c.chunk, *c.cluster, (c.chunk->origin - camera_position).cast<float>());
  }
  first_moving_ = faces_.size();
  objects_.clear();
  if (scene.moving_at) scene.moving_at(time_s, &objects_);
  std::size_t count = 0;
  for (const MovingObject& object : objects_) count += object.mesh->faces.size();
  moved_faces_.resize(count);
  for (const Face& face : moved_faces_) faces_.push_back({&face, Eigen::Vector3f::Zero(), 0, 0, nullptr});
  move_objects(scene, time_s);
}

void VisibleFaces::move_objects(const Scene& scene, double time_s) {
  if (moved_faces_.empty()) return;
  const std::size_t expected = objects_.size();
  objects_.clear();
  scene.moving_at(time_s, &objects_);
  if (objects_.size() != expected) return;  // one came or went within the exposure: it stays where it was
  std::size_t at = 0;
  for (const MovingObject& object : objects_) {
    const Eigen::Matrix3f R = (Eigen::AngleAxisd(object.yaw_rad, Eigen::Vector3d::UnitZ()) *
                               Eigen::AngleAxisd(object.pitch_rad, Eigen::Vector3d::UnitY()))
                                  .toRotationMatrix()
                                  .cast<float>();
    const Eigen::Vector3f position = (object.position - reference_).cast<float>();
    for (const Face& local : object.mesh->faces) {
      Face& face = moved_faces_[at++];
      face = local;
      for (Eigen::Vector3f& corner : face.corners) corner = R * corner + position;
      face.normal = R * local.normal;
      face.s_axis = R * local.s_axis;
      face.t_axis = R * local.t_axis;
      face.s0 = local.s0 - face.s_axis.dot(position);
      face.t0 = local.t0 - face.t_axis.dot(position);
    }
  }
}

}  // namespace farpoint::tools::simulate
