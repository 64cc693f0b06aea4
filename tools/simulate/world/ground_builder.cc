// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "tools/simulate/world/materials.h"
#include "tools/simulate/world/random.h"
#include "tools/simulate/world/site.h"

namespace farpoint::tools::simulate {
namespace {

// Under roads and pavements the ground lies lower, so that its coarse triangles never cut through them.
constexpr double kUnderRoad_m = 0.45;
constexpr double kRoadMargin_m = 4.5;
// Under near ground the far ground lies lower still: its triangles are far coarser.
constexpr double kUnderNearGround_m = 9.0;

// Heights at the corners of a square grid.
struct HeightGrid {
  int cells = 0;
  double step_m = 0.0;
  std::vector<double> z, road_distance;

  [[nodiscard]] std::size_t index(int ix, int iy) const {
    return static_cast<std::size_t>(iy) * static_cast<std::size_t>(cells + 1) + static_cast<std::size_t>(ix);
  }
};

HeightGrid sample_heights(const Site& site, const ChunkSite& chunk, int cells) {
  HeightGrid grid;
  grid.cells = cells;
  grid.step_m = chunk.size_m / cells;
  for (int iy = 0; iy <= cells; ++iy) {
    for (int ix = 0; ix <= cells; ++ix) {
      const double x = chunk.origin.x() + ix * grid.step_m, y = chunk.origin.y() + iy * grid.step_m;
      const double distance = site.roads->distance_m(x, y);
      grid.road_distance.push_back(distance);
      grid.z.push_back(site.terrain->height(x, y, distance));
    }
  }
  return grid;
}

// The mesh of a grid, in clusters of `patch` by `patch` cells.
void add_grid(const Site& site, const ChunkSite& chunk, const HeightGrid& grid, int patch) {
  const double s0 = std::fmod(chunk.origin.x(), kGroundPeriod_m),
               t0 = std::fmod(chunk.origin.y(), kGroundPeriod_m);
  const auto corner = [&](int ix, int iy) {
    return chunk.local(chunk.origin.x() + ix * grid.step_m, chunk.origin.y() + iy * grid.step_m,
                       grid.z[grid.index(ix, iy)]);
  };
  for (int py = 0; py < grid.cells; py += patch) {
    for (int px = 0; px < grid.cells; px += patch) {
      chunk.builder->begin_cluster();
      for (int iy = py; iy < std::min(py + patch, grid.cells); ++iy) {
        for (int ix = px; ix < std::min(px + patch, grid.cells); ++ix) {
          const Eigen::Vector3d a = corner(ix, iy), b = corner(ix + 1, iy), c = corner(ix + 1, iy + 1),
                                d = corner(ix, iy + 1);
          const double slope =
              std::hypot(c.z() + b.z() - a.z() - d.z(), c.z() + d.z() - a.z() - b.z()) / (2.0 * grid.step_m);
          const Eigen::Vector3d middle = 0.25 * (a + b + c + d) + chunk.origin;
          const MeshBuilder::Paint paint = ground_paint(site.terrain->material(
              middle.x(), middle.y(), middle.z(), slope, grid.road_distance[grid.index(ix, iy)]));
          chunk.builder->ground_triangle(a, b, c, paint, s0, t0);
          chunk.builder->ground_triangle(a, c, d, paint, s0, t0);
        }
      }
      chunk.builder->end_cluster();
    }
  }
}

// Walls down from the rim: they hide the gaps between meshes of different fineness.
void add_skirt(const ChunkSite& chunk, const HeightGrid& grid, double depth_m) {
  const int n = grid.cells;
  const auto corner = [&](int ix, int iy) {
    return chunk.local(chunk.origin.x() + ix * grid.step_m, chunk.origin.y() + iy * grid.step_m,
                       grid.z[grid.index(ix, iy)]);
  };
  const Eigen::Vector3d down(0, 0, -depth_m);
  MeshBuilder::Paint paint;
  paint.material = kGround;
  paint.fixed_light = 0.8;
  paint.two_sided = true;
  paint.lit_by_map = true;  // and casts no shadow
  chunk.builder->begin_cluster();
  for (int i = 0; i < n; ++i) {
    for (const auto& [a, b] :
         {std::pair(corner(i, 0), corner(i + 1, 0)), std::pair(corner(n, i), corner(n, i + 1)),
          std::pair(corner(i + 1, n), corner(i, n)), std::pair(corner(0, i + 1), corner(0, i))}) {
      chunk.builder->quad(a + down, b + down, b, a, paint);
    }
  }
  chunk.builder->end_cluster();
}

}  // namespace

void build_near_ground(const Site& site, const ChunkSite& chunk) {
  const double middle =
      site.roads->distance_m(chunk.origin.x() + 0.5 * chunk.size_m, chunk.origin.y() + 0.5 * chunk.size_m);
  const int cells = middle < 90.0 ? 32 : middle < 200.0 ? 16 : 8;
  HeightGrid grid = sample_heights(site, chunk, cells);
  for (std::size_t i = 0; i < grid.z.size(); ++i) {
    if (grid.road_distance[i] < kRoadMargin_m) grid.z[i] -= kUnderRoad_m;
  }
  add_grid(site, chunk, grid, 8);
  add_skirt(chunk, grid, 12.0);
}

void build_far_ground(const Site& site, const ChunkSite& chunk) {
  const double middle =
      site.roads->distance_m(chunk.origin.x() + 0.5 * chunk.size_m, chunk.origin.y() + 0.5 * chunk.size_m);
  HeightGrid grid = sample_heights(site, chunk, middle < 2000.0 ? 16 : 8);
  for (std::size_t i = 0; i < grid.z.size(); ++i) {
    if (grid.road_distance[i] < kNearGround_m + kNearChunk_m) grid.z[i] -= kUnderNearGround_m;
  }
  add_grid(site, chunk, grid, 8);
  add_skirt(chunk, grid, 40.0);
}

namespace {

// The light map while it is made.
struct LightGrid {
  int texels;
  double step_m;
  std::vector<float> light;

