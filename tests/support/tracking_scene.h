// SPDX-License-Identifier: Apache-2.0
// A rigid scene as tracking meets it: a local view of its landmarks, and frames with their features from any
// pose. Exact except what a test disturbs, so that expected values need no tolerance for noise.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "slam/config.h"
#include "slam/map/frame.h"
#include "slam/map/local_view.h"
#include "slam/map/predict.h"

namespace farpoint::slam::test {

inline constexpr std::int64_t kFrame_us = 100'000;  // between two frames

// Length of the perturbation (metres and radians) from the truth to a pose.
inline double error_of(const SE3& T, const SE3& truth) {
  return truth.boxminus_to(T).norm();
}

// What a test changes about one point.
struct ScenePoint {
  Eigen::Vector3d position_w = Eigen::Vector3d::Zero();
  Descriptor descriptor;
  LandmarkHandle handle;
  std::uint8_t host_level = 0;
  bool in_reference = false, confirmed = true;
  double inverse_depth_sigma = 0;
  float found_share = 0.5F;

  // In frames. The view does not show them.
  bool visible = true, aligns = true;
  Eigen::Vector2d corner_offset_px = Eigen::Vector2d::Zero();     // of the feature
  Eigen::Vector2d alignment_offset_px = Eigen::Vector2d::Zero();  // of the aligned pixel
};

// Aligns a patch that names its point with the projection of that point.
class SceneImage final : public FrameImage {
 public:
  struct Target {
    bool aligns = false;
    Eigen::Vector2f pixel = Eigen::Vector2f::Zero();
  };
  static constexpr float kSigma_px = 0.1F;

  explicit SceneImage(std::vector<Target> targets) : targets_(std::move(targets)) {}
  static Patch patch_of(std::uint32_t point) {
    Patch patch;
    std::memcpy(patch.pixels.data(), &point, sizeof(point));
    return patch;
  }
  [[nodiscard]] bool extract_patch(const FeatureSet&, std::size_t, Patch*) const override { return false; }
  [[nodiscard]] Alignment align(const Patch& host, const Eigen::Matrix2f&,
                                const Eigen::Vector2f& predicted_px, float max_shift_px) const override {
    std::uint32_t point = 0;
    std::memcpy(&point, host.pixels.data(), sizeof(point));
    const Target& target = targets_[point];
    Alignment a;
    a.ok = target.aligns && (target.pixel - predicted_px).norm() <= max_shift_px;
    a.pixel = target.pixel;
    a.sigma_px = kSigma_px;
    return a;
  }

 private:
  std::vector<Target> targets_;  // one a point
};

// A frame and which point each of its features shows.
struct SceneFrame {
  std::shared_ptr<Frame> frame;
  std::vector<int> point_of_feature;  // -1: none
  std::vector<int> feature_of_point;  // -1: not in the image
};

class TrackingScene {
 public:
  // Points in the image of a body at the origin, 4 to 80 map units away. No two of them look alike.
  explicit TrackingScene(int points = 300, std::uint64_t seed = 1) : random_(seed) {
    config.capacity.landmarks = 4000;
    config.capacity.view_landmarks = 1000;
    config.extractor.features = 1200;
    Camera::Parameters p;
    p.width_px = 640, p.height_px = 480;
    p.fx_px = 420, p.fy_px = 400, p.cx_px = 330, p.cy_px = 225;
    rig.cameras.push_back({"front", Camera(p), {q_body_forward_camera(), {0.4, 0.15, 0.25}}});
    for (int i = 0; i < points; ++i) this->points.push_back(random_point(points - i));
  }

  // A pose of the body, by translation and rotation vector.
  static SE3 pose(const Eigen::Vector3d& t, const Eigen::Vector3d& phi_rad = Eigen::Vector3d::Zero()) {
    return {so3_exp(phi_rad), t};
  }

  // The view of a reference keyframe at T_world_reference, which hosts all points.
  [[nodiscard]] std::shared_ptr<LocalView> view() const {
    auto v = std::make_shared<LocalView>();
    v->map_id = 1;
    v->rig = rig;
    v->reference_id = 7;
    v->T_world_reference = T_world_reference;
    v->keyframes = {{3, pose({-2, 0, 0})}, {7, T_world_reference}};
    const SE3 T_world_camera = T_world_reference * rig.cameras[0].T_body_camera;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const ScenePoint& p = points[i];
      ViewLandmark l;
      const Eigen::Vector3d ray_w = p.position_w - T_world_camera.t;
      Eigen::Vector2d pixel;
      Eigen::Vector3d bearing;
      Eigen::Matrix<double, 3, 2> d_bearing;
      EXPECT_TRUE(camera().project(T_world_camera.q.conjugate() * ray_w, &pixel));
      EXPECT_TRUE(camera().unproject(pixel, &bearing, &d_bearing));
      const double rho = 1.0 / ray_w.norm();
      l.handle = p.handle;
      l.anchor_w = T_world_camera.t;
      l.point_w.head<3>() = rho * ray_w + rho * l.anchor_w;
      l.point_w[3] = rho;
      l.d_point_d_pixel = T_world_camera.rotation() * d_bearing;
      l.inverse_depth_sigma = p.inverse_depth_sigma;
      l.descriptor = p.descriptor;
      l.patch = SceneImage::patch_of(static_cast<std::uint32_t>(i));
      l.host_level = p.host_level;
      l.in_reference = p.in_reference;
      l.confirmed = p.confirmed;
      l.found_share = p.found_share;
      l.nearness = p.in_reference ? rho : 0.0;
      v->landmarks.push_back(l);
    }
    return v;
  }

