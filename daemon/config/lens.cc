// SPDX-License-Identifier: Apache-2.0
#include "daemon/config/lens.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace farpoint::daemon {
namespace {

constexpr int kColumns = 33, kRows = 25;
constexpr double kMinShare = 0.5;
// Below this derivative, in focal lengths, the lens counts as folded, as in slam/geometry/camera.cc.
constexpr double kMinSlope = 1e-3;
constexpr double kMaxTheta_rad = std::numbers::pi - 1e-3;
// A pinhole's image stretches without bound; wider rays are left to Kannala-Brandt.
constexpr double kMaxPinholeTheta_rad = 1.3;

struct PixelRay {
  Eigen::Vector2d pixel;
  Eigen::Vector3d ray;
};

// A ray by its angle to the axis times its direction in the image plane: even from the axis to straight
// behind.
Eigen::Vector3d ray_at(const Eigen::Vector2d& chart) {
  const double theta = chart.norm();
  const double s = theta > 1e-12 ? std::sin(theta) / theta : 1.0;
  return {s * chart.x(), s * chart.y(), std::cos(theta)};
}

std::optional<Eigen::Vector2d> onto_plane(const Lens& lens, const Eigen::Vector3d& p) {
  const double length = p.norm();
  double depth = p.z();
  switch (lens.shape) {
    case Lens::Shape::kPinhole:
      break;
    case Lens::Shape::kUnified:
      depth += lens.shape_parameters[0] * length;
      break;
    case Lens::Shape::kDoubleSphere: {
      const auto [xi, alpha] = lens.shape_parameters;
      const double shifted = xi * length + p.z();
      depth = alpha * std::hypot(p.x(), p.y(), shifted) + (1.0 - alpha) * shifted;
      break;
    }
    case Lens::Shape::kExtendedUnified: {
      const auto [alpha, beta] = lens.shape_parameters;
      const double d = std::sqrt(beta * p.head<2>().squaredNorm() + p.z() * p.z());
      depth = alpha * d + (1.0 - alpha) * p.z();
      break;
    }
  }
  if (!(depth > 1e-6 * length)) return {};
  return Eigen::Vector2d(p.head<2>() / depth);
}

std::optional<Eigen::Vector2d> distort_opencv(const std::array<double, 12>& c, const Eigen::Vector2d& m) {
  const auto& [k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4] = c;
  const double x = m.x(), y = m.y(), r2 = m.squaredNorm(), r4 = r2 * r2, r6 = r4 * r2;
  const double below = 1.0 + k4 * r2 + k5 * r4 + k6 * r6;
  if (!(below > 1e-6)) return {};
  const double radial = (1.0 + k1 * r2 + k2 * r4 + k3 * r6) / below;
  return Eigen::Vector2d(x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x) + s1 * r2 + s2 * r4,
                         y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y + s3 * r2 + s4 * r4);
}

Eigen::Vector2d equidistant(const std::array<double, 12>& c, const Eigen::Vector3d& p) {
  const double rho = p.head<2>().norm(), theta = std::atan2(rho, p.z()), t2 = theta * theta;
  const double theta_d = theta * (1.0 + t2 * (c[0] + t2 * (c[1] + t2 * (c[2] + t2 * c[3]))));
  return rho > 0.0 ? Eigen::Vector2d(p.head<2>() * (theta_d / rho)) : Eigen::Vector2d(0.0, 0.0);
}

Eigen::Vector2d distort_field_of_view(double w, const Eigen::Vector2d& m) {
  const double r = m.norm();
  if (r < 1e-12) return m * (2.0 * std::tan(0.5 * w) / w);
  return m * (std::atan(2.0 * r * std::tan(0.5 * w)) / (w * r));
}

std::optional<Eigen::Vector2d> distorted(const Lens& lens, const Eigen::Vector3d& point_c) {
  if (lens.shape == Lens::Shape::kPinhole && lens.distortion == Lens::Distortion::kEquidistant)
    return equidistant(lens.coefficients, point_c);
  const std::optional<Eigen::Vector2d> m = onto_plane(lens, point_c);
  if (!m) return {};
  if (lens.distortion == Lens::Distortion::kFieldOfView)
    return distort_field_of_view(lens.coefficients[0], *m);
  return distort_opencv(lens.coefficients, *m);
}

