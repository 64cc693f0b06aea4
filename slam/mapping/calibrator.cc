// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/calibrator.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "slam/mapping/window_equations.h"

namespace farpoint::slam {

namespace {

constexpr int kParameters = 4;
// Of what windows said, this share is remembered from one to the next, about 50 windows. Each spoke of a map
// that the calibration of its day had bent; kept for good, the first of them would outvote all that come
// later.
constexpr double kRemembered = 0.98;
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

Eigen::Matrix4d prior_information(const CalibrationConfig& config) {
  const Vector4 sigma(config.focal_sigma, config.centre_sigma_px, config.centre_sigma_px,
                      config.distortion_sigma);
  return sigma.cwiseAbs2().cwiseInverse().asDiagonal();
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
    : config_(config),
      given_(given),
      index_(index),
      camera_(given),
      prior_(prior_information(config)),
      information_(prior_) {}

CalibrationDelta Calibrator::sigma() const {
  return information_.inverse().diagonal().cwiseSqrt();
}

double Calibrator::surprise() const {
  const Eigen::Matrix4d of_images = information_ - prior_;
  const Eigen::Matrix4d covariance = of_images + of_images * prior_.inverse() * of_images;
  return std::sqrt(std::max(0.0, information_vector_.dot(covariance.ldlt().solve(information_vector_))));
}

CalibrationDelta Calibrator::wanted_by_images() const {
  const Eigen::Matrix4d of_images = information_ - prior_;
  const CalibrationDelta wanted = of_images.ldlt().solve(information_vector_);
  return wanted.allFinite() ? wanted : CalibrationDelta::Zero();
}

Calibrator::Quadratic Calibrator::window_information(
    const BundleProblem& problem, const std::vector<Eigen::Matrix<double, 3, 2>>& d_bearing) const {
  Quadratic out;
  const CameraModelOfWindow model(camera_, index_);
  WindowEquations equations(problem, model);
  for (std::size_t k = 0; k < problem.points.size(); ++k) equations.add(problem.points[k], d_bearing[k]);
  if (!equations.reduce(&out.H, &out.g)) return out;
  out.H = (0.5 * (out.H + out.H.transpose())).eval();
  out.usable = out.H.allFinite() && out.g.allFinite();
  return out;
}

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
  int free = 0;
  for (const auto& pose : problem.poses) free += pose.fixed ? 0 : 1;
  if (free < config_.min_keyframes) return false;
  Quadratic q = window_information(problem, d_bearing);
  if (!q.usable) return false;
  // Residuals are not independent (one patch, one wrong assumption about its surface): count them for less.
  q.H *= config_.information_share;
  q.g *= config_.information_share;
  const Eigen::Matrix4d total = information_ + q.H;
  const Vector4 right = information_vector_ + q.H * delta_ - q.g;
  const Vector4 best = total.ldlt().solve(right);
  if (!best.allFinite()) return false;
  // Kept: the share of this window that no later window will see again; what was kept before fades.
  information_ = prior_ + kRemembered * (information_ - prior_) + q.H / free;
  information_vector_ = kRemembered * information_vector_ + (q.H * delta_ - q.g) / free;
  constexpr double kContradicts = 5.0, kAgrees = 3.0;
  contradicts_given_ = surprise() > (contradicts_given_ ? kAgrees : kContradicts);
  constexpr double kNoticeable_px = 0.05;
  const Camera next = refined_camera(given_, best);
  if (image_change_px(camera_, next) < kNoticeable_px) return false;
  if (!Camera::check(next.parameters()).empty()) return false;
  delta_ = best;
  camera_ = next;
  return true;
}

}  // namespace farpoint::slam
