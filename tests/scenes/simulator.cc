// SPDX-License-Identifier: Apache-2.0
#include "tests/scenes/simulator.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>

namespace farpoint::sim {

using slam::Feature;
using slam::SE3;

namespace {

// As the real extractor and alignment have them.
constexpr int kCornerBorder_px = 19;  // level pixels
constexpr float kAlignBorder_px = 6;  // level pixels
constexpr float kMaxScaleChange = 2.2F;
constexpr int kCell_px = 60;

std::atomic<int> images_alive{0};

static_assert(sizeof(PatchPayload) <= sizeof(slam::Patch::pixels));

}  // namespace

// -------------------------------------------------------------------------------------------------------------
// image

SimImage::SimImage(const Options& options, std::uint32_t frame, std::vector<Projection> visible,
                   std::vector<PatchPayload> features)
    : options_(options), frame_(frame), visible_(std::move(visible)), features_(std::move(features)) {
  std::sort(visible_.begin(), visible_.end(),
            [](const Projection& a, const Projection& b) { return a.point < b.point; });
  for (std::uint32_t i = 0; i < visible_.size(); ++i)
    if (visible_[i].group != 0) groups_.emplace_back(visible_[i].group, i);
  std::sort(groups_.begin(), groups_.end());
  ++images_alive;
}

SimImage::~SimImage() {
  --images_alive;
}

int SimImage::alive() {
  return images_alive;
}

bool SimImage::extract_patch(const slam::FeatureSet& set, std::size_t index, slam::Patch* patch) const {
  if (index >= features_.size() || index >= set.features.size()) return false;
  patch->pixels.fill(0);
  std::memcpy(patch->pixels.data(), &features_[index], sizeof(PatchPayload));
  patch->level = set.features[index].level;
  return true;
}

const SimImage::Projection* SimImage::find(const PatchPayload& host, const Eigen::Vector2f& expected,
                                           float reach, bool alike) const {
  const Projection* best = nullptr;
  float best_distance = reach;
  const auto consider = [&](const Projection& p) {
    const float d = (p.pixel - expected).norm();
    if (d < best_distance) best_distance = d, best = &p;
  };
  const auto own = std::lower_bound(visible_.begin(), visible_.end(), host.point,
                                    [](const Projection& p, std::uint32_t id) { return p.point < id; });
  if (own != visible_.end() && own->point == host.point) consider(*own);
  if (alike && host.group != 0) {
    auto it = std::lower_bound(groups_.begin(), groups_.end(), std::make_pair(host.group, 0U));
    for (; it != groups_.end() && it->first == host.group; ++it) consider(visible_[it->second]);
  }
  return best;
}

slam::Alignment SimImage::align(const slam::Patch& host, const Eigen::Matrix2f& A,
                                const Eigen::Vector2f& predicted_px, float max_shift_px) const {
  slam::Alignment out;
  PatchPayload payload;
  std::memcpy(&payload, host.pixels.data(), sizeof(payload));
  const float determinant = A.determinant();
  if (!(determinant > 1e-4F)) return out;
  const double host_scale = std::pow(options_.scale_factor, host.level);
  const double size = host_scale * std::sqrt(static_cast<double>(determinant));
  const int level =
      std::clamp(static_cast<int>(std::lround(std::log(size) / std::log(options_.scale_factor))), 0,
                 options_.levels - 1);
  const auto scale = static_cast<float>(std::pow(options_.scale_factor, level));
  const float change = static_cast<float>(size) / scale;
  if (change > kMaxScaleChange || change < 1.0F / kMaxScaleChange) return out;

  std::uint64_t offset_bits = 0;
  std::memcpy(&offset_bits, &payload.du_px, sizeof(offset_bits));
  SightingDraw draw(combine({options_.seed, frame_, payload.point, payload.frame, offset_bits, 0xa119ULL}));
  const bool alike = draw.chance(options_.noise.alike_alignment);
  const bool fails = draw.chance(options_.noise.align_failure);
  const Eigen::Vector2f offset = A * Eigen::Vector2f(payload.du_px, payload.dv_px);
  const Projection* p = find(payload, predicted_px - offset, max_shift_px, alike);
  if (p == nullptr || fails) return out;
  const double sigma = options_.noise.align_sigma_px * static_cast<double>(scale);
  const double noise_u = sigma * draw.normal(), noise_v = sigma * draw.normal();
  SightingDraw host_draw(combine({options_.seed, payload.point, payload.frame, 0xb1a5ULL}));
  const double bias = options_.noise.align_bias_px * static_cast<double>(scale) * std::log(size / host_scale);
  const double bias_u = bias * host_draw.normal(), bias_v = bias * host_draw.normal();
  out.pixel = p->pixel + offset +
              Eigen::Vector2f(static_cast<float>(noise_u + bias_u), static_cast<float>(noise_v + bias_v));
  const float border = kAlignBorder_px * scale;
  if (out.pixel.x() < border || out.pixel.y() < border ||
      out.pixel.x() > static_cast<float>(options_.width_px - 1) - border ||
      out.pixel.y() > static_cast<float>(options_.height_px - 1) - border)
    return out;
  if ((out.pixel - predicted_px).norm() > max_shift_px) return out;
  out.sigma_px = static_cast<float>(sigma);
  out.zncc = 0.95F;
  out.ok = true;
  return out;
}

// ---------------------------------------------------------------------------------------------------------
// simulator

void ShownPoints::note(const Sighted& sighted) {
  std::vector<Feature>& features = frames_[sighted.input.utime];
  for (std::size_t i = 0; i < sighted.points.size(); ++i) {
    const slam::Feature& f = sighted.input.features.features[i];
    features.push_back({{f.u_px, f.v_px}, sighted.points[i]});
  }
}

std::uint32_t ShownPoints::find(std::int64_t utime, const Eigen::Vector2d& pixel) const {
  const auto frame = frames_.find(utime);
  if (frame == frames_.end()) return kNothing;
  std::uint32_t found = kNothing;
  for (const Feature& f : frame->second)
    if (f.pixel.cast<double>() == pixel) found = std::min(found, f.point);
  return found;
}

Simulator::Simulator(const Scene& scene, std::uint64_t seed)
    : scene_(scene),
      seed_(seed),
      rig_(scene.rig()),
      motion_(scene, seed),
      world_(scene.layers, Path(scene.path, scene.beyond, combine({seed, 0x70617468ULL})), scene.repetition,
             seed) {
  const slam::PyramidOptions pyramid;
  image_ = {scene.noise,           pyramid.scale_factor,   pyramid.levels,
            scene.camera.width_px, scene.camera.height_px, seed};
}

std::int64_t Simulator::utime(std::uint32_t frame) const {
  return std::llround(1e6 * static_cast<double>(frame) / scene_.rate_hz);
}

SE3 Simulator::truth(std::uint32_t frame) {
  return motion_.T_world_body(static_cast<double>(frame) / scene_.rate_hz, &world_.path());
}

Eigen::Vector3d Simulator::position(std::uint32_t point) {
  const auto it = positions_.find(point);
  if (it != positions_.end()) return it->second;
  return positions_.emplace(point, world_.point(point).position).first->second;
}

Sighted Simulator::next() {
  const std::uint32_t frame = frame_++;
  return look(frame, truth(frame), motion_.travelled_m(static_cast<double>(frame) / scene_.rate_hz));
}

bool Simulator::hidden(std::uint32_t point, double t_s) const {
  // Each point has its own clock, else all would vanish at once.
  const std::uint64_t phase = combine({seed_, point, 0x636c6fULL});
  const double block = t_s / scene_.noise.occlusion_s + static_cast<double>(phase >> 11) * 0x1p-53;
  SightingDraw draw(combine({phase, static_cast<std::uint64_t>(block)}));
  return draw.chance(scene_.noise.occlusion);
}

bool Simulator::project(const WorldPoint& p, const SE3& T_camera_world, Eigen::Vector2d* pixel,
                        double* level) const {
  const Eigen::Vector3d c = T_camera_world * p.position;
  if (c.z() < 0.5) return false;
  const double distance = c.norm();
  // Levels beyond those of the pyramid cannot be seen; half a level of grace for the jitter.
  constexpr double kNone = 1.0;
  *level = image_.levels - 0.5 - std::log(distance / p.near_limit_m) / std::log(image_.scale_factor);
  if (*level < -kNone || *level > image_.levels - 1 + kNone) return false;
  const slam::Camera& camera = rig_.cameras.front().camera;
  return camera.project(c, pixel) && camera.in_image(*pixel);
}

void Simulator::choose(std::vector<Candidate>* candidates) const {
  const auto wanted = static_cast<std::size_t>(std::lround(scene_.features * (1.0 - scene_.noise.outliers)));
  std::sort(candidates->begin(), candidates->end(), [](const Candidate& a, const Candidate& b) {
    return a.score != b.score ? a.score > b.score : a.point->id < b.point->id;
  });
  const int columns = scene_.camera.width_px / kCell_px + 1, rows = scene_.camera.height_px / kCell_px + 1;
  const int limit = 1 + 2 * scene_.features / (columns * rows);
  std::vector<int> used(static_cast<std::size_t>(columns * rows), 0);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < candidates->size() && kept < wanted; ++i) {
    const Candidate c = (*candidates)[i];
    if (used[static_cast<std::size_t>(c.cell)]++ >= limit) continue;
    (*candidates)[kept++] = c;
  }
  candidates->resize(kept);
  std::sort(candidates->begin(), candidates->end(), [](const Candidate& a, const Candidate& b) {
    if (a.level != b.level) return a.level < b.level;
    return a.cell != b.cell ? a.cell < b.cell : a.point->id < b.point->id;
  });
}