// d(pixel)/d(chart) by differences. Empty beyond the lens's range.
std::optional<Eigen::Matrix2d> derivative_at(const Lens& lens, const Eigen::Vector2d& chart) {
  constexpr double kStep_rad = 1e-6;
  Eigen::Matrix2d j;
  for (int i = 0; i < 2; ++i) {
    const Eigen::Vector2d step = kStep_rad * Eigen::Vector2d::Unit(i);
    const std::optional<Eigen::Vector2d> after = lens.project(ray_at(chart + step)),
                                         before = lens.project(ray_at(chart - step));
    if (!after || !before) return {};
    j.col(i) = (*after - *before) / (2.0 * kStep_rad);
  }
  return j;
}

// Newton from a chart nearby. False where the lens folds or ends before the pixel.
bool refine(const Lens& lens, const Eigen::Vector2d& pixel, Eigen::Vector2d* chart) {
  for (int i = 0; i < 20; ++i) {
    const std::optional<Eigen::Vector2d> here = lens.project(ray_at(*chart));
    const std::optional<Eigen::Matrix2d> j = derivative_at(lens, *chart);
    if (!here || !j) return false;
    if (!(j->determinant() > kMinSlope * lens.fx_px * lens.fy_px)) return false;
    *chart += j->inverse() * (pixel - *here);
    if (!(chart->norm() < kMaxTheta_rad)) return false;
    if ((pixel - *here).norm() < 1e-7) return true;
  }
  return false;
}

// Follows the line from the principal point to the pixel, so that a folded lens is not entered from behind.
bool unproject(const Lens& lens, const Eigen::Vector2d& pixel, Eigen::Vector3d* ray) {
  constexpr int kSteps = 12;
  const Eigen::Vector2d centre(lens.cx_px, lens.cy_px);
  Eigen::Vector2d chart(0.0, 0.0);
  for (int step = 1; step <= kSteps; ++step) {
    const double share = static_cast<double>(step) / kSteps;
    if (!refine(lens, centre + share * (pixel - centre), &chart)) return false;
  }
  *ray = ray_at(chart);
  return true;
}

std::vector<PixelRay> rays_of(const Lens& lens) {
  std::vector<PixelRay> rays;
  for (int i = 0; i < kRows; ++i) {
    for (int k = 0; k < kColumns; ++k) {
      PixelRay sample;
      sample.pixel = {(lens.width_px - 1.0) * k / (kColumns - 1), (lens.height_px - 1.0) * i / (kRows - 1)};
      if (unproject(lens, sample.pixel, &sample.ray)) rays.push_back(sample);
    }
  }
  return rays;
}

// ---- least squares ----

constexpr int kParameters = 9;  // fx fy cx cy, and 4 or 5 coefficients
using Vector = Eigen::Matrix<double, kParameters, 1>;

Lens with(const Lens& lens, const Vector& x) {
  Lens changed = lens;
  changed.fx_px = x[0];
  changed.fy_px = x[1];
  changed.cx_px = x[2];
  changed.cy_px = x[3];
  for (int i = 4; i < kParameters; ++i) changed.coefficients[static_cast<std::size_t>(i - 4)] = x[i];
  return changed;
}

Vector parameters_of(const Lens& lens) {
  Vector x;
  x << lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px, lens.coefficients[0], lens.coefficients[1],
      lens.coefficients[2], lens.coefficients[3], lens.coefficients[4];
  return x;
}

double cost_of(const Lens& lens, const std::vector<PixelRay>& rays) {
  double cost = 0.0;
  for (const PixelRay& sample : rays) {
    const std::optional<Eigen::Vector2d> pixel = lens.project(sample.ray);
    if (!pixel) return std::numeric_limits<double>::infinity();
    cost += (*pixel - sample.pixel).squaredNorm();
  }
  return cost;
}

// Levenberg-Marquardt over the first `count` parameters. Both models are polynomials in them.
Lens fit(Lens lens, int count, const std::vector<PixelRay>& rays) {
  using Normal = Eigen::Matrix<double, kParameters, kParameters>;
  double cost = cost_of(lens, rays), damping = 1e-6;
  for (int iteration = 0; iteration < 60 && std::isfinite(cost); ++iteration) {
    const Vector x = parameters_of(lens);
    Normal h = Normal::Zero();
    Vector g = Vector::Zero();
    std::array<Lens, kParameters> stepped;
    Vector steps = Vector::Zero();
    for (int i = 0; i < count; ++i) {
      steps[i] = 1e-6 * (1.0 + std::abs(x[i]));
      Vector moved = x;
      moved[i] += steps[i];
      stepped[static_cast<std::size_t>(i)] = with(lens, moved);
    }
    for (const PixelRay& sample : rays) {
      const std::optional<Eigen::Vector2d> here = lens.project(sample.ray);
      Eigen::Matrix<double, 2, kParameters> j = Eigen::Matrix<double, 2, kParameters>::Zero();
      for (int i = 0; i < count; ++i) {
        const std::optional<Eigen::Vector2d> there = stepped[static_cast<std::size_t>(i)].project(sample.ray);
        if (here && there) j.col(i) = (*there - *here) / steps[i];
      }
      h += j.transpose() * j;
      g += j.transpose() * (sample.pixel - *here);
    }
    for (int i = count; i < kParameters; ++i) h(i, i) = 1.0;
    h.diagonal() *= 1.0 + damping;
    const Lens next = with(lens, x + h.ldlt().solve(g));
    const double next_cost = cost_of(next, rays);
    if (!(next_cost < cost)) {
      damping *= 10.0;
      if (damping > 1e6) break;
      continue;
    }
    const bool done = cost - next_cost < 1e-12 * cost;
    lens = next;
    cost = next_cost;
    damping = std::max(0.1 * damping, 1e-12);
    if (done) break;
  }
  return lens;
}

