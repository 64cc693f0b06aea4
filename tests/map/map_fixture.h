// SPDX-License-Identifier: Apache-2.0
// A map over a simple camera, filled by hand: what the tests of the map need in place of images.
#pragma once

#include <algorithm>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "slam/map/map.h"

namespace farpoint::slam {

// Gives every feature a patch that names it, but those of level kNoPatch: they lie "too close to the edge".
class FakeImage final : public FrameImage {
 public:
  static constexpr std::uint8_t kNoPatch = 7;
  [[nodiscard]] bool extract_patch(const FeatureSet& set, std::size_t index, Patch* patch) const override {
    if (set.features[index].level == kNoPatch) return false;
    patch->pixels.fill(static_cast<std::uint8_t>(index));
    patch->level = set.features[index].level;
    return true;
  }
  [[nodiscard]] Alignment align(const Patch&, const Eigen::Matrix2f&, const Eigen::Vector2f&,
                                float) const override {
    return {};
  }
};

inline Rig two_camera_rig() {
  Camera::Parameters p;
  p.width_px = 640, p.height_px = 480;
  p.fx_px = 420, p.fy_px = 425, p.cx_px = 322, p.cy_px = 239;
  p.distortion = {-0.2, 0.05, 0.0003, -0.0002, 0.0};
  Rig rig;
  rig.cameras.push_back({"front", Camera(p), {q_body_forward_camera(), {0.2, 0.0, 0.1}}});
  p.model = CameraModel::kKannalaBrandt;
  p.distortion = {0.01, -0.004, 0.001, 0.0, 0.0};
  rig.cameras.push_back(
      {"side", Camera(p), SE3{so3_exp({0, 0, 0.3}), {0.1, 0.3, 0.0}} * rig.cameras[0].T_body_camera});
  return rig;
}

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(engine_() % n); }
  std::uint64_t bits() { return engine_(); }
  Eigen::Vector3d vector(double size) {
    return {uniform(-size, size), uniform(-size, size), uniform(-size, size)};
  }

 private:
  std::mt19937_64 engine_;
};

// `features` corners anywhere in the image.
inline KeyframeView make_view(const Camera& model, int features, Random* random) {
  KeyframeView view;
  view.image = std::make_shared<FakeImage>();
  for (int i = 0; i < features; ++i) {
    Feature f;
    f.u_px = static_cast<float>(random->uniform(5, 630));
    f.v_px = static_cast<float>(random->uniform(5, 470));
    f.level = static_cast<std::uint8_t>(random->below(4));
    Descriptor d;
    for (auto& word : d.words) word = random->bits();
    Eigen::Vector3d bearing;
    if (!model.unproject({f.u_px, f.v_px}, &bearing)) {
      --i;
      continue;
    }
    view.set.features.push_back(f);
    view.set.descriptors.push_back(d);
    view.bearings.emplace_back(bearing.cast<float>());
  }
  return view;
}

// A keyframe to which one camera gave an image.
inline Keyframe make_keyframe(const Rig& rig, int camera, const SE3& T_world_body, int features,
                              Random* random) {
  Keyframe k;
  k.T_world_body = T_world_body;
  k.views = PerCamera<KeyframeView>(static_cast<int>(rig.cameras.size()));
  k.views[camera] = make_view(rig.cameras[static_cast<std::size_t>(camera)].camera, features, random);
  return k;
}

// The first camera that gave it an image.
inline int camera_of(const Keyframe& keyframe) {
  int camera = 0;
  while (camera + 1 < keyframe.views.size() && keyframe.views[camera].landmarks.empty()) ++camera;
  return camera;
}

inline SE3 random_pose(Random* random) {
  return {so3_exp(random->vector(0.3)), random->vector(5.0)};
}

// The sighting of a feature where it is, with an error of 1 px; of a thinned keyframe's, somewhere.
inline Observation sighting(const Map& map, KeyframeHandle keyframe, std::size_t feature, int camera) {
  const std::vector<Feature>& features = map.keyframes()[keyframe].views[camera].set.features;
  const Feature f = feature < features.size() ? features[feature] : Feature{};
  return {keyframe, static_cast<std::int32_t>(feature), {f.u_px, f.v_px}, 1.0F,
          0,        static_cast<std::uint8_t>(camera)};
}
inline Observation sighting(const Map& map, KeyframeHandle keyframe, std::size_t feature) {
  return sighting(map, keyframe, feature, camera_of(map.keyframes()[keyframe]));
}
inline LandmarkHandle add_landmark(Map* map, KeyframeHandle keyframe, std::size_t feature) {
  return map->add_landmark(keyframe, camera_of(map->keyframes()[keyframe]), feature);
}

template <typename T>
std::vector<Handle<T>> alive(const Pool<T>& pool) {
  std::vector<Handle<T>> out;
  pool.for_each([&](Handle<T> h, const T&) { out.push_back(h); });
  return out;
}

}  // namespace farpoint::slam
