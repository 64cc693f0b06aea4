// SPDX-License-Identifier: Apache-2.0
#include "tools/simulate/world/path.h"

#include <algorithm>
#include <cmath>

namespace farpoint::tools::simulate {
namespace {

// The arc that rounds a corner, as points from its first to its last.
std::vector<Eigen::Vector2d> rounded(const Eigen::Vector2d& before, const Eigen::Vector2d& corner,
                                     const Eigen::Vector2d& after, double radius_m) {
  const Eigen::Vector2d in = (corner - before).normalized(), out = (after - corner).normalized();
  const double cross = in.x() * out.y() - in.y() * out.x();
  const double turn = std::atan2(cross, in.dot(out));
  if (std::abs(turn) < 1e-6 || std::abs(turn) > 3.1) return {corner};
  const double room = 0.49 * std::min((corner - before).norm(), (after - corner).norm());
  const double tangent = std::min(radius_m * std::tan(0.5 * std::abs(turn)), room);
  const double radius = tangent / std::tan(0.5 * std::abs(turn));
  const Eigen::Vector2d left(-in.y(), in.x());
  const Eigen::Vector2d start = corner - tangent * in;
  const Eigen::Vector2d centre = start + (turn > 0 ? radius : -radius) * left;
  const int steps = std::max(2, static_cast<int>(std::ceil(radius * std::abs(turn) / 0.25)));
  std::vector<Eigen::Vector2d> arc;
  for (int i = 0; i <= steps; ++i) {
    const double angle = turn * i / steps, c = std::cos(angle), s = std::sin(angle);
    const Eigen::Vector2d spoke = start - centre;
    arc.emplace_back(centre + Eigen::Vector2d(c * spoke.x() - s * spoke.y(), s * spoke.x() + c * spoke.y()));
  }
  return arc;
}

}  // namespace

Path::Path(const std::vector<Eigen::Vector2d>& corners, double radius_m, bool closed) : closed_(closed) {
  const std::size_t n = corners.size();
  std::vector<Eigen::Vector2d> line;
  if (!closed) line.push_back(corners.front());
  for (std::size_t i = closed ? 0 : 1; i + (closed ? 0 : 1) < n; ++i) {
    const auto arc = rounded(corners[(i + n - 1) % n], corners[i], corners[(i + 1) % n], radius_m);
    line.insert(line.end(), arc.begin(), arc.end());
  }
  line.push_back(closed ? line.front() : corners.back());
  resample(line);
  smooth();
}

void Path::resample(const std::vector<Eigen::Vector2d>& line) {
  double total = 0.0;
  for (std::size_t i = 1; i < line.size(); ++i) total += (line[i] - line[i - 1]).norm();
  const auto steps = static_cast<std::size_t>(std::max(2.0, std::round(total / kStep_m)));
  step_m_ = total / static_cast<double>(steps);
  double begin = 0.0;
  for (std::size_t i = 1, k = 0; i < line.size(); ++i) {
    const double piece = (line[i] - line[i - 1]).norm();
    for (; k <= steps && static_cast<double>(k) * step_m_ <= begin + piece + 1e-9; ++k) {
      const double share = piece > 0.0 ? (static_cast<double>(k) * step_m_ - begin) / piece : 0.0;
      points_.emplace_back(line[i - 1] + share * (line[i] - line[i - 1]));
    }
    begin += piece;
  }
  while (points_.size() < steps + 1) points_.push_back(line.back());
  if (closed_) points_.pop_back();
  length_m_ = total;
}

void Path::smooth() {
  const auto n = static_cast<std::ptrdiff_t>(points_.size());
  const auto index = [&](std::ptrdiff_t i) {
    return static_cast<std::size_t>(closed_ ? (i % n + n) % n : std::clamp<std::ptrdiff_t>(i, 0, n - 1));
  };
  for (int round = 0; round < 12; ++round) {  // variance 12 * 0.5 steps^2: about 2.5 m
    std::vector<Eigen::Vector2d> smoothed = points_;
    for (std::ptrdiff_t i = closed_ ? 0 : 1; i < (closed_ ? n : n - 1); ++i) {
      smoothed[static_cast<std::size_t>(i)] =
          0.5 * points_[static_cast<std::size_t>(i)] + 0.25 * (points_[index(i - 1)] + points_[index(i + 1)]);
    }
    points_ = std::move(smoothed);
  }
  curvature_.assign(points_.size(), 0.0);
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    if (!closed_ && (i == 0 || i == n - 1)) continue;
    const Eigen::Vector2d a = points_[static_cast<std::size_t>(i)] - points_[index(i - 1)];
    const Eigen::Vector2d b = points_[index(i + 1)] - points_[static_cast<std::size_t>(i)];
    const double turn = std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
    curvature_[static_cast<std::size_t>(i)] = turn / (0.5 * (a.norm() + b.norm()));
  }
}