// The error by slam's own projection, which ends where the distortion folds. Empty where a ray has no pixel.
std::optional<LensFit> judge(const slam::Camera::Parameters& parameters, const std::vector<PixelRay>& rays) {
  if (!slam::Camera::check(parameters).empty()) return {};
  const slam::Camera camera(parameters);
  LensFit result;
  result.parameters = parameters;
  double sum = 0.0;
  for (const PixelRay& sample : rays) {
    Eigen::Vector2d pixel;
    if (!camera.project(sample.ray, &pixel)) return {};
    const double error = (pixel - sample.pixel).norm();
    sum += error * error;
    result.max_px = std::max(result.max_px, error);
  }
  result.rms_px = std::sqrt(sum / static_cast<double>(rays.size()));
  result.share = static_cast<double>(rays.size()) / (kColumns * kRows);
  return result;
}

double widest_rad(const std::vector<PixelRay>& rays) {
  double widest = 0.0;
  for (const PixelRay& sample : rays)
    widest = std::max(widest, std::atan2(sample.ray.head<2>().norm(), sample.ray.z()));
  return widest;
}

}  // namespace

std::optional<Eigen::Vector2d> Lens::project(const Eigen::Vector3d& point_c) const {
  const std::optional<Eigen::Vector2d> m = distorted(*this, point_c);
  if (!m) return {};
  const Eigen::Vector2d pixel(fx_px * m->x() + cx_px, fy_px * m->y() + cy_px);
  if (!pixel.allFinite()) return {};
  return pixel;
}

std::optional<slam::Camera::Parameters> Lens::native() const {
  const bool is_equidistant = distortion == Distortion::kEquidistant;
  const std::size_t used = is_equidistant ? 4 : 5;
  const bool more =
      std::any_of(coefficients.begin() + used, coefficients.end(), [](double c) { return c != 0; });
  if (shape != Shape::kPinhole || distortion == Distortion::kFieldOfView || more) return {};
  slam::Camera::Parameters p;
  p.model = is_equidistant ? slam::CameraModel::kKannalaBrandt : slam::CameraModel::kPinholeRadtan;
  p.width_px = width_px;
  p.height_px = height_px;
  p.fx_px = fx_px;
  p.fy_px = fy_px;
  p.cx_px = cx_px;
  p.cy_px = cy_px;
  std::copy_n(coefficients.begin(), used, p.distortion.begin());
  return p;
}

std::optional<LensFit> fit_lens(const Lens& lens) {
  const std::vector<PixelRay> rays = rays_of(lens);
  if (static_cast<double>(rays.size()) < kMinShare * kColumns * kRows) return {};
  const std::optional<Eigen::Matrix2d> scale = derivative_at(lens, {0.0, 0.0});
  if (!scale) return {};
  Lens start = lens;
  start.shape = Lens::Shape::kPinhole;
  start.coefficients = {};
  start.fx_px = (*scale)(0, 0);
  start.fy_px = (*scale)(1, 1);
  std::optional<LensFit> best;
  for (const Lens::Distortion model : {Lens::Distortion::kOpenCv, Lens::Distortion::kEquidistant}) {
    const bool pinhole = model == Lens::Distortion::kOpenCv;
    if (pinhole && widest_rad(rays) > kMaxPinholeTheta_rad) continue;
    start.distortion = model;
    const std::optional<slam::Camera::Parameters> found =
        fit(start, pinhole ? kParameters : kParameters - 1, rays).native();
    const std::optional<LensFit> judged = found ? judge(*found, rays) : std::nullopt;
    if (judged && (!best || judged->max_px < best->max_px)) best = judged;
  }
  return best;
}

}  // namespace farpoint::daemon