  [[nodiscard]] float& at(int x, int y) { return light[static_cast<std::size_t>(y * texels + x)]; }
};

// Light on the bare ground, from its slope, relative to level ground; the ground's shape between the samples
// is interpolated.
void shade_slopes(const Site& site, const ChunkSite& chunk, double height_step_m, LightGrid* grid) {
  const int n = static_cast<int>(std::lround(chunk.size_m / height_step_m));
  std::vector<float> coarse(static_cast<std::size_t>((n + 1) * (n + 1)));
  HeightGrid heights = sample_heights(site, {chunk.origin, chunk.size_m, nullptr}, n);
  const double ambient = site.world->sky.ambient;
  const double level = ambient + (1.0 - ambient) * site.to_sun.z();
  for (int iy = 0; iy <= n; ++iy) {
    for (int ix = 0; ix <= n; ++ix) {
      const auto z = [&](int x, int y) {
        return heights.z[heights.index(std::clamp(x, 0, n), std::clamp(y, 0, n))];
      };
      const double wide_x = (std::min(ix + 1, n) - std::max(ix - 1, 0)) * heights.step_m;
      const double wide_y = (std::min(iy + 1, n) - std::max(iy - 1, 0)) * heights.step_m;
      const Eigen::Vector3d normal(-(z(ix + 1, iy) - z(ix - 1, iy)) / wide_x,
                                   -(z(ix, iy + 1) - z(ix, iy - 1)) / wide_y, 1.0);
      const double sun = std::max(0.0, site.to_sun.dot(normal.normalized()));
      coarse[static_cast<std::size_t>(iy * (n + 1) + ix)] =
          static_cast<float>((ambient + (1.0 - ambient) * sun) / (1.6 * level));
    }
  }
  const double ratio = static_cast<double>(n) / grid->texels;
  for (int y = 0; y < grid->texels; ++y) {
    for (int x = 0; x < grid->texels; ++x) {
      const double u = (x + 0.5) * ratio, v = (y + 0.5) * ratio;
      const int ix = std::min(static_cast<int>(u), n - 1), iy = std::min(static_cast<int>(v), n - 1);
      const auto a = static_cast<float>(u - ix), b = static_cast<float>(v - iy);
      const float* row = &coarse[static_cast<std::size_t>(iy * (n + 1) + ix)];
      const float* next = row + n + 1;
      grid->at(x, y) = (1 - b) * ((1 - a) * row[0] + a * row[1]) + b * ((1 - a) * next[0] + a * next[1]);
    }
  }
}

// Darkens the texels under a face's shadow on the level of `ground_z`. Foliage lets some light through.
void cast_shadow(const Face& face, const Eigen::Vector3d& to_sun, double ground_z, float light_left,
                 LightGrid* grid) {
  Eigen::Vector2d outline[Face::kMaxCorners];
  double low_y = 1e9, high_y = -1e9;
  for (int i = 0; i < face.count; ++i) {
    const Eigen::Vector3d p = face.corners[static_cast<std::size_t>(i)].cast<double>();
    const double fall = std::max(p.z() - ground_z, 0.0) / to_sun.z();
    outline[i] = (p.head<2>() - fall * to_sun.head<2>()) / grid->step_m;
    low_y = std::min(low_y, outline[i].y());
    high_y = std::max(high_y, outline[i].y());
  }
  const int first = std::max(0, static_cast<int>(std::ceil(low_y - 0.5)));
  const int last = std::min(grid->texels - 1, static_cast<int>(std::floor(high_y - 0.5)));
  for (int row = first; row <= last; ++row) {
    const double y = row + 0.5;
    double left = 1e9, right = -1e9;
    for (int i = 0; i < face.count; ++i) {
      const Eigen::Vector2d &a = outline[i], &b = outline[(i + 1) % face.count];
      if ((a.y() <= y) == (b.y() <= y)) continue;
      const double x = a.x() + (y - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
      left = std::min(left, x);
      right = std::max(right, x);
    }
    const int begin = std::max(0, static_cast<int>(std::ceil(left - 0.5)));
    const int end = std::min(grid->texels - 1, static_cast<int>(std::floor(right - 0.5)));
    for (int x = begin; x <= end; ++x)
      grid->at(x, row) = std::min(grid->at(x, row), grid->at(x, row) * light_left);
  }
}

}  // namespace

std::unique_ptr<Texture> bake_light(const Site& site, const ChunkSite& chunk, const Mesh& mesh,
                                    const std::vector<Material>& materials, int texels,
                                    double height_step_m) {
  LightGrid grid{texels, chunk.size_m / texels,
                 std::vector<float>(static_cast<std::size_t>(texels * texels))};
  shade_slopes(site, chunk, height_step_m, &grid);
  LightGrid shadow{texels, grid.step_m, std::vector<float>(grid.light.size(), 1.0F)};
  const double ambient = site.world->sky.ambient;
  const double level = ambient + (1.0 - ambient) * site.to_sun.z();
  const auto dark = static_cast<float>(ambient / level);
  if (site.to_sun.z() > 0.05) {
    for (const Cluster& cluster : mesh.clusters) {
      const double ground =
          site.terrain->height(cluster.centre.x() + chunk.origin.x(), cluster.centre.y() + chunk.origin.y()) -
          chunk.origin.z();
      for (std::uint32_t i = cluster.first; i < cluster.first + cluster.count; ++i) {
        const Face& face = mesh.faces[i];
        if (face.lit_by_map) continue;
        const bool leafy = materials[face.material].cutout != nullptr;
        cast_shadow(face, site.to_sun, ground, leafy ? 0.78F : 0.0F, &shadow);
      }
    }
  }
  for (std::size_t i = 0; i < grid.light.size(); ++i) {
    grid.light[i] *= std::max(dark, dark + (1.0F - dark) * shadow.light[i]);
  }
  return std::make_unique<Texture>(texels, texels, grid.light);
}

}  // namespace farpoint::tools::simulate