Path::Place Path::at(double s_m) const {
  const auto n = static_cast<std::ptrdiff_t>(points_.size());
  double u = s_m / step_m_;
  Place place;
  if (!closed_ && (u < 0.0 || u >= static_cast<double>(n - 1))) {
    const bool before = u < 0.0;
    const std::size_t end = before ? 0 : static_cast<std::size_t>(n - 1), inner = before ? 1 : end - 1;
    place.forward = (before ? points_[inner] - points_[end] : points_[end] - points_[inner]).normalized();
    place.position =
        points_[end] + (before ? s_m : s_m - static_cast<double>(n - 1) * step_m_) * place.forward;
    return place;
  }
  u -= closed_ ? std::floor(u / static_cast<double>(n)) * static_cast<double>(n) : 0.0;
  const auto i = std::min(static_cast<std::ptrdiff_t>(u), n - 1);
  const double share = u - static_cast<double>(i);
  const auto index = [&](std::ptrdiff_t k) {
    return static_cast<std::size_t>(closed_ ? (k % n + n) % n : std::clamp<std::ptrdiff_t>(k, 0, n - 1));
  };
  // Beyond an end the points go straight on.
  const auto point = [&](std::ptrdiff_t k) -> Eigen::Vector2d {
    if (closed_ || (k >= 0 && k < n)) return points_[index(k)];
    const Eigen::Vector2d &end = points_[index(k)], &inner = points_[index(k < 0 ? 1 : n - 2)];
    return end + static_cast<double>(k < 0 ? -k : k - (n - 1)) * (end - inner);
  };
  const Eigen::Vector2d p0 = point(i - 1), p1 = point(i), p2 = point(i + 1), p3 = point(i + 2);
  // A cubic B-spline: its curvature is continuous, so that a lane beside it is driven without jerks. (It
  // passes the points by a sixth of their second difference: millimetres.)
  const double t = share, t2 = t * t, t3 = t2 * t, r = 1.0 - t;
  place.position =
      (r * r * r * p0 + (3 * t3 - 6 * t2 + 4) * p1 + (-3 * t3 + 3 * t2 + 3 * t + 1) * p2 + t3 * p3) / 6.0;
  place.forward = (-r * r * p0 + (3 * t2 - 4 * t) * p1 + (-3 * t2 + 2 * t + 1) * p2 + t2 * p3).normalized();
  place.curvature = (1 - t) * curvature_[index(i)] + t * curvature_[index(i + 1)];
  return place;
}

void RoadFinder::add(const Path& path, double half_width_m) {
  constexpr double kSpacing_m = 4.0;
  for (double s = 0.0; s <= path.length_m(); s += kSpacing_m) {
    const Eigen::Vector2d p = path.at(s).position;
    cells_[key(std::llround(std::floor(p.x() / kCell_m)), std::llround(std::floor(p.y() / kCell_m)))]
        .push_back({p, half_width_m});
  }
}

// Far from every road a distance between places of a lattice will do.
double RoadFinder::distance_m(double x, double y) const {
  constexpr double kExactBelow_m = 800.0;
  if (cells_.empty()) return kMaxDistance_m;
  const double rough = coarse(x, y);
  return rough > kExactBelow_m ? rough : search(x, y);
}

double RoadFinder::coarse(double x, double y) const {
  constexpr double kSpacing_m = 256.0;
  const double u = x / kSpacing_m, v = y / kSpacing_m, fx = std::floor(u), fy = std::floor(v);
  const auto at = [&](double ix, double iy) {
    const auto [entry, is_new] = lattice_.try_emplace(key(std::llround(ix), std::llround(iy)), 0.0);
    if (is_new) entry->second = search(ix * kSpacing_m, iy * kSpacing_m);
    return entry->second;
  };
  const double a = u - fx, b = v - fy;
  return (1 - b) * ((1 - a) * at(fx, fy) + a * at(fx + 1, fy)) +
         b * ((1 - a) * at(fx, fy + 1) + a * at(fx + 1, fy + 1));
}

double RoadFinder::search(double x, double y) const {
  const long long cx = std::llround(std::floor(x / kCell_m)), cy = std::llround(std::floor(y / kCell_m));
  double best = kMaxDistance_m;
  // Rings of cells, until the next ring cannot hold anything nearer.
  for (long long ring = 0; static_cast<double>(ring - 1) * kCell_m < best + 8.0; ++ring) {
    for (long long iy = cy - ring; iy <= cy + ring; ++iy) {
      const bool whole_row = iy == cy - ring || iy == cy + ring;
      for (long long ix = cx - ring; ix <= cx + ring; ix += whole_row || ring == 0 ? 1 : 2 * ring) {
        const auto found = cells_.find(key(ix, iy));
        if (found == cells_.end()) continue;
        for (const Point& p : found->second)
          best = std::min(best, (p.position - Eigen::Vector2d(x, y)).norm() - p.half_width_m);
      }
    }
  }
  return best;
}

}  // namespace farpoint::tools::simulate
