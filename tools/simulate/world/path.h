// SPDX-License-Identifier: Apache-2.0
// Centre lines of roads in the plane, and distances from them.
#pragma once

#include <Eigen/Core>
#include <unordered_map>
#include <vector>

namespace farpoint::tools::simulate {

// A smooth line, sampled every metre.
class Path {
 public:
  static constexpr double kStep_m = 1.0;
  struct Place {
    Eigen::Vector2d position;
    Eigen::Vector2d forward;  // unit
    double curvature = 0.0;   // 1/m, left positive
    [[nodiscard]] Eigen::Vector2d left() const { return {-forward.y(), forward.x()}; }
  };

  Path() = default;
  // Straight lines between the corners, which are rounded by arcs of at most `radius_m` (less where the lines
  // are too short), then smoothed a little, since steering is continuous. Precondition: two corners or more,
  // three for a closed path, each more than a metre from the next.
  Path(const std::vector<Eigen::Vector2d>& corners, double radius_m, bool closed);

  [[nodiscard]] double length_m() const { return length_m_; }
  [[nodiscard]] bool closed() const { return closed_; }
  [[nodiscard]] bool empty() const { return points_.empty(); }
  // An open path continues straight beyond its ends; a closed one repeats.
  [[nodiscard]] Place at(double s_m) const;

 private:
  void resample(const std::vector<Eigen::Vector2d>& line);
  void smooth();

  std::vector<Eigen::Vector2d> points_;  // a step apart; a closed path does not repeat its first
  std::vector<double> curvature_;
  double length_m_ = 0.0, step_m_ = kStep_m;
  bool closed_ = false;
};

// Finds the nearest of many points of roads. Not thread-safe: it caches distances.
class RoadFinder {
 public:
  static constexpr double kMaxDistance_m = 3000.0;
  void add(const Path& path, double half_width_m);
  // Metres from the nearest road's edge, negative on it; kMaxDistance_m beyond that distance.
  [[nodiscard]] double distance_m(double x, double y) const;

 private:
  static constexpr double kCell_m = 64.0;
  struct Point {
    Eigen::Vector2d position;
    double half_width_m;
  };
  [[nodiscard]] static long long key(long long ix, long long iy) { return ix * 0x100000000LL + iy; }
  [[nodiscard]] double search(double x, double y) const;
  [[nodiscard]] double coarse(double x, double y) const;

  std::unordered_map<long long, std::vector<Point>> cells_;
  mutable std::unordered_map<long long, double> lattice_;  // distances already searched for, far from roads
};

}  // namespace farpoint::tools::simulate
