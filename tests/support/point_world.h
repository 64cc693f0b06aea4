// SPDX-License-Identifier: Apache-2.0
// A world of points with exact pixels, and maps of it: material for the tests of mapping, without images.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <random>
#include <unordered_map>
#include <utility>
#include <vector>

#include "slam/config.h"
#include "slam/map/frame.h"
#include "slam/map/local_view.h"
#include "slam/map/map.h"
#include "slam/map/request.h"
#include "slam/mapping/counts.h"
#include "slam/mapping/keyframe_maker.h"

namespace farpoint::test {

// The point that a patch of PointImage shows.
[[nodiscard]] inline std::uint32_t point_of(const slam::Patch& patch) {
  std::uint32_t point = 0;
  std::memcpy(&point, patch.pixels.data(), sizeof(point));
  return point;
}

// Holds the exact pixel of every point in view. A patch is the id of its point.
class PointImage final : public slam::FrameImage {
 public:
  void add(std::uint32_t point, const Eigen::Vector2f& pixel) {
    points_.push_back(point);
    pixels_[point] = pixel;
  }
  // Index of the point's feature; the number of features where it is out of view.
  [[nodiscard]] std::size_t feature_of(std::uint32_t point) const {
    std::size_t i = 0;
    while (i < points_.size() && points_[i] != point) ++i;
    return i;
  }
  [[nodiscard]] bool shows(std::uint32_t point) const { return pixels_.contains(point); }
  // From now on, alignment finds the point displaced by this much, or not at all.
  void displace(std::uint32_t point, const Eigen::Vector2f& by_px) { pixels_[point] += by_px; }
  void hide(std::uint32_t point) { pixels_.erase(point); }

  [[nodiscard]] bool extract_patch(const slam::FeatureSet& set, std::size_t index,
                                   slam::Patch* patch) const override {
    std::memcpy(patch->pixels.data(), &points_[index], sizeof(std::uint32_t));
    patch->level = set.features[index].level;
    return true;
  }
  [[nodiscard]] slam::Alignment align(const slam::Patch& host, const Eigen::Matrix2f& /*A*/,
                                      const Eigen::Vector2f& predicted_px,
                                      float max_shift_px) const override {
    slam::Alignment out;
    const auto found = pixels_.find(point_of(host));
    if (found == pixels_.end() || (found->second - predicted_px).norm() > max_shift_px) return out;
    out.pixel = found->second;
    out.sigma_px = 0.1F;
    out.zncc = 0.95F;
    out.ok = true;
    return out;
  }

 private:
  std::vector<std::uint32_t> points_;  // by feature
  std::unordered_map<std::uint32_t, Eigen::Vector2f> pixels_;
};

// Points ahead of a body that drives along; one camera with a lever arm.
class PointWorld {
 public:
  static constexpr std::uint32_t kPoints = 300;

  PointWorld() {
    slam::Camera::Parameters p;
    p.width_px = 640, p.height_px = 480;
    p.fx_px = p.fy_px = 400, p.cx_px = 320, p.cy_px = 240;
    rig_.cameras.push_back({"front", slam::Camera(p), {slam::q_body_forward_camera(), {0.2, -0.1, 0.3}}});
    std::mt19937_64 engine(7);
    const auto uniform = [&engine](double low, double high) {
      return low + (high - low) * static_cast<double>(engine() >> 11) * 0x1p-53;
    };
    for (std::uint32_t i = 0; i < kPoints; ++i) {
      const double x = uniform(9.0, 35.0);
      points_.emplace_back(x, uniform(-0.5, 0.6) * x, uniform(-0.4, 0.45) * x);
      slam::Descriptor& d = descriptors_.emplace_back();
      for (auto& word : d.words) word = engine();
    }
  }

  [[nodiscard]] const slam::Rig& rig() const { return rig_; }
  [[nodiscard]] const Eigen::Vector3d& point_w(std::uint32_t point) const { return points_[point]; }

  // The true pose at a step. The first two are one unit apart.
  [[nodiscard]] static slam::SE3 pose(int step) {
    if (step == 0) return {};
    const double further = step - 1;
    return {slam::so3_exp({0.0, 0.003 * step, 0.01 * step}),
            Eigen::Vector3d(0.6, 0.8, 0.0) + further * Eigen::Vector3d(0.3, 0.6, 0.02)};
  }

