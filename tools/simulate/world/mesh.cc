// SPDX-License-Identifier: Apache-2.0
#include "tools/simulate/world/mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace farpoint::tools::simulate {

void MeshBuilder::begin_cluster() {
  cluster_begin_ = static_cast<std::uint32_t>(mesh_->faces.size());
}

void MeshBuilder::end_cluster(double sway_m, double sway_phase) {
  const auto end = static_cast<std::uint32_t>(mesh_->faces.size());
  if (end == cluster_begin_) return;
  Eigen::Vector3f low = Eigen::Vector3f::Constant(1e9F), high = -low;
  for (std::uint32_t i = cluster_begin_; i < end; ++i) {
    const Face& face = mesh_->faces[i];
    for (int k = 0; k < face.count; ++k) {
      low = low.cwiseMin(face.corners[static_cast<std::size_t>(k)]);
      high = high.cwiseMax(face.corners[static_cast<std::size_t>(k)]);
    }
  }
  Cluster cluster;
  cluster.centre = 0.5F * (low + high);
  cluster.radius_m = 0.5F * (high - low).norm() + static_cast<float>(sway_m);
  cluster.first = cluster_begin_;
  cluster.count = end - cluster_begin_;
  cluster.sway_m = static_cast<float>(sway_m);
  cluster.sway_phase = static_cast<float>(sway_phase);
  mesh_->clusters.push_back(cluster);
  cluster_begin_ = end;
}

void MeshBuilder::finish(Face* face, const Paint& paint) const {
  const double sun = std::max(0.0, to_sun_.dot(face->normal.cast<double>()));
  const double light = paint.fixed_light >= 0.0 ? paint.fixed_light : ambient_ + (1.0 - ambient_) * sun;
  face->brightness = static_cast<float>(paint.brightness * light);
  face->material = static_cast<std::uint16_t>(paint.material);
  face->two_sided = paint.two_sided;
  face->lit_by_map = paint.lit_by_map;
  mesh_->faces.push_back(*face);
}

void MeshBuilder::lay_texture(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                              const Eigen::Vector3d& normal, const Paint& paint, double s_m, double t_m,
                              Face* face) {
  const Eigen::Vector3d s = paint.texture_scale * (b - a).normalized(), t = normal.cross(s);
  face->normal = normal.cast<float>();
  face->s_axis = s.cast<float>();
  face->t_axis = t.cast<float>();
  face->s0 = static_cast<float>(s_m - s.dot(a));
  face->t0 = static_cast<float>(t_m - t.dot(a));
}

void MeshBuilder::quad(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                       const Eigen::Vector3d& d, const Paint& paint, double s_m, double t_m) {
  Face face;
  face.corners = {a.cast<float>(), b.cast<float>(), c.cast<float>(), d.cast<float>()};
  face.count = 4;
  const Eigen::Vector3d normal = (c - a).cross(d - b).normalized();
  lay_texture(a, b, normal, paint, s_m, t_m, &face);
  finish(&face, paint);
}

void MeshBuilder::triangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                           const Paint& paint, double s_m, double t_m) {
  Face face;
  face.corners = {a.cast<float>(), b.cast<float>(), c.cast<float>(), c.cast<float>()};
  face.count = 3;
  const Eigen::Vector3d normal = (b - a).cross(c - a).normalized();
  lay_texture(a, b, normal, paint, s_m, t_m, &face);
  finish(&face, paint);
}

void MeshBuilder::ground_triangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                  const Eigen::Vector3d& c, const Paint& paint, double s_m, double t_m) {
  Face face;
  face.corners = {a.cast<float>(), b.cast<float>(), c.cast<float>(), c.cast<float>()};
  face.count = 3;
  face.normal = (b - a).cross(c - a).normalized().cast<float>();
  face.s_axis = Eigen::Vector3f::UnitX();
  face.t_axis = Eigen::Vector3f::UnitY();
  face.s0 = static_cast<float>(s_m);
  face.t0 = static_cast<float>(t_m);
  finish(&face, paint);
}

void MeshBuilder::box(const Eigen::Vector3d& base, double half_x_m, double half_y_m, double height_m,
                      double yaw_rad, const Paint& sides, const Paint& top, double s_m) {
  const Eigen::Vector3d x(std::cos(yaw_rad), std::sin(yaw_rad), 0), y(-x.y(), x.x(), 0), up(0, 0, height_m);
  const Eigen::Vector3d p[4] = {base - half_x_m * x - half_y_m * y, base + half_x_m * x - half_y_m * y,
                                base + half_x_m * x + half_y_m * y, base - half_x_m * x + half_y_m * y};
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector3d& a = p[i];
    const Eigen::Vector3d& b = p[(i + 1) % 4];
    quad(a, b, b + up, a + up, sides, s_m, 0.0);
    s_m += (b - a).norm();
  }
  quad(p[0] + up, p[1] + up, p[2] + up, p[3] + up, top);
}

MeshBuilder::Paint ground_paint(int material) {
  MeshBuilder::Paint paint;
  paint.material = material;
  paint.fixed_light = 1.0;
  paint.lit_by_map = true;
  return paint;
}

}  // namespace farpoint::tools::simulate
