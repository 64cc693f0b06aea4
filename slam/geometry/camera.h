// SPDX-License-Identifier: Apache-2.0
// Camera models: pinhole + radial-tangential (k1 k2 p1 p2 k3) and Kannala-Brandt (k1..k4, "equidistant").
//
// Camera axes: x right, y down, z forward. Pixels: (0,0) is the centre of the upper left pixel, u right, v
// down.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>

#include "slam/geometry/se3.h"

namespace farpoint::slam {

enum class CameraModel { kPinholeRadtan, kKannalaBrandt };

// A calibrated camera. Cheap to copy; every method is const, allocates nothing and never throws.
class Camera {
 public:
  // radtan:          distortion = k1 k2 p1 p2 k3      (OpenCV's definition)
  // Kannala-Brandt:  distortion = k1 k2 k3 k4 (0)     theta_d = theta (1 + k1 theta^2 + ... + k4 theta^8)
  struct Parameters {
    CameraModel model = CameraModel::kPinholeRadtan;
    int width_px = 0, height_px = 0;
    double fx_px = 0, fy_px = 0, cx_px = 0, cy_px = 0;
    std::array<double, 5> distortion{};
  };

  Camera() = default;
  // Computes the largest angle at which the distortion is still monotonic, so that project() and in_view()
  // never fold far-off-axis points back into the image. Precondition: check(p) is empty.
  explicit Camera(const Parameters& p);

  // Empty where the parameters make a usable camera, else a sentence saying what is wrong and what was
  // expected (size > 0, focal lengths > 0 and finite, principal point within the image, finite distortion,
  // ...).
  [[nodiscard]] static std::string check(const Parameters& p);

  [[nodiscard]] const Parameters& parameters() const { return p_; }
  [[nodiscard]] int width_px() const { return p_.width_px; }
  [[nodiscard]] int height_px() const { return p_.height_px; }
  // Mean focal length, for turning pixels into radians.
  [[nodiscard]] double focal_px() const { return 0.5 * (p_.fx_px + p_.fy_px); }

  // Point in camera axes (any positive length) -> pixel. False where the point is behind the camera or beyond
  // the monotonic range; the pixel may lie outside the image.
  [[nodiscard]] bool project(const Eigen::Vector3d& point_c, Eigen::Vector2d* pixel) const;
  // The same with the 2x3 derivative d(pixel)/d(point_c).
  [[nodiscard]] bool project(const Eigen::Vector3d& point_c, Eigen::Vector2d* pixel,
                             Matrix23d* d_pixel_d_point) const;
  // Pixel -> unit bearing in camera axes. False where the pixel has no ray (beyond the model's range).
  // Accurate to 1e-9 rad inside the image.
  [[nodiscard]] bool unproject(const Eigen::Vector2d& pixel, Eigen::Vector3d* bearing_c) const;
  // The same with the 3x2 derivative d(bearing_c)/d(pixel).
  [[nodiscard]] bool unproject(const Eigen::Vector2d& pixel, Eigen::Vector3d* bearing_c,
                               Eigen::Matrix<double, 3, 2>* d_bearing_d_pixel) const;

  // True where the pixel lies in the image at least border_px away from its edge.
  [[nodiscard]] bool in_image(const Eigen::Vector2d& pixel, double border_px = 0.0) const {
    return pixel.x() >= border_px && pixel.y() >= border_px && pixel.x() <= p_.width_px - 1 - border_px &&
           pixel.y() <= p_.height_px - 1 - border_px;
  }

 private:
  Parameters p_;
  double max_theta_rad_ = 0.0;  // beyond this angle from the optical axis nothing projects
  double max_radius_ = 0.0;     // radtan: tan(max_theta_rad_); Kannala-Brandt: theta_d(max_theta_rad_)
};

}  // namespace farpoint::slam