  // The first `points` of the world as a frame shows them.
  [[nodiscard]] std::shared_ptr<slam::Frame> frame(const slam::SE3& T_world_body, std::uint64_t number,
                                                   std::uint32_t points = kPoints) const {
    auto frame = std::make_shared<slam::Frame>();
    frame->number = number;
    frame->utime = static_cast<std::int64_t>(number) * 100000;
    slam::FrameView& view = frame->views[0];
    const auto image = std::make_shared<PointImage>();
    const slam::RigCamera& camera = rig_.cameras[0];
    const slam::SE3 T_camera_world = (T_world_body * camera.T_body_camera).inverse();
    for (std::uint32_t i = 0; i < points; ++i) {
      Eigen::Vector2d pixel;
      if (!camera.camera.project(T_camera_world * points_[i], &pixel)) continue;
      if (!camera.camera.in_image(pixel, 12.0)) continue;
      slam::Feature f;
      f.u_px = static_cast<float>(pixel.x()), f.v_px = static_cast<float>(pixel.y());
      view.set.features.push_back(f);
      view.set.descriptors.push_back(descriptors_[i]);
      image->add(i, pixel.cast<float>());
    }
    view.grid = slam::FeatureGrid(640, 480, 24, view.set.features.size());
    view.grid.build(view.set.features);
    view.image = image;
    return frame;
  }
  [[nodiscard]] std::shared_ptr<slam::Frame> frame(int step, std::uint32_t points = kPoints) const {
    return frame(pose(step), static_cast<std::uint64_t>(step), points);
  }
  [[nodiscard]] static PointImage& image(const slam::Frame& frame) {
    // Frames hold their image as const; a test changes what it shows.
    return const_cast<PointImage&>(  // NOLINT(cppcoreguidelines-pro-type-const-cast)
        dynamic_cast<const PointImage&>(*frame.views[0].image));
  }

  // Both frames at their true relative pose, with every point that both show.
  [[nodiscard]] slam::InitialPair initial_pair(std::shared_ptr<slam::Frame> first,
                                               std::shared_ptr<slam::Frame> second) const {
    slam::InitialPair pair;
    const slam::SE3 T_camera_world = rig_.cameras[0].T_body_camera.inverse();
    for (std::uint32_t i = 0; i < kPoints; ++i)
      if (image(*first).shows(i) && image(*second).shows(i))
        pair.points.push_back({image(*first).feature_of(i), image(*second).feature_of(i),
                               1.0 / (T_camera_world * points_[i]).norm()});
    pair.first = std::move(first);
    pair.second = std::move(second);
    pair.T_first_second = pose(1);
    return pair;
  }

  // The keyframe of a step at its true pose, with every sighting that tracking could find in the view.
  [[nodiscard]] slam::KeyframeRequest keyframe_request(int step, const slam::LocalView& view) const {
    slam::KeyframeRequest r;
    r.frame = frame(step);
    r.map_id = view.map_id;
    r.reference_id = view.reference_id;
    r.T_reference_body = view.T_world_reference.inverse() * pose(step);
    for (const slam::ViewLandmark& l : view.landmarks) {
      const std::uint32_t point = point_of(l.patch);
      if (!image(*r.frame).shows(point)) continue;
      const std::size_t feature = image(*r.frame).feature_of(point);
      const slam::Feature& f = r.frame->views[0].set.features[feature];
      r.sightings.push_back({l.handle, static_cast<std::int32_t>(feature), {f.u_px, f.v_px}, 0.5F});
      r.counts.push_back({l.handle, 2, 1});
    }
    return r;
  }

 private:
  slam::Rig rig_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<slam::Descriptor> descriptors_;
};

// Small capacities: what the tests make stays quick.
[[nodiscard]] inline slam::EstimatorConfig small_config() {
  slam::EstimatorConfig config;
  config.extractor.features = static_cast<int>(PointWorld::kPoints);
  config.capacity.keyframes = 40;
  config.capacity.landmarks = 2000;
  config.capacity.view_landmarks = 1000;
  config.mapping.window_landmarks = 1000;
  config.mapping.window_sightings = 6000;
  config.calibration.refine = false;
  return config;
}

// A map of the world, filled by hand with exact poses, depths and sightings.
class MappedWorld {
 public:
  explicit MappedWorld(const slam::EstimatorConfig& configuration = small_config())
      : config(configuration), map(config.capacity, world.rig(), options(config)), maker(&map, &counts) {}

