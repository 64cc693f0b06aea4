// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/rig_calibrator.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "slam/mapping/window_equations.h"

namespace farpoint::slam {

namespace {

constexpr int kFirst = 0, kSecond = 1, kCameras = 2;
constexpr int kRotation = 2;    // first of its three parameters
constexpr int kDistortion = 3;  // in CalibrationDelta
// Error of the rotation between the cameras in a good calibration: a tenth of a degree, 1 sigma.
constexpr double kRotationSigma_rad = 0.002;
// Three keyframes separate the rotation between the cameras from depth.
constexpr int kLeastKeyframes = 3;

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
    : config_(config), given_(given), rig_(given), estimate_(prior_sigma(config)) {}

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
  const int free = problem.free_poses();
  if (free < kLeastKeyframes) return false;
  Eigen::Matrix<double, kSize, kSize> H;
  Delta g;
  const RigModelOfWindow model(rig_);
  if (!window_information(problem, d_bearing, model, config_.information_share, &H, &g)) return false;
  const std::optional<Delta> best = estimate_.take(H, g, free);
  if (!best) return false;
  const Rig next = changed(*best);
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
  estimate_.use(*best);
  rig_ = next;
  return true;
}

}  // namespace farpoint::slam
