// SPDX-License-Identifier: Apache-2.0
// Projection models of other calibration tools, and their conversion into a model of slam/geometry/camera.h.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "slam/config.h"

namespace farpoint::daemon {

// A projection in two steps: a ray meets a surface (`shape`), then its image on the plane is distorted.
struct Lens {
  enum class Shape {
    kPinhole,          // m = xy / z
    kUnified,          // shape_parameters = xi:           m = xy / (z + xi |p|)
    kDoubleSphere,     // shape_parameters = xi, alpha     (Usenko et al. 2018, eq. 40)
    kExtendedUnified,  // shape_parameters = alpha, beta   (Khomutenko et al. 2016)
  };
  enum class Distortion {
    kOpenCv,       // k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4, OpenCV's definition and order
    kEquidistant,  // k1 k2 k3 k4 of the angle to the axis; of kPinhole only
    kFieldOfView,  // w (Devernay and Faugeras 2001)
  };
  Shape shape = Shape::kPinhole;
  Distortion distortion = Distortion::kOpenCv;
  int width_px = 0, height_px = 0;
  double fx_px = 0, fy_px = 0, cx_px = 0, cy_px = 0;
  std::array<double, 2> shape_parameters{};
  std::array<double, 12> coefficients{};

  // Point in camera axes -> pixel. Empty behind the model's range.
  [[nodiscard]] std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point_c) const;
  // The same parameters, where slam has the model.
  [[nodiscard]] std::optional<slam::Camera::Parameters> native() const;
};

// The supported camera that is nearest to a lens.
struct LensFit {
  slam::Camera::Parameters parameters;
  // Distance between both projections of the same rays, over an even grid on the image.
  double rms_px = 0.0, max_px = 0.0;
  double share = 0.0;  // of the image's pixels that have a ray in the lens
};

// A conversion that is worse than this anywhere in the image is refused. The tracker measures some tenths of
// a pixel; the error grows towards the corners, so its RMS stays at some tenths.
inline constexpr double kMaxConversionError_px = 1.0;

// Least squares over a grid of 33 x 25 pixels, into both models; the better one is returned. Empty where less
// than half of the image has rays, or neither model describes them. Takes some 50 ms.
[[nodiscard]] std::optional<LensFit> fit_lens(const Lens& lens);

}  // namespace farpoint::daemon
