// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/rig_calibrator.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "slam/mapping/window_equations.h"

namespace farpoint::slam {

namespace {

constexpr int kFirst = 0, kSecond = 1, kCameras = 2;
constexpr int kRotation = 2;    // first of its three parameters
constexpr int kDistortion = 3;  // in CalibrationDelta
// Error of the rotation between the cameras in a good calibration: a tenth of a degree, 1 sigma.
constexpr double kRotationSigma_rad = 0.002;
// A pair shows its rotation in one keyframe; a second and third tell a turn from depth.
constexpr std::ptrdiff_t kLeastKeyframes = 3;
// As Calibrator.
constexpr double kRemembered = 0.98;
constexpr double kNoticeable_px = 0.05;

class RigModelOfWindow {
 public:
  static constexpr int kSize = RigCalibrator::kSize;
  using PixelDerivative = Eigen::Matrix<double, 2, kSize>;

  explicit RigModelOfWindow(const Rig& rig) : rig_(rig) {}

  [[nodiscard]] PixelDerivative pixel_derivative(int camera, const Eigen::Vector3d& point_c,
                                                 const Eigen::Vector2d& pixel) const {
    PixelDerivative J = PixelDerivative::Zero();
    if (camera >= kCameras) return J;
    const Camera& model = rig_.cameras[static_cast<std::size_t>(camera)].camera;
    J.col(camera) = camera_derivative(model, point_c, pixel).col(kDistortion);
    if (camera == kSecond) {
      // Turned by exp(phi) in its own axes, the camera sees exp(-phi) p = p + [p]x phi.
      Eigen::Vector2d projected;
      Matrix23d d_point;
      if (model.project(point_c, &projected, &d_point)) J.middleCols<3>(kRotation) = d_point * skew(point_c);
    }
    return J;
  }
  [[nodiscard]] bool host_derivative(const Eigen::Vector3d& bearing, PixelDerivative* out) const {
    Eigen::Vector2d pixel;
    const Camera& model = rig_.cameras[kFirst].camera;
    if (!model.project(bearing, &pixel)) return false;
    out->setZero();
    out->col(kFirst) = camera_derivative(model, bearing, pixel).col(kDistortion);
    return true;
  }
  [[nodiscard]] bool measures_within(int camera) const { return camera == kSecond; }

 private:
  const Rig& rig_;
};

Eigen::Matrix<double, RigCalibrator::kSize, 1> prior_sigma(const CalibrationConfig& config) {
  Eigen::Matrix<double, RigCalibrator::kSize, 1> sigma;
  sigma << config.distortion_sigma, config.distortion_sigma, Eigen::Vector3d::Constant(kRotationSigma_rad);
  return sigma;
}

}  // namespace

RigCalibrator::RigCalibrator(const CalibrationConfig& config, const Rig& given)
    : config_(config),
      given_(given),
      rig_(given),
      prior_(prior_sigma(config).cwiseAbs2().cwiseInverse().asDiagonal()),
      information_(prior_) {}

RigCalibrator::Delta RigCalibrator::sigma() const {
  return information_.inverse().diagonal().cwiseSqrt();
}

double RigCalibrator::surprise() const {
  const Square of_images = information_ - prior_;
  const Square covariance = of_images + of_images * prior_.inverse() * of_images;
  return std::sqrt(std::max(0.0, information_vector_.dot(covariance.ldlt().solve(information_vector_))));
}

Rig RigCalibrator::changed(const Delta& delta) const {
  Rig rig = given_;
  for (int c = 0; c < kCameras; ++c) {
    CalibrationDelta of_camera = CalibrationDelta::Zero();
    of_camera[kDistortion] = delta[c];
    Camera& camera = rig.cameras[static_cast<std::size_t>(c)].camera;
    camera = refined_camera(camera, of_camera);
  }
  SE3& T_body_second = rig.cameras[kSecond].T_body_camera;
  T_body_second.q = (T_body_second.q * so3_exp(delta.tail<3>())).normalized();
  return rig;
}

bool RigCalibrator::update(const BundleProblem& problem,
                           const std::vector<Eigen::Matrix<double, 3, 2>>& d_bearing) {
  const auto free = std::count_if(problem.poses.begin(), problem.poses.end(),
                                  [](const BundleProblem::Pose& pose) { return !pose.fixed; });
  if (free < kLeastKeyframes) return false;
  const RigModelOfWindow model(rig_);
  WindowEquations equations(problem, model);
  for (std::size_t k = 0; k < problem.points.size(); ++k) equations.add(problem.points[k], d_bearing[k]);
  Square H;
  Delta g;
  if (!equations.reduce(&H, &g) || !H.allFinite() || !g.allFinite()) return false;
  H = (0.5 * config_.information_share * (H + H.transpose())).eval();
  g *= config_.information_share;
  const Square total = information_ + H;
  const Delta right = information_vector_ + H * delta_ - g;
  const Delta best = total.ldlt().solve(right);
  if (!best.allFinite()) return false;
  // Kept: the share of this window that no later window will see again; what was kept before fades.
  const auto windows = static_cast<double>(free);
  information_ = prior_ + kRemembered * (information_ - prior_) + H / windows;
  information_vector_ = kRemembered * information_vector_ + (H * delta_ - g) / windows;
  constexpr double kContradicts = 5.0, kAgrees = 3.0;
  contradicts_given_ = surprise() > (contradicts_given_ ? kAgrees : kContradicts);
  const Rig next = changed(best);
  double change_px = 0.0;
  for (std::size_t c = 0; c < kCameras; ++c) {
    if (!Camera::check(next.cameras[c].camera.parameters()).empty()) return false;
    change_px = std::max(change_px, image_change_px(rig_.cameras[c].camera, next.cameras[c].camera));
  }
  const double turned_rad =
      so3_log(rig_.cameras[kSecond].T_body_camera.q.conjugate() * next.cameras[kSecond].T_body_camera.q)
          .norm();
  change_px = std::max(change_px, turned_rad * rig_.cameras[kSecond].camera.focal_px());
  if (change_px < kNoticeable_px) return false;
  delta_ = best;
  rig_ = next;
  return true;
}

}  // namespace farpoint::slam
