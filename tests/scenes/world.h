// SPDX-License-Identifier: Apache-2.0
// Points with exact positions, generated along a path. Any stretch of the world is made again from its
// number: memory does not grow with the drive.
//
// World axes: x forward at the start, y left, z up; the ground is z = 0. Metres.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <vector>

#include "slam/image/feature.h"
#include "tests/scenes/random.h"

namespace farpoint::sim {

// A corner of the world.
struct WorldPoint {
  std::uint32_t id = 0;     // names layer, stretch and number
  std::uint32_t group = 0;  // points that look alike share it; 0: unlike any other
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  // The distance at which it is as large as the coarsest pyramid level shows: nearer it is too large for a
  // corner.
  double near_limit_m = 1.0;
  float angle_rad = 0;  // orientation in an upright image
  float score = 0;      // 0..1: which corners the extractor prefers
  slam::Descriptor descriptor;
};

// Arc-length parametrised path in the plane with continuous curvature.
class Path {
 public:
  struct Segment {
    double length_m = 0, curvature_start = 0, curvature_end = 0;  // 1/m, left positive
  };
  enum class Beyond { kStraight, kWinding };
  // Beyond its segments the path runs straight, or winds without end.
  Path(std::vector<Segment> segments, Beyond beyond, std::uint64_t seed);

  struct Place {
    Eigen::Vector2d position = Eigen::Vector2d::Zero();
    double heading_rad = 0;
  };
  [[nodiscard]] Place at(double s_m);

 private:
  struct Node {
    Place place;
    double curvature = 0;
  };
  void extend(double s_m);
  double curvature_at(double s_m);

  std::vector<Segment> segments_;
  Beyond beyond_;
  WorldDraw draw_;
  double segments_end_m_ = 0;
  std::size_t current_segment_ = 0;
  double current_start_m_ = 0;
  std::vector<Node> nodes_;
};

// One kind of surroundings, strewn along the path in stretches.
struct Layer {
  enum class Shape {
    kRoadside,   // both sides of the path: lateral_m .. lateral_far_m, 0 .. height_m up
    kRoad,       // the ground within lateral_far_m of the path
    kLandscape,  // distance_m .. distance_far_m (log-uniform) all round, up to `rise` times the distance high
    kBall,       // the same in every direction, about the camera
  };
  Shape shape = Shape::kRoadside;
  double stretch_m = 20;                      // length of a stretch; 0: one stretch for the whole world
  int points = 100;                           // a stretch, at most 32767
  double behind_m = 50, ahead_m = 200;        // stretches considered from the vehicle
  double near_m = 4, far_m = 20;              // lateral or radial distance
  double height_m = 8;                        // kRoadside
  double rise = 0.1;                          // kLandscape
  double centre_height_m = 0;                 // kBall
  double limit_low = 0.25, limit_high = 0.8;  // near_limit_m as a share of the typical viewing distance
  double typical_m = 30;                      // kRoadside, kRoad: that distance; others take their own
};

class World {
 public:
  World(std::vector<Layer> layers, Path path, double repetition, std::uint64_t seed);

  // The stretches around arc length s; further ones are dropped.
  void move_to(double s_m);
  template <typename Visitor>
  void for_each(Visitor&& visit) const {
    for (const auto& layer : stretches_)
      for (const auto& [index, points] : layer)
        for (const WorldPoint& p : points) visit(p);
  }
  // Any point of the world by its id. Costs a stretch: keep what is asked for often.
  [[nodiscard]] WorldPoint point(std::uint32_t id);
  [[nodiscard]] Path& path() { return path_; }
  [[nodiscard]] std::size_t points_in_memory() const;

 private:
  [[nodiscard]] std::vector<WorldPoint> generate(std::size_t layer, int stretch);

  std::vector<Layer> layers_;
  Path path_;
  double repetition_;
  std::uint64_t seed_;
  std::vector<std::map<int, std::vector<WorldPoint>>> stretches_;  // one map a layer
};

}  // namespace farpoint::sim