  slam::KeyframeHandle add_keyframe(int step) {
    const auto frame = world.frame(step);
    const slam::KeyframeHandle handle = maker.make(*frame, PointWorld::pose(step), 1);
    frames_[handle.index] = frame;
    return handle;
  }
  std::vector<slam::KeyframeHandle> add_keyframes(int count) {
    std::vector<slam::KeyframeHandle> out;
    out.reserve(static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) out.push_back(add_keyframe(i));
    return out;
  }
  // A full landmark hosted by the first of the observers. Null where one of them does not show the point.
  slam::LandmarkHandle add_landmark(std::uint32_t point, const std::vector<slam::KeyframeHandle>& observers) {
    for (const slam::KeyframeHandle& k : observers)
      if (!image(k).shows(point)) return {};
    const slam::KeyframeHandle host = observers.front();
    const slam::LandmarkHandle handle = map.add_landmark(host, 0, image(host).feature_of(point));
    if (handle.is_null()) return handle;
    slam::Landmark& l = map.landmarks()[handle];
    l.state = slam::LandmarkState::kFull;
    const slam::SE3 T_camera_world = map.T_world_camera(map.keyframes()[host], 0).inverse();
    l.inverse_depth = 1.0 / (T_camera_world * world.point_w(point)).norm();
    l.inverse_depth_sigma = 0.001;
    for (std::size_t i = 1; i < observers.size(); ++i) add_sighting(handle, point, observers[i]);
    return handle;
  }
  void add_sighting(slam::LandmarkHandle landmark, std::uint32_t point, slam::KeyframeHandle keyframe) {
    const std::size_t feature = image(keyframe).feature_of(point);
    const slam::Feature& f = map.keyframes()[keyframe].views[0].set.features[feature];
    map.add_observation(landmark, {keyframe, static_cast<std::int32_t>(feature), {f.u_px, f.v_px}, 0.5F});
  }
  // Landmarks of the points [from, to) that all observers show.
  std::vector<slam::LandmarkHandle> add_landmarks(std::uint32_t from, std::uint32_t to,
                                                  const std::vector<slam::KeyframeHandle>& observers) {
    std::vector<slam::LandmarkHandle> out;
    for (std::uint32_t i = from; i < to; ++i)
      if (const slam::LandmarkHandle h = add_landmark(i, observers); !h.is_null()) out.push_back(h);
    return out;
  }
  // The first point from `from` on that all observers show and no landmark is on.
  [[nodiscard]] std::uint32_t free_point(const std::vector<slam::KeyframeHandle>& observers,
                                         std::uint32_t from = 0) {
    for (std::uint32_t i = from; i < PointWorld::kPoints; ++i) {
      bool is_free = true;
      for (const slam::KeyframeHandle& k : observers)
        is_free = is_free && image(k).shows(i) && landmark_at(k, i).is_null();
      if (is_free) return i;
    }
    return PointWorld::kPoints;
  }
  [[nodiscard]] slam::LandmarkHandle landmark_at(slam::KeyframeHandle keyframe, std::uint32_t point) const {
    return map.keyframes()[keyframe].views[0].landmarks[image(keyframe).feature_of(point)];
  }
  void update_covisibility(const std::vector<slam::KeyframeHandle>& keyframes) {
    for (const slam::KeyframeHandle& k : keyframes) map.update_covisibility(k);
  }
  [[nodiscard]] PointImage& image(slam::KeyframeHandle keyframe) const {
    return PointWorld::image(*frames_.at(keyframe.index));
  }
  [[nodiscard]] std::uint64_t id(slam::KeyframeHandle keyframe) const { return map.keyframes()[keyframe].id; }

  PointWorld world;
  const slam::EstimatorConfig config;
  slam::Map map;
  slam::MappingCounts counts;
  slam::KeyframeMaker maker;

 private:
  static slam::MapOptions options(const slam::EstimatorConfig& config) {
    slam::MapOptions out;
    out.wide_parallax_rad = config.landmarks.promote_parallax_rad;
    return out;
  }

  std::unordered_map<std::uint32_t, std::shared_ptr<slam::Frame>> frames_;  // by keyframe slot
};

}  // namespace farpoint::test
