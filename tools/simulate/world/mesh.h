// SPDX-License-Identifier: Apache-2.0
// Geometry of the simulated world: flat textured faces, gathered in clusters (one building, one tree) and
// chunks (one square of the world).
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "tools/simulate/world/texture.h"

namespace farpoint::tools::simulate {

// One texture over a face: it repeats every period_m along the face's two axes. The layers of a material
// multiply; gain makes a texel of [0, 255] a factor.
struct Layer {
  const Texture* texture = nullptr;
  double period_s_m = 1.0, period_t_m = 1.0;
  double gain = 1.0 / 255.0;
};

struct Material {
  static constexpr int kMaxLayers = 3;
  std::vector<Layer> layers;
  const Texture* cutout = nullptr;  // mapped like the first layer; holes where it is below one half
};

// A convex flat polygon. Positions are relative to the chunk's (or moving object's) origin.
struct Face {
  static constexpr int kMaxCorners = 4;
  std::array<Eigen::Vector3f, kMaxCorners> corners;
  Eigen::Vector3f normal;          // unit, to the side it is seen from
  Eigen::Vector3f s_axis, t_axis;  // texture coordinates in metres: s = s_axis . p + s0
  float s0 = 0, t0 = 0;
  float brightness = 1.0F;  // light on the face times its paint
  std::uint16_t material = 0;
  std::uint8_t count = 0;
  bool two_sided = false;
  bool lit_by_map = false;  // the chunk's light map (cast shadows) applies
};

struct Cluster {
  Eigen::Vector3f centre;
  float radius_m = 0;
  std::uint32_t first = 0, count = 0;  // faces
  float sway_m = 0, sway_phase = 0;    // foliage in the wind: amplitude, and where in the swing it starts
};

struct Mesh {
  std::vector<Face> faces;
  std::vector<Cluster> clusters;
};

// A square of the world, made when the camera comes near.
struct Chunk {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  double size_m = 0.0;
  Mesh mesh;
  std::unique_ptr<Texture> light_map;  // over x and y of the chunk, from its origin; may be absent
};

// Something that moves as a whole.
struct MovingObject {
  const Mesh* mesh = nullptr;  // about its own origin: x forward, y left, z up
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  double yaw_rad = 0.0, pitch_rad = 0.0;
};

// Adds faces to a mesh, cluster by cluster. Positions are given in world axes about the mesh's origin.
class MeshBuilder {
 public:
  // Direction to the sun (unit), and how bright a face is that it does not reach, of [0, 1].
  MeshBuilder(Mesh* mesh, const Eigen::Vector3d& to_sun, double ambient)
      : mesh_(mesh), to_sun_(to_sun), ambient_(ambient) {}

  void begin_cluster();
  void end_cluster(double sway_m = 0.0, double sway_phase = 0.0);

  struct Paint {
    int material = 0;
    double brightness = 1.0;
    bool two_sided = false;
    bool lit_by_map = false;
    double fixed_light = -1.0;   // light that does not follow from the normal; negative: it does
    double texture_scale = 1.0;  // metres of texture a metre of face
  };
  // Quadrilateral a b c d, counter-clockwise seen from outside; s runs from a to b and starts at s_m, t
  // across it, upwards on walls, and starts at t_m. It must be flat, or nearly.
  void quad(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
            const Eigen::Vector3d& d, const Paint& paint, double s_m = 0.0, double t_m = 0.0);
  void triangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                const Paint& paint, double s_m = 0.0, double t_m = 0.0);
  // Triangle whose texture lies on the ground: s along x, t along y of the mesh, moved by the offsets.
  void ground_triangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                       const Paint& paint, double s_m, double t_m);
  // Upright box on the ground plane: centre of its base, half sizes along its own axes, turned by yaw. Sides
  // and top may have different paints; it has no bottom.
  void box(const Eigen::Vector3d& base, double half_x_m, double half_y_m, double height_m, double yaw_rad,
           const Paint& sides, const Paint& top, double s_m = 0.0);

 private:
  // s runs from a to b and starts at s_m, t across it and starts at t_m.
  static void lay_texture(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& normal,
                          const Paint& paint, double s_m, double t_m, Face* face);
  void finish(Face* face, const Paint& paint) const;

  Mesh* mesh_;
  Eigen::Vector3d to_sun_;
  double ambient_;
  std::uint32_t cluster_begin_ = 0;
};

// Of what lies on the ground: lit by the chunk's light map alone.
[[nodiscard]] MeshBuilder::Paint ground_paint(int material);

}  // namespace farpoint::tools::simulate
