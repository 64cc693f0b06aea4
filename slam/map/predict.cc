// SPDX-License-Identifier: Apache-2.0
#include "slam/map/predict.h"

#include <algorithm>
#include <cmath>

namespace farpoint::slam {

bool Predictor::predict(const Eigen::Vector4d& point_w, const Eigen::Vector3d& anchor_w,
                        const Eigen::Matrix<double, 3, 2>& d_point_d_pixel, double border_px,
                        Prediction* out) const {
  const double rho = point_w[3];
  const Eigen::Vector3d p_c = R_ * point_w.head<3>() + rho * t_;
  // Most landmarks of a view lie outside the image: they cost no derivatives.
  if (!camera_.project(p_c, &out->pixel) || !camera_.in_image(out->pixel, border_px)) return false;
  if (!camera_.project(p_c, &out->pixel, &out->d_pixel_d_point)) return false;
  const Matrix23d d_world = out->d_pixel_d_point * R_;
  out->A_target_host = (d_world * d_point_d_pixel).cast<float>();
  // point_w = f_w + rho * anchor_w, hence the camera point changes by R anchor_w + t with rho.
  out->d_pixel_d_inverse_depth = out->d_pixel_d_point * (R_ * anchor_w + t_);
  // |p_c| = rho * distance here; 1 = rho * distance from the anchor.
  const double distance_ratio = p_c.norm();
  out->scale_change = static_cast<float>(1.0 / std::max(distance_ratio, 1e-6));
  const Eigen::Vector3d anchor_ray = point_w.head<3>() - rho * anchor_w;
  out->view_cosine = (R_ * anchor_ray).dot(p_c) / std::max(anchor_ray.norm() * distance_ratio, 1e-12);
  return true;
}

bool predict(const PredictionInput& in, const Camera& camera, const SE3& T_camera_world, double border_px,
             Prediction* out) {
  return Predictor(camera, T_camera_world).predict(in, border_px, out);
}

int predicted_level(int host_level, float scale_change, float scale_factor, int levels) {
  const float shift = std::log(std::max(scale_change, 1e-3F)) / std::log(scale_factor);
  return std::clamp(host_level + static_cast<int>(std::lround(shift)), 0, levels - 1);
}

}  // namespace farpoint::slam