Sighted Simulator::look(std::uint32_t frame, const SE3& T_world_body, double s_m) {
  world_.move_to(s_m);
  const double t_s = static_cast<double>(frame) / scene_.rate_hz;
  const SE3 T_camera_world = (T_world_body * rig_.cameras.front().T_body_camera).inverse();
  // Roll of the image against the horizon turns every corner.
  const Eigen::Vector3d up = T_camera_world.q * Eigen::Vector3d::UnitZ();
  const auto roll = static_cast<float>(std::atan2(up.x(), -up.y()));
  const NoiseConfig& noise = scene_.noise;
  const int columns = scene_.camera.width_px / kCell_px + 1;

  std::vector<SimImage::Projection> visible;
  std::vector<Candidate> candidates;
  world_.for_each([&](const WorldPoint& p) {
    Candidate c;
    double level = 0;
    if (!project(p, T_camera_world, &c.pixel, &level) || hidden(p.id, t_s)) return;
    visible.push_back({p.id, p.group, c.pixel.cast<float>()});
    SightingDraw draw(combine({seed_, frame, p.id, 0xde7ULL}));
    if (!draw.chance(noise.detection)) return;
    c.level = static_cast<int>(std::lround(level));
    if (draw.chance(noise.level_jitter)) c.level += draw.chance(0.5) ? 1 : -1;
    if (c.level < 0 || c.level >= image_.levels) return;
    c.score = p.score + 0.15F * static_cast<float>(draw.normal());
    c.point = &p;
    c.cell = static_cast<int>(c.pixel.y()) / kCell_px * columns + static_cast<int>(c.pixel.x()) / kCell_px;
    candidates.push_back(c);
  });
  choose(&candidates);

  Sighted out;
  slam::FeatureSet& set = out.input.features;
  std::vector<PatchPayload> payloads;
  const auto snap = [&](double u, int level, int size_px, float* coordinate) {
    const double scale = std::pow(image_.scale_factor, level);
    const double place = std::round((u + 0.5) / scale - 0.5);
    if (place < kCornerBorder_px || place >= std::round(size_px / scale) - kCornerBorder_px) return false;
    *coordinate = static_cast<float>((place + 0.5) * scale - 0.5);
    return true;
  };
  const auto angle = [](double a) { return static_cast<float>(std::remainder(a, 6.283185307179586)); };
  for (const Candidate& c : candidates) {
    SightingDraw draw(combine({seed_, frame, c.point->id, 0xc0ULL}));
    const double sigma = noise.corner_sigma_px * std::pow(image_.scale_factor, c.level);
    Feature f;
    f.level = static_cast<std::uint8_t>(c.level);
    const double u = c.pixel.x() + sigma * draw.normal(), v = c.pixel.y() + sigma * draw.normal();
    if (!snap(u, c.level, scene_.camera.width_px, &f.u_px) ||
        !snap(v, c.level, scene_.camera.height_px, &f.v_px))
      continue;
    f.angle_rad =
        angle(static_cast<double>(c.point->angle_rad + roll) + noise.angle_sigma_rad * draw.normal());
    f.score = 100.0F * c.score;
    slam::Descriptor d = c.point->descriptor;
    for (auto& word : d.words) {
      std::uint64_t flips = draw.bits();
      for (int i = 1; i < noise.flip_words; ++i) flips &= draw.bits();
      word ^= flips;
    }
    set.features.push_back(f);
    set.descriptors.push_back(d);
    payloads.push_back({c.point->id, frame, f.u_px - static_cast<float>(c.pixel.x()),
                        f.v_px - static_cast<float>(c.pixel.y()), c.point->group});
  }
  SightingDraw draw(combine({seed_, frame, 0x0071e5ULL}));
  const auto outliers = static_cast<std::uint32_t>(std::lround(noise.outliers * scene_.features));
  for (std::uint32_t i = 0; i < outliers; ++i) {
    Feature f;
    const int level = static_cast<int>(draw.uniform(0.0, image_.levels));
    const double u = draw.uniform(0, scene_.camera.width_px), v = draw.uniform(0, scene_.camera.height_px);
    f.level = static_cast<std::uint8_t>(level);
    f.angle_rad = angle(draw.uniform(-3.14, 3.14));
    f.score = 50.0F;
    slam::Descriptor d;
    for (auto& word : d.words) word = draw.bits();
    if (!snap(u, level, scene_.camera.width_px, &f.u_px) || !snap(v, level, scene_.camera.height_px, &f.v_px))
      continue;
    set.features.push_back(f);
    set.descriptors.push_back(d);
    payloads.push_back({kNothing | i, frame, 0.0F, 0.0F, 0});
  }
  for (const PatchPayload& p : payloads) out.points.push_back(p.point);
  out.input.utime = utime(frame);
  out.input.sequence = frame;
  out.input.image = std::make_shared<SimImage>(image_, frame, std::move(visible), std::move(payloads));
  out.T_world_body = T_world_body;
  out.travelled_m = s_m;
  return out;
}

}  // namespace farpoint::sim