  // The frame of a body at this pose by one camera, with its features in random order.
  [[nodiscard]] SceneFrame look(const SE3& T_world_body, std::int64_t utime, int camera = 0) {
    SceneFrame out;
    out.frame = std::make_shared<Frame>();
    out.frame->utime = utime;
    out.frame->number = frames_++;
    out.frame->views = PerCamera<FrameView>(static_cast<int>(rig.cameras.size()));
    show(T_world_body, camera, &out);
    return out;
  }

  // Adds what another camera shows. Points and features of `out` are then those of this camera.
  void show(const SE3& T_world_body, int index, SceneFrame* shown) {
    SceneFrame& out = *shown;
    FrameView& view = out.frame->views[index];
    const RigCamera& rig_camera = rig.cameras[static_cast<std::size_t>(index)];
    const SE3 T_camera_world = (T_world_body * rig_camera.T_body_camera).inverse();
    const SE3 T_world_host = T_world_reference * rig.cameras[0].T_body_camera;
    std::vector<SceneImage::Target> targets(points.size());
    std::vector<std::pair<Feature, int>> features;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const ScenePoint& p = points[i];
      const Eigen::Vector3d p_c = T_camera_world * p.position_w;
      Eigen::Vector2d pixel;
      if (!p.visible || !rig_camera.camera.project(p_c, &pixel) || !rig_camera.camera.in_image(pixel))
        continue;
      targets[i] = {p.aligns, (pixel + p.alignment_offset_px).cast<float>()};
      Feature f;
      f.u_px = static_cast<float>(pixel.x() + p.corner_offset_px.x());
      f.v_px = static_cast<float>(pixel.y() + p.corner_offset_px.y());
      const double size = (p.position_w - T_world_host.t).norm() / p_c.norm();
      f.level = static_cast<std::uint8_t>(predicted_level(p.host_level, static_cast<float>(size),
                                                          static_cast<float>(config.pyramid.scale_factor),
                                                          config.pyramid.levels));
      features.emplace_back(f, static_cast<int>(i));
    }
    std::shuffle(features.begin(), features.end(), random_);
    out.point_of_feature.clear();
    out.feature_of_point.assign(points.size(), -1);
    for (const auto& [feature, point] : features) {
      out.feature_of_point[static_cast<std::size_t>(point)] = static_cast<int>(out.point_of_feature.size());
      out.point_of_feature.push_back(point);
      view.set.features.push_back(feature);
      // A few bits differ, as they do from image to image.
      Descriptor d = points[static_cast<std::size_t>(point)].descriptor;
      d.words[random_() % 4] ^= std::uint64_t{7} << (random_() % 60);
      view.set.descriptors.push_back(d);
    }
    view.image = std::make_shared<SceneImage>(std::move(targets));
    view.grid = FeatureGrid(rig_camera.camera.width_px(), rig_camera.camera.height_px(), 24, 4000);
    view.grid.build(view.set.features);
  }

  // Adds another point with its own handle: at a pixel of the reference's image, at a distance.
  ScenePoint& add_point(const Eigen::Vector2d& pixel, double distance) {
    ScenePoint p = random_point(static_cast<int>(points.size()) + 1);
    p.position_w = position_at(pixel, distance);
    return points.emplace_back(p);
  }

  // Gives each point a double that looks like it, at least 140 px away and well inside the image, for which
  // nothing searches: only a window around the right place tells the two apart.
  void add_doubles() {
    const SE3 T_camera_world = (T_world_reference * rig.cameras[0].T_body_camera).inverse();
    const std::vector<ScenePoint> originals = points;
    for (const ScenePoint& point : originals) {
      Eigen::Vector2d pixel;
      EXPECT_TRUE(camera().project(T_camera_world * point.position_w, &pixel));
      const double u_px = pixel.x() < 320 ? 340 + 0.4 * pixel.x() : 120 + 0.4 * (pixel.x() - 320);
      ScenePoint& twin = add_point({u_px, 60 + 0.75 * (480 - pixel.y())}, 20);
      twin.descriptor = point.descriptor;
      twin.confirmed = false;
    }
  }

  [[nodiscard]] const Camera& camera() const { return rig.cameras[0].camera; }
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }

  EstimatorConfig config;
  Rig rig;
  SE3 T_world_reference;
  std::vector<ScenePoint> points;

 private:
  [[nodiscard]] Eigen::Vector3d position_at(const Eigen::Vector2d& pixel, double distance) const {
    Eigen::Vector3d bearing;
    EXPECT_TRUE(camera().unproject(pixel, &bearing));
    return T_world_reference * rig.cameras[0].T_body_camera * Eigen::Vector3d(distance * bearing);
  }
  // Slots of the map run against the order of the view, so that a slot taken for an index names another
  // landmark.
  ScenePoint random_point(int number) {
    ScenePoint p;
    p.position_w = position_at({uniform(20, 620), uniform(20, 460)}, 4.0 * std::pow(20.0, uniform(0, 1)));
    for (std::uint64_t& word : p.descriptor.words) word = random_();
    p.handle.index = 2 * static_cast<std::uint32_t>(number) + 5;
    p.handle.generation = 1 + static_cast<std::uint32_t>(number) % 3;
    p.host_level = static_cast<std::uint8_t>(number % 4);
    return p;
  }

  std::mt19937_64 random_;
  std::uint64_t frames_ = 0;
};

}  // namespace farpoint::slam::test
