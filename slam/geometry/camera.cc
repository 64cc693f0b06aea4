// SPDX-License-Identifier: Apache-2.0
#include "slam/geometry/camera.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

namespace farpoint::slam {

namespace {

using Distortion = std::array<double, 5>;

// A pinhole image stretches without bound towards 90 degrees; it is cut off at 89.4 degrees (radius 100).
constexpr double kMaxPinholeRadius = 100.0;
// Straight behind a fisheye every direction in the image plane is as good as any other; stop just before.
constexpr double kMaxFisheyeTheta_rad = std::numbers::pi - 1e-3;
// Smallest derivative of the distortion that still counts as monotonic: below it Newton's step, and the noise
// of a pixel turned into an angle, grow without use.
constexpr double kMinSlope = 1e-3;
// A calibration that leaves less of its own image with rays than this is a wrong one (sign or order of
// coefficients).
constexpr double kMinUsableShare = 0.5;

// --- radial-tangential, on the plane z = 1 ---

double radial_factor(const Distortion& d, double r2) {
  return 1.0 + r2 * (d[0] + r2 * (d[1] + r2 * d[4]));
}

// d(r * radial_factor)/dr.
double radial_slope(const Distortion& d, double r2) {
  return 1.0 + r2 * (3.0 * d[0] + r2 * (5.0 * d[1] + r2 * 7.0 * d[4]));
}

// Lower bound of the smallest eigenvalue of the 2x2 derivative of the distortion over the circle of radius r.
// The radial part has the eigenvalues radial_factor and radial_slope, the tangential part none below -6 |p|
// r.
double radtan_slope_bound(const Distortion& d, double r) {
  const double r2 = r * r;
  return std::min(radial_factor(d, r2), radial_slope(d, r2)) - 6.0 * std::hypot(d[2], d[3]) * r;
}

Eigen::Vector2d radtan_distort(const Distortion& d, const Eigen::Vector2d& m) {
  const double x = m.x(), y = m.y(), r2 = m.squaredNorm(), xy = x * y;
  const double k = radial_factor(d, r2);
  return {k * x + 2.0 * d[2] * xy + d[3] * (r2 + 2.0 * x * x),
          k * y + d[2] * (r2 + 2.0 * y * y) + 2.0 * d[3] * xy};
}

// d(distorted)/d(undistorted). Symmetric: the distortion is the gradient of a function, so where this is
// positive definite over a disc, no two points of the disc share an image.
Eigen::Matrix2d radtan_derivative(const Distortion& d, const Eigen::Vector2d& m) {
  const double x = m.x(), y = m.y(), r2 = m.squaredNorm();
  const double k = radial_factor(d, r2);
  const double dk_dr2 = d[0] + r2 * (2.0 * d[1] + r2 * 3.0 * d[4]);
  Eigen::Matrix2d j;
  j(0, 0) = k + 2.0 * x * x * dk_dr2 + 2.0 * d[2] * y + 6.0 * d[3] * x;
  j(0, 1) = 2.0 * x * y * dk_dr2 + 2.0 * d[2] * x + 2.0 * d[3] * y;
  j(1, 0) = j(0, 1);
  j(1, 1) = k + 2.0 * y * y * dk_dr2 + 6.0 * d[2] * y + 2.0 * d[3] * x;
  return j;
}

// --- Kannala-Brandt ---

double fisheye_theta_d(const Distortion& d, double theta) {
  const double t2 = theta * theta;
  return theta * (1.0 + t2 * (d[0] + t2 * (d[1] + t2 * (d[2] + t2 * d[3]))));
}

double fisheye_slope(const Distortion& d, double theta) {
  const double t2 = theta * theta;
  return 1.0 + t2 * (3.0 * d[0] + t2 * (5.0 * d[1] + t2 * (7.0 * d[2] + t2 * 9.0 * d[3])));
}

// Largest x in [0, end] with slope(x') > kMinSlope for all x' <= x. Scans evenly, then bisects the first
// failure.
template <typename Slope>
double monotonic_end(const Slope& slope, double end) {
  constexpr int kSteps = 4000;
  double good = 0.0;
  for (int i = 1; i <= kSteps; ++i) {
    const double x = end * i / kSteps;
    if (slope(x) > kMinSlope) {
      good = x;
      continue;
    }
    double bad = x;
    for (int k = 0; k < 60; ++k) {
      const double middle = 0.5 * (good + bad);
      (slope(middle) > kMinSlope ? good : bad) = middle;
    }
    return good;
  }
  return end;
}

// Solves value(x) = target on [0, end], where value rises; Newton kept inside a shrinking bracket.
template <typename Value, typename Slope>
double solve_rising(const Value& value, const Slope& slope, double target, double end) {
  double low = 0.0, high = end;
  double x = std::min(target, end);
  for (int i = 0; i < 60; ++i) {
    const double residual = value(x) - target;
    (residual > 0.0 ? high : low) = x;
    double next = x - residual / slope(x);
    const bool newton = next >= low && next <= high;
    if (!newton) next = 0.5 * (low + high);
    const double step = next - x;
    x = next;
    // Newton converges quadratically: after a step below 1e-8 the next would be below 1e-15.
    if (std::abs(step) <= (newton ? 1e-8 : 1e-15) * (1.0 + x)) break;
  }
  return x;
}

// Inverse of radtan_distort within max_radius. Starts from the purely radial solution, which leaves Newton
// only the small tangential part. False where no point of the disc has this image.
bool radtan_undistort(const Distortion& d, double max_radius, const Eigen::Vector2d& distorted,
                      Eigen::Vector2d* m) {
  const double rd = distorted.norm();
  if (!std::isfinite(rd)) return false;
  const double r = solve_rising([&](double x) { return x * radial_factor(d, x * x); },
                                [&](double x) { return radial_slope(d, x * x); }, rd, max_radius);
  *m = rd > 0.0 ? Eigen::Vector2d(distorted * (r / rd)) : Eigen::Vector2d(0.0, 0.0);
  if (d[2] == 0.0 && d[3] == 0.0) {
    // Purely radial: solved, unless rd lies beyond the image of the disc's edge.
    const double left = r * radial_factor(d, r * r) - rd;
    return std::abs(left) <= 1e-12 * (1.0 + rd);
  }
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector2d residual = radtan_distort(d, *m) - distorted;
    const Eigen::Matrix2d j = radtan_derivative(d, *m);
    const double det = j(0, 0) * j(1, 1) - j(0, 1) * j(1, 0);
    if (!(det > 0.0)) return false;
    const Eigen::Vector2d step((j(1, 1) * residual.x() - j(0, 1) * residual.y()) / det,
                               (j(0, 0) * residual.y() - j(1, 0) * residual.x()) / det);
    *m -= step;
    // Newton converges quadratically: a step below 1e-8 leaves an error far below 1e-14.
    if (step.norm() < 1e-8 * (1.0 + m->norm())) return m->norm() <= max_radius * (1.0 + 1e-12);
  }
  return false;
}

// --- a point's pixel, and its derivative where `j` is given; inlined, so that an unused derivative is free
// ---

inline bool project_pinhole(const Camera::Parameters& p, double max_radius, const Eigen::Vector3d& point_c,
                            Eigen::Vector2d* pixel, Matrix23d* j) {
  if (!(point_c.z() > 0.0)) return false;
  const double inverse_z = 1.0 / point_c.z();
  const Eigen::Vector2d m = inverse_z * point_c.head<2>();
  if (!(m.squaredNorm() <= max_radius * max_radius)) return false;
  const Eigen::Vector2d md = radtan_distort(p.distortion, m);
  *pixel = {p.fx_px * md.x() + p.cx_px, p.fy_px * md.y() + p.cy_px};
  if (j == nullptr) return true;
  Eigen::Matrix2d d = radtan_derivative(p.distortion, m);
  d.row(0) *= p.fx_px * inverse_z;
  d.row(1) *= p.fy_px * inverse_z;
  j->leftCols<2>() = d;
  j->col(2) = -(d.col(0) * m.x() + d.col(1) * m.y());
  return true;
}

inline bool project_fisheye(const Camera::Parameters& p, double max_theta_rad, const Eigen::Vector3d& point_c,
                            Eigen::Vector2d* pixel, Matrix23d* j) {
  const double x = point_c.x(), y = point_c.y(), z = point_c.z();
  const double rho = std::hypot(x, y);
  const double theta = std::atan2(rho, z);
  if (!(theta <= max_theta_rad) || !(rho > 0.0 || z > 0.0)) return false;
  // On the axis theta_d / rho tends to 1 / z.
  const double k = rho > 0.0 ? fisheye_theta_d(p.distortion, theta) / rho : 1.0 / z;
  *pixel = {p.fx_px * k * x + p.cx_px, p.fy_px * k * y + p.cy_px};
  if (j == nullptr) return true;
  // The distorted point is k (x, y). Its derivative along rho is a, across it k; along z it is -slope / n^2.
  const double n2 = point_c.squaredNorm();
  const double slope = fisheye_slope(p.distortion, theta);
  const double a = slope * z / n2;
  const double ex = rho > 0.0 ? x / rho : 0.0, ey = rho > 0.0 ? y / rho : 0.0;
  *j << k + (a - k) * ex * ex, (a - k) * ex * ey, -x * slope / n2, (a - k) * ex * ey, k + (a - k) * ey * ey,
      -y * slope / n2;
  j->row(0) *= p.fx_px;
  j->row(1) *= p.fy_px;
  return true;
}

std::string wrong(const char* name, double value, const std::string& expected) {
  std::ostringstream s;
  s.precision(10);
  s << "camera: " << name << " is " << value << ", expected " << expected;
  return s.str();
}

// Share of an even grid over the image whose pixels have a ray.
double usable_share(const Camera& camera) {
  constexpr int kColumns = 24, kRows = 18;
  int usable = 0;
  for (int i = 0; i < kRows; ++i) {
    for (int k = 0; k < kColumns; ++k) {
      const Eigen::Vector2d pixel((k + 0.5) / kColumns * camera.width_px() - 0.5,
                                  (i + 0.5) / kRows * camera.height_px() - 0.5);
      Eigen::Vector3d bearing;
      usable += camera.unproject(pixel, &bearing) ? 1 : 0;
    }
  }
  return static_cast<double>(usable) / (kColumns * kRows);
}

}  // namespace

