// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/calibrator.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "slam/mapping/window_equations.h"

namespace farpoint::slam {

namespace {

constexpr int kParameters = 4;
using Vector4 = Eigen::Vector4d;

class CameraModelOfWindow {
 public:
  static constexpr int kSize = kParameters;
  using PixelDerivative = CameraDerivative;

  CameraModelOfWindow(const Camera& camera, int index) : camera_(camera), index_(index) {}

  [[nodiscard]] PixelDerivative pixel_derivative(int camera, const Eigen::Vector3d& point_c,
                                                 const Eigen::Vector2d& pixel) const {
    if (camera != index_) return PixelDerivative::Zero();
    return camera_derivative(camera_, point_c, pixel);
  }
  [[nodiscard]] bool host_derivative(const Eigen::Vector3d& bearing, PixelDerivative* out) const {
    Eigen::Vector2d pixel;
    if (!camera_.project(bearing, &pixel)) return false;
    *out = camera_derivative(camera_, bearing, pixel);
    return true;
  }
  [[nodiscard]] bool measures_within(int /*camera*/) const { return false; }

 private:
  const Camera& camera_;
  const int index_;  // of camera_ in the rig
};

Vector4 prior_sigma(const CalibrationConfig& config) {
  return {config.focal_sigma, config.centre_sigma_px, config.centre_sigma_px, config.distortion_sigma};
}

}  // namespace

CameraDerivative camera_derivative(const Camera& camera, const Eigen::Vector3d& point_c,
                                   const Eigen::Vector2d& pixel) {
  const Camera::Parameters& p = camera.parameters();
  const double x = point_c.x(), y = point_c.y(), z = point_c.z();
  // The first coefficient k1 moves the distorted (x, y) on the plane z = 1 by so much of (x, y) itself:
  // radial-tangential r^2 / z, Kannala-Brandt theta^3 / rho.
  double factor = 0.0;
  if (p.model == CameraModel::kPinholeRadtan) {
    factor = (x * x + y * y) / (z * z * z);
  } else if (const double rho = std::hypot(x, y); rho > 0.0) {
    const double theta = std::atan2(rho, z);
    factor = theta * theta * theta / rho;
  }
  CameraDerivative J;
  J.col(0) = pixel - Eigen::Vector2d(p.cx_px, p.cy_px);  // delta[0] is the logarithm of the focal length
  J.col(1) = Eigen::Vector2d::UnitX();
  J.col(2) = Eigen::Vector2d::UnitY();
  J.col(3) = Eigen::Vector2d(p.fx_px * x, p.fy_px * y) * factor;
  return J;
}

Camera refined_camera(const Camera& given, const CalibrationDelta& delta) {
  Camera::Parameters p = given.parameters();
  p.fx_px *= std::exp(delta[0]);
  p.fy_px *= std::exp(delta[0]);
  p.cx_px += delta[1];
  p.cy_px += delta[2];
  p.distortion[0] += delta[3];
  return Camera(p);
}

Calibrator::Calibrator(const CalibrationConfig& config, const Camera& given, int index)
    : config_(config), given_(given), index_(index), estimate_(prior_sigma(config)), camera_(given) {}

double image_change_px(const Camera& from, const Camera& to) {
  // Largest move of a ray's pixel over the image's edge.
  const double w = from.width_px() - 1, h = from.height_px() - 1;
  double largest = 0.0;
  for (const Eigen::Vector2d& pixel :
       {Eigen::Vector2d(0, 0), Eigen::Vector2d(w, 0), Eigen::Vector2d(0, h), Eigen::Vector2d(w, h),
        Eigen::Vector2d(0, h / 2), Eigen::Vector2d(w, h / 2)}) {
    Eigen::Vector3d ray;
    Eigen::Vector2d moved;
    if (from.unproject(pixel, &ray) && to.project(ray, &moved))
      largest = std::max(largest, (moved - pixel).norm());
  }
  return largest;
}

bool Calibrator::update(const BundleProblem& problem,
                        const std::vector<Eigen::Matrix<double, 3, 2>>& d_bearing) {
  const int free = problem.free_poses();
  if (free < config_.min_keyframes) return false;
  Eigen::Matrix4d H;
  Vector4 g;
  const CameraModelOfWindow model(camera_, index_);
  if (!window_information(problem, d_bearing, model, config_.information_share, &H, &g)) return false;
  const std::optional<Vector4> best = estimate_.take(H, g, free);
  if (!best) return false;
  const Camera next = refined_camera(given_, *best);
  if (image_change_px(camera_, next) < kNoticeable_px) return false;
  if (!Camera::check(next.parameters()).empty()) return false;
  estimate_.use(*best);
  camera_ = next;
  return true;
}

}  // namespace farpoint::slam
