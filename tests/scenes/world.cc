// SPDX-License-Identifier: Apache-2.0
#include "tests/scenes/world.h"

#include <algorithm>
#include <cmath>

namespace farpoint::sim {

namespace {

constexpr double kNodeSpacing_m = 0.5;
constexpr double kPi = 3.14159265358979323846;
// id = layer (3 bits, 7 is unused), stretch + kStretchOffset (14 bits), number (15 bits)
constexpr int kStretchOffset = 1 << 13;

std::uint32_t make_id(std::size_t layer, int stretch, std::size_t number) {
  return (static_cast<std::uint32_t>(layer) << 29) |
         (static_cast<std::uint32_t>(stretch + kStretchOffset) << 15) | static_cast<std::uint32_t>(number);
}

// One bit in 16 differs.
slam::Descriptor with_flips(const slam::Descriptor& d, WorldDraw* draw) {
  slam::Descriptor out = d;
  for (auto& word : out.words) word ^= draw->bits() & draw->bits() & draw->bits() & draw->bits();
  return out;
}

}  // namespace

Path::Path(std::vector<Segment> segments, Beyond beyond, std::uint64_t seed)
    : segments_(std::move(segments)), beyond_(beyond), draw_(seed) {
  for (const Segment& s : segments_) segments_end_m_ += s.length_m;
  nodes_.push_back({{}, segments_.empty() ? 0.0 : segments_.front().curvature_start});
}

double Path::curvature_at(double s_m) {
  while (s_m >= segments_end_m_ && beyond_ == Beyond::kWinding) {
    const double last = segments_.empty() ? 0.0 : segments_.back().curvature_end;
    // Gentle bends of 40 m radius and more, with straights in between.
    const double next = std::fabs(last) > 0.0 && draw_.chance(0.6) ? 0.0 : draw_.uniform(-0.025, 0.025);
    segments_.push_back({draw_.uniform(15, 40), last, next});
    segments_end_m_ += segments_.back().length_m;
  }
  if (s_m >= segments_end_m_) return 0.0;
  while (s_m >= current_start_m_ + segments_[current_segment_].length_m)
    current_start_m_ += segments_[current_segment_++].length_m;
  const Segment& segment = segments_[current_segment_];
  const double share = (s_m - current_start_m_) / segment.length_m;
  return segment.curvature_start + share * (segment.curvature_end - segment.curvature_start);
}

void Path::extend(double s_m) {
  while (static_cast<double>(nodes_.size() - 1) * kNodeSpacing_m < s_m + kNodeSpacing_m) {
    const Node& n = nodes_.back();
    const double s = static_cast<double>(nodes_.size()) * kNodeSpacing_m;
    const double curvature = curvature_at(s);
    Node next;
    const double turn = 0.5 * (n.curvature + curvature) * kNodeSpacing_m;
    const double middle = n.place.heading_rad + 0.5 * turn;
    next.place.position =
        n.place.position + kNodeSpacing_m * Eigen::Vector2d(std::cos(middle), std::sin(middle));
    next.place.heading_rad = n.place.heading_rad + turn;
    next.curvature = curvature;
    nodes_.push_back(next);
  }
}

Path::Place Path::at(double s_m) {
  if (s_m < 0.0) return {{s_m, 0.0}, 0.0};
  // A straight end needs no nodes.
  if (beyond_ == Beyond::kStraight && s_m > segments_end_m_ + kNodeSpacing_m) {
    Place end = at(segments_end_m_ + kNodeSpacing_m);
    end.position += (s_m - segments_end_m_ - kNodeSpacing_m) *
                    Eigen::Vector2d(std::cos(end.heading_rad), std::sin(end.heading_rad));
    return end;
  }
  extend(s_m);
  const auto index = static_cast<std::size_t>(s_m / kNodeSpacing_m);
  const double rest = s_m / kNodeSpacing_m - static_cast<double>(index);
  const Place& a = nodes_[index].place;
  const Place& b = nodes_[index + 1].place;
  return {a.position + rest * (b.position - a.position),
          a.heading_rad + rest * (b.heading_rad - a.heading_rad)};
}

World::World(std::vector<Layer> layers, Path path, double repetition, std::uint64_t seed)
    : layers_(std::move(layers)), path_(std::move(path)), repetition_(repetition), seed_(seed) {
  stretches_.resize(layers_.size());
}

void World::move_to(double s_m) {
  for (std::size_t l = 0; l < layers_.size(); ++l) {
    const Layer& layer = layers_[l];
    int first = 0, last = 0;
    if (layer.stretch_m > 0.0) {
      first = static_cast<int>(std::floor((s_m - layer.behind_m) / layer.stretch_m));
      last = static_cast<int>(std::floor((s_m + layer.ahead_m) / layer.stretch_m));
    }
    std::erase_if(stretches_[l], [&](const auto& s) { return s.first < first || s.first > last; });
    for (int i = first; i <= last; ++i)
      if (!stretches_[l].contains(i)) stretches_[l].emplace(i, generate(l, i));
  }
}

WorldPoint World::point(std::uint32_t id) {
  const std::size_t layer = id >> 29;
  const int stretch = static_cast<int>((id >> 15) & 0x3FFF) - kStretchOffset;
  if (layer >= layers_.size()) return {};
  const auto it = stretches_[layer].find(stretch);
  if (it != stretches_[layer].end()) return it->second[id & 0x7FFF];
  return generate(layer, stretch)[id & 0x7FFF];
}

std::size_t World::points_in_memory() const {
  std::size_t n = 0;
  for (const auto& layer : stretches_)
    for (const auto& [index, points] : layer) n += points.size();
  return n;
}

std::vector<WorldPoint> World::generate(std::size_t layer_index, int stretch) {
  const Layer& layer = layers_[layer_index];
  WorldDraw draw(combine({seed_, layer_index, static_cast<std::uint64_t>(stretch + kStretchOffset)}));
  std::vector<WorldPoint> out;
  out.reserve(static_cast<std::size_t>(layer.points));
  const double start_m = layer.stretch_m * stretch;
  for (int i = 0; i < layer.points; ++i) {
    WorldPoint p;
    p.id = make_id(layer_index, stretch, out.size());
    const Path::Place place = path_.at(start_m + draw.uniform() * layer.stretch_m);
    const Eigen::Vector2d forward(std::cos(place.heading_rad), std::sin(place.heading_rad));
    const Eigen::Vector2d left(-forward.y(), forward.x());
    double typical_m = layer.typical_m;
    switch (layer.shape) {
      case Layer::Shape::kRoadside: {
        const double side = draw.chance(0.5) ? 1.0 : -1.0;
        p.position << place.position + side * draw.log_uniform(layer.near_m, layer.far_m) * left,
            draw.uniform(0.0, layer.height_m);
        break;
      }
      case Layer::Shape::kRoad:
        p.position << place.position + draw.uniform(-layer.far_m, layer.far_m) * left, 0.0;
        break;
      case Layer::Shape::kLandscape: {
        const double distance_m = draw.log_uniform(layer.near_m, layer.far_m);
        const double azimuth = draw.uniform(-kPi, kPi);
        p.position << place.position + distance_m * (std::cos(azimuth) * forward + std::sin(azimuth) * left),
            distance_m * draw.uniform(0.0, layer.rise);
        typical_m = distance_m;
        break;
      }
      case Layer::Shape::kBall: {
        const double distance_m = draw.log_uniform(layer.near_m, layer.far_m);
        const double azimuth = draw.uniform(-kPi, kPi), z = draw.uniform(-1.0, 1.0);
        const double r = std::sqrt(1.0 - z * z);
        p.position = distance_m * Eigen::Vector3d(r * std::cos(azimuth), r * std::sin(azimuth), z);
        p.position.z() += layer.centre_height_m;
        typical_m = distance_m;
        break;
      }
    }
    p.near_limit_m = typical_m * draw.log_uniform(layer.limit_low, layer.limit_high);
    p.angle_rad = static_cast<float>(draw.uniform(-kPi, kPi));
    p.score = static_cast<float>(draw.uniform());
    for (auto& word : p.descriptor.words) word = draw.bits();
    // Windows, fence posts: the one before again, a little further on.
    if (!out.empty() && draw.chance(repetition_)) {
      WorldPoint& before = out.back();
      if (before.group == 0) before.group = before.id;
      p.group = before.group;
      p.descriptor = with_flips(before.descriptor, &draw);
      p.angle_rad = before.angle_rad;
      p.near_limit_m = before.near_limit_m;
      p.position = before.position;
      const double step_m = 0.05 * typical_m * draw.uniform(0.5, 2.0);
      p.position.head<2>() += step_m * forward;
    }
    out.push_back(p);
  }
  return out;
}

}  // namespace farpoint::sim
