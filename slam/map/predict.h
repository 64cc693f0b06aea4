// Where a landmark should appear in a camera, and how to find it there. Shared by tracking and mapping.
#pragma once

#include <array>
#include <cmath>

#include "slam/geometry/camera.h"
#include "slam/image/feature_grid.h"
#include "slam/image/kernels.h"
#include "slam/map/landmark.h"

namespace farpoint::slam {

// Sighting expected in one camera.
struct Prediction {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  Matrix23d d_pixel_d_point = Matrix23d::Zero();                // by the point in camera axes
  Eigen::Matrix2f A_target_host = Eigen::Matrix2f::Identity();  // d(pixel) / d(host pixel)
  Eigen::Vector2d d_pixel_d_inverse_depth = Eigen::Vector2d::Zero();
  float scale_change = 1.0F;  // size here / size in the host
  double view_cosine = 1.0;   // between the anchor's ray and this camera's
};

// The inputs, in world axes, as ViewLandmark keeps them.
struct PredictionInput {
  Eigen::Vector4d point_w = Eigen::Vector4d::Zero();
  Eigen::Vector3d anchor_w = Eigen::Vector3d::Zero();
  Eigen::Matrix<double, 3, 2> d_point_d_pixel = Eigen::Matrix<double, 3, 2>::Zero();
};

// Predicts many landmarks in one camera.
class Predictor {
 public:
  // `camera` must outlive the predictor.
  Predictor(const Camera& camera, const SE3& T_camera_world)
      : camera_(camera), R_(T_camera_world.rotation()), t_(T_camera_world.t) {}
  // False where the landmark does not project into the camera's image (border_px from the edge).
  [[nodiscard]] bool predict(const PredictionInput& in, double border_px, Prediction* out) const {
    return predict(in.point_w, in.anchor_w, in.d_point_d_pixel, border_px, out);
  }
  [[nodiscard]] bool predict(const Eigen::Vector4d& point_w, const Eigen::Vector3d& anchor_w,
                             const Eigen::Matrix<double, 3, 2>& d_point_d_pixel, double border_px,
                             Prediction* out) const;

 private:
  const Camera& camera_;
  const Eigen::Matrix3d R_;  // camera from world
  const Eigen::Vector3d t_;
};

// The same of a single one.
[[nodiscard]] bool predict(const PredictionInput& in, const Camera& camera, const SE3& T_camera_world,
                           double border_px, Prediction* out);

// Pyramid level on which the landmark should be detected.
[[nodiscard]] int predicted_level(int host_level, float scale_change, float scale_factor, int levels);

// Two corners so close that they show the same point.
[[nodiscard]] inline bool same_place(const Feature& a, const Feature& b) {
  constexpr float kSamePlacePx = 3.0F;
  return std::abs(a.u_px - b.u_px) < kSamePlacePx && std::abs(a.v_px - b.v_px) < kSamePlacePx;
}

struct DescriptorQuery {
  Descriptor descriptor;
  float u_px = 0, v_px = 0, radius_px = 0;
  int min_level = 0, max_level = 0;
  int max_hamming = 64;
  float ratio = 0.9F;  // best must be below ratio * second best (of another place), 1: no test
};
// Index of the best feature that `usable(index)` admits, or -1. Corners at the best one's place are no rivals
// of it: the same corner is often found on the next level too.
template <typename Usable>
[[nodiscard]] int find_descriptor(const FeatureSet& set, const FeatureGrid& grid, const DescriptorQuery& q,
                                  Usable&& usable, int* distance = nullptr) {
  constexpr int kNone = 257;
  int best = -1, best_distance = kNone, second_distance = kNone;
  bool uncertain = false;  // second_distance was taken around another best one
  const auto visit = [&](auto&& consider) {
    std::array<std::uint32_t, 64> indices;
    std::array<std::uint16_t, 64> distances;
    std::size_t count = 0;
    const auto flush = [&] {
      active_kernels().hamming(q.descriptor.words.data(), set.descriptors.front().words.data(),
                               indices.data(), static_cast<int>(count), distances.data());
      for (std::size_t k = 0; k < count; ++k) consider(std::size_t{indices[k]}, int{distances[k]});
      count = 0;
    };
    grid.visit_near(set.features, q.u_px, q.v_px, q.radius_px, q.min_level, q.max_level, [&](std::size_t i) {
      if (!usable(i)) return;
      indices[count++] = static_cast<std::uint32_t>(i);
      if (count == indices.size()) flush();
    });
    if (count > 0) flush();
  };
  const auto at_best = [&](std::size_t i) {
    return best >= 0 && same_place(set.features[static_cast<std::size_t>(best)], set.features[i]);
  };
  visit([&](std::size_t i, int d) {
    if (d < best_distance) {
      uncertain = at_best(i);
      if (!uncertain) second_distance = best_distance;
      best_distance = d;
      best = static_cast<int>(i);
    } else if (d < second_distance && !at_best(i)) {
      second_distance = d;
    }
  });
  if (best < 0 || best_distance > q.max_hamming) return -1;
  if (uncertain) {
    second_distance = kNone;
    visit([&](std::size_t i, int d) {
      if (d < second_distance && !at_best(i)) second_distance = d;
    });
  }
  if (static_cast<float>(best_distance) > q.ratio * static_cast<float>(second_distance)) return -1;
  if (distance != nullptr) *distance = best_distance;
  return best;
}

}  // namespace farpoint::slam