Camera::Camera(const Parameters& p) : p_(p) {
  const Distortion& d = p_.distortion;
  if (p_.model == CameraModel::kPinholeRadtan) {
    // Scanned in the angle, so that the steps near the axis are fine; r = tan(theta).
    max_theta_rad_ = monotonic_end([&](double theta) { return radtan_slope_bound(d, std::tan(theta)); },
                                   std::atan(kMaxPinholeRadius));
    max_radius_ = std::tan(max_theta_rad_);
  } else {
    max_theta_rad_ =
        monotonic_end([&](double theta) { return fisheye_slope(d, theta); }, kMaxFisheyeTheta_rad);
    max_radius_ = fisheye_theta_d(d, max_theta_rad_);
  }
}

std::string Camera::check(const Parameters& p) {
  if (p.width_px <= 0) return wrong("width", p.width_px, "a number of pixels above 0");
  if (p.height_px <= 0) return wrong("height", p.height_px, "a number of pixels above 0");
  if (!(std::isfinite(p.fx_px) && p.fx_px > 0.0))
    return wrong("fx", p.fx_px, "a finite number of pixels above 0");
  if (!(std::isfinite(p.fy_px) && p.fy_px > 0.0))
    return wrong("fy", p.fy_px, "a finite number of pixels above 0");
  if (!(p.cx_px >= 0.0 && p.cx_px <= p.width_px - 1)) {
    return wrong("cx", p.cx_px, "0 to " + std::to_string(p.width_px - 1) + " (inside the image)");
  }
  if (!(p.cy_px >= 0.0 && p.cy_px <= p.height_px - 1)) {
    return wrong("cy", p.cy_px, "0 to " + std::to_string(p.height_px - 1) + " (inside the image)");
  }
  static constexpr const char* kRadtanNames[] = {"k1", "k2", "p1", "p2", "k3"};
  static constexpr const char* kFisheyeNames[] = {"k1", "k2", "k3", "k4", "distortion[4]"};
  const bool radtan = p.model == CameraModel::kPinholeRadtan;
  for (size_t i = 0; i < p.distortion.size(); ++i) {
    if (!std::isfinite(p.distortion[i])) {
      return wrong(radtan ? kRadtanNames[i] : kFisheyeNames[i], p.distortion[i], "a finite number");
    }
  }
  if (!radtan && p.distortion[4] != 0.0) {
    return wrong("distortion[4]", p.distortion[4], "0 (Kannala-Brandt has four coefficients)");
  }
  const double share = usable_share(Camera(p));
  if (share < kMinUsableShare) {
    return wrong("share of the image inside the distortion's monotonic range", share,
                 "at least 0.5 (are the coefficients' order and signs right?)");
  }
  return {};
}

