// SPDX-License-Identifier: Apache-2.0
// Where a landmark should appear in a camera. Shared by tracking and mapping.
#pragma once

#include <Eigen/Core>

#include "slam/geometry/camera.h"
#include "slam/geometry/se3.h"

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

// What a prediction is made from, in world axes, as ViewLandmark keeps it.
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
  // Returns false where the landmark projects outside the image or within border_px of its edge.
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

// The same of one landmark.
[[nodiscard]] bool predict(const PredictionInput& in, const Camera& camera, const SE3& T_camera_world,
                           double border_px, Prediction* out);

// Pyramid level on which the landmark should be detected.
[[nodiscard]] int predicted_level(int host_level, float scale_change, float scale_factor, int levels);

// Whether a patch can be matched where it is predicted. From more than 60 degrees beside the anchor's ray it
// looks different; beyond these changes of size it has too few pixels left.
[[nodiscard]] inline bool is_matchable(const Prediction& p) {
  constexpr double kMinViewCosine = 0.5;
  constexpr float kMinScaleChange = 0.3F, kMaxScaleChange = 3.3F;
  return p.view_cosine >= kMinViewCosine && p.scale_change > kMinScaleChange &&
         p.scale_change < kMaxScaleChange;
}

}  // namespace farpoint::slam