bool Camera::project(const Eigen::Vector3d& point_c, Eigen::Vector2d* pixel) const {
  return p_.model == CameraModel::kPinholeRadtan
             ? project_pinhole(p_, max_radius_, point_c, pixel, nullptr)
             : project_fisheye(p_, max_theta_rad_, point_c, pixel, nullptr);
}

bool Camera::project(const Eigen::Vector3d& point_c, Eigen::Vector2d* pixel,
                     Matrix23d* d_pixel_d_point) const {
  return p_.model == CameraModel::kPinholeRadtan
             ? project_pinhole(p_, max_radius_, point_c, pixel, d_pixel_d_point)
             : project_fisheye(p_, max_theta_rad_, point_c, pixel, d_pixel_d_point);
}

bool Camera::unproject(const Eigen::Vector2d& pixel, Eigen::Vector3d* bearing_c) const {
  const Eigen::Vector2d md((pixel.x() - p_.cx_px) / p_.fx_px, (pixel.y() - p_.cy_px) / p_.fy_px);
  if (p_.model == CameraModel::kPinholeRadtan) {
    Eigen::Vector2d m;
    if (!radtan_undistort(p_.distortion, max_radius_, md, &m)) return false;
    *bearing_c = Eigen::Vector3d(m.x(), m.y(), 1.0).normalized();
    return true;
  }
  const double rd = std::hypot(md.x(), md.y());
  if (!(rd <= max_radius_)) return false;
  const double theta =
      solve_rising([&](double t) { return fisheye_theta_d(p_.distortion, t); },
                   [&](double t) { return fisheye_slope(p_.distortion, t); }, rd, max_theta_rad_);
  const double s = rd > 0.0 ? std::sin(theta) / rd : 0.0;
  *bearing_c = Eigen::Vector3d(s * md.x(), s * md.y(), std::cos(theta)).normalized();
  return true;
}

bool Camera::unproject(const Eigen::Vector2d& pixel, Eigen::Vector3d* bearing_c,
                       Eigen::Matrix<double, 3, 2>* d_bearing_d_pixel) const {
  Eigen::Vector2d back;
  Matrix23d j;
  if (!unproject(pixel, bearing_c) || !project(*bearing_c, &back, &j)) return false;
  // A point's distance does not move its pixel, so j maps the bearing to 0 and the two directions across it
  // one to one: its pseudoinverse leads back to just those two.
  const Eigen::Matrix2d jj = j * j.transpose();
  *d_bearing_d_pixel = j.transpose() * jj.inverse();
  return d_bearing_d_pixel->allFinite();
}

}  // namespace farpoint::slam
