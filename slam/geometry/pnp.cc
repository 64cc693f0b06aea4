// SPDX-License-Identifier: Apache-2.0
#include "slam/geometry/pnp.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "slam/geometry/polynomial.h"
#include "slam/geometry/random.h"
#include "slam/geometry/robust.h"

namespace farpoint::slam {

namespace {

using Bearings = std::span<const Eigen::Vector3d>;
using Points = std::span<const Eigen::Vector3d>;

constexpr double kMissChance = 1e-3;
constexpr int kMinSamples = 30;
// Limits in sigma within which matches take part, round by round: wide first, so that the sample's own choice
// of matches does not hold the pose where it is.
constexpr std::array<double, 5> kLimits_sigma = {8.0, 5.0, 3.0, 3.0, 3.0};
constexpr int kStepsARound = 5;

// --- three points ---

// Newton on the law of cosines, s_i^2 + s_k^2 - 2 s_i s_k cos = d_ik^2: takes off the quartic's rounding.
void polish_distances(const Eigen::Vector3d& cosines, const Eigen::Vector3d& sides2, Eigen::Vector3d* s) {
  for (int step = 0; step < 3; ++step) {
    Eigen::Vector3d residual;
    Eigen::Matrix3d j = Eigen::Matrix3d::Zero();
    for (Eigen::Index e = 0; e < 3; ++e) {
      // Side e lies opposite to point e, between points i and k.
      const Eigen::Index i = (e + 1) % 3, k = (e + 2) % 3;
      const double si = (*s)(i), sk = (*s)(k);
      residual(e) = si * si + sk * sk - 2.0 * si * sk * cosines(e) - sides2(e);
      j(e, i) = 2.0 * (si - sk * cosines(e));
      j(e, k) = 2.0 * (sk - si * cosines(e));
    }
    const Eigen::Vector3d next = *s - j.partialPivLu().solve(residual);
    if (!next.allFinite()) return;
    *s = next;
  }
}

// Right-handed axes of a triangle, as columns.
Eigen::Matrix3d triangle_axes(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3d e1 = (b - a).normalized();
  const Eigen::Vector3d e3 = e1.cross(c - a).normalized();
  Eigen::Matrix3d axes;
  axes << e1, e3.cross(e1), e3;
  return axes;
}

using Quadratic = std::array<double, 3>;
using Quartic = std::array<double, 5>;

void add_product(const Quadratic& a, const Quadratic& b, double factor, Quartic* sum) {
  for (size_t i = 0; i < 3; ++i) {
    for (size_t k = 0; k < 3; ++k) (*sum)[i + k] += factor * a[i] * b[k];
  }
}

// --- refinement ---

// Squared distance of the unit directions: the squared angle, to first order, over both components.
double bearing_error2_rad2(const Eigen::Matrix3d& r, const Eigen::Vector3d& t, const Eigen::Vector3d& bearing,
                           const Eigen::Vector3d& point_w) {
  return (bearing - (r * point_w + t).normalized()).squaredNorm();
}

double pose_cost(Bearings bearings, Points points, std::span<const size_t> use, double sigma_rad,
                 const SE3& pose) {
  const Eigen::Matrix3d r = pose.rotation();
  double cost = 0.0;
  for (const size_t i : use) {
    const double squared = bearing_error2_rad2(r, pose.t, bearings[i], points[i]) / (sigma_rad * sigma_rad);
    cost += 2.0 * huber_cost(squared, kHuberDeltaOneDof);
  }
  return cost;
}

void pose_normal_equations(Bearings bearings, Points points, std::span<const size_t> use, double sigma_rad,
                           const SE3& pose, Matrix6d* h, Vector6d* g) {
  const Eigen::Matrix3d r = pose.rotation();
  h->setZero();
  g->setZero();
  for (const size_t i : use) {
    const Eigen::Vector3d p = r * points[i] + pose.t;
    const double distance = p.norm();
    const Eigen::Vector3d direction = p / distance;
    const Eigen::Vector3d error = direction - bearings[i];
    // d(direction)/d(p) = (I - d d^T) / |p|; p moves by R dt - R [point_w]x dphi.
    const Eigen::Matrix3d d_direction = (r - direction * (direction.transpose() * r)) / distance;
    Eigen::Matrix<double, 3, 6> j;
    j << d_direction, -d_direction * skew(points[i]);
    const double chi = error.norm() / sigma_rad;
    const double w = (chi <= kHuberDeltaOneDof ? 1.0 : kHuberDeltaOneDof / chi) / (sigma_rad * sigma_rad);
    h->noalias() += w * j.transpose() * j;
    g->noalias() += w * j.transpose() * error;
  }
}

SE3 descend(Bearings bearings, Points points, std::span<const size_t> use, double sigma_rad, SE3 pose) {
  double cost = pose_cost(bearings, points, use, sigma_rad, pose);
  double lambda = 1e-6;
  for (int i = 0; i < kStepsARound; ++i) {
    Matrix6d h;
    Vector6d g;
    pose_normal_equations(bearings, points, use, sigma_rad, pose, &h, &g);
    bool accepted = false;
    double predicted = 0.0;
    for (int tries = 0; tries < 8 && !accepted; ++tries) {
      Matrix6d damped = h;
      damped.diagonal() *= 1.0 + lambda;
      const Vector6d step = -damped.ldlt().solve(g);
      if (!step.allFinite()) return pose;
      const SE3 next = pose.boxplus(step);
      const double next_cost = pose_cost(bearings, points, use, sigma_rad, next);
      accepted = next_cost <= cost;
      lambda = accepted ? std::max(1e-9, 0.1 * lambda) : 10.0 * lambda;
      predicted = -g.dot(step);
      if (accepted) {
        pose = next;
        cost = next_cost;
      }
    }
    // A gain below 1e-8 in chi-square moves the pose by 1e-4 of its own sigma.
    if (!accepted || predicted < 1e-8) break;
  }
  return pose;
}

// --- search ---

double truncated_cost(Bearings bearings, Points points, double sigma_rad, const SE3& pose, double enough) {
  const Eigen::Matrix3d r = pose.rotation();
  const double scale = 1.0 / (sigma_rad * sigma_rad);
  double cost = 0.0;
  for (size_t i = 0; i < bearings.size() && cost < enough; ++i) {
    cost += std::min(kChi2TwoDof99, scale * bearing_error2_rad2(r, pose.t, bearings[i], points[i]));
  }
  return cost;
}

// Counts the inliers, and marks them where there is a mask.
size_t find_inliers(Bearings bearings, Points points, double sigma_rad, const SE3& pose,
                    std::vector<uint8_t>* mask) {
  const Eigen::Matrix3d r = pose.rotation();
  size_t count = 0;
  for (size_t i = 0; i < bearings.size(); ++i) {
    const double r2 = bearing_error2_rad2(r, pose.t, bearings[i], points[i]);
    const bool inlier = r2 < kChi2TwoDof99 * sigma_rad * sigma_rad;
    if (mask != nullptr) (*mask)[i] = inlier ? 1 : 0;
    count += inlier ? 1U : 0U;
  }
  return count;
}

int needed_samples(double inlier_share, int max_samples) {
  const double clean = inlier_share * inlier_share * inlier_share;
  if (clean >= 1.0 - 1e-9) return kMinSamples;
  const double needed = std::log(kMissChance) / std::log1p(-clean);
  return needed >= max_samples ? max_samples : std::max(kMinSamples, static_cast<int>(std::ceil(needed)));
}

// Returns how many samples were tried; 0 where none gave a pose.
int find_pose(Bearings bearings, Points points, double sigma_rad, const PnpOptions& options, SE3* best) {
  SampleGenerator generator(options.seed);
  double best_cost = std::numeric_limits<double>::max();
  const double least_share = std::max(options.min_inlier_share, static_cast<double>(options.min_inliers) /
                                                                    static_cast<double>(bearings.size()));
  int samples = needed_samples(least_share, options.max_samples), k = 0;
  for (; k < samples; ++k) {
    const std::array<size_t, 3> chosen = generator.sample<3>(bearings.size());
    const std::array<Eigen::Vector3d, 3> b = {bearings[chosen[0]], bearings[chosen[1]], bearings[chosen[2]]};
    const std::array<Eigen::Vector3d, 3> p = {points[chosen[0]], points[chosen[1]], points[chosen[2]]};
    const PoseCandidates candidates = solve_p3p(b, p);
    for (size_t i = 0; i < candidates.count; ++i) {
      const SE3& pose = candidates.T_camera_world[i];
      const double cost = truncated_cost(bearings, points, sigma_rad, pose, best_cost);
      if (cost >= best_cost) continue;
      best_cost = cost;
      *best = pose;
      const size_t inliers = find_inliers(bearings, points, sigma_rad, pose, nullptr);
      const double share = static_cast<double>(inliers) / static_cast<double>(bearings.size());
      samples = std::min(samples, needed_samples(share, options.max_samples));
    }
  }
  return best_cost < std::numeric_limits<double>::max() ? k : 0;
}

SE3 refine_pose_in(Bearings bearings_c, Points points_w, double sigma_rad, const SE3& T_camera_world,
                   PnpWorkspace* workspace) {
  // World coordinates may be large: work relative to the points' centre, where rotation and translation part.
  const size_t n = std::min(bearings_c.size(), points_w.size());
  if (n == 0) return T_camera_world;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (size_t i = 0; i < n; ++i) centre += points_w[i];
  centre /= static_cast<double>(n);
  std::vector<Eigen::Vector3d>& points = workspace->points;
  std::vector<size_t>& use = workspace->use;
  points.assign(points_w.begin(), points_w.begin() + static_cast<std::ptrdiff_t>(n));
  for (Eigen::Vector3d& p : points) p -= centre;

  SE3 pose = {T_camera_world.q, T_camera_world * centre};
  for (const double limit_sigma : kLimits_sigma) {
    const double limit2 = limit_sigma * limit_sigma * sigma_rad * sigma_rad;
    const Eigen::Matrix3d r = pose.rotation();
    use.clear();
    for (size_t i = 0; i < n; ++i) {
      if (bearing_error2_rad2(r, pose.t, bearings_c[i], points[i]) < limit2) use.push_back(i);
    }
    if (use.size() < 4) break;
    pose = descend(bearings_c, points, use, sigma_rad, pose);
  }
  return {pose.q, pose.t - pose.q * centre};
}

}  // namespace

PoseCandidates solve_p3p(std::span<const Eigen::Vector3d, 3> bearings_c,
                         std::span<const Eigen::Vector3d, 3> points_w) {
  PoseCandidates result;
  // Side e and angle e lie opposite to point e.
  Eigen::Vector3d cosines, sides2;
  for (Eigen::Index e = 0; e < 3; ++e) {
    const size_t i = static_cast<size_t>((e + 1) % 3), k = static_cast<size_t>((e + 2) % 3);
    cosines(e) = bearings_c[i].dot(bearings_c[k]);
    sides2(e) = (points_w[i] - points_w[k]).squaredNorm();
  }
  const double twice_area = (points_w[1] - points_w[0]).cross(points_w[2] - points_w[0]).norm();
  if (!(twice_area > 1e-9 * sides2.maxCoeff())) return result;  // on a line, or in one place

  // Distances s, u s, v s of the three points. From the three laws of cosines: u = N(v) / D(v), and a quartic
  // in v.
  const double to_1 = sides2(0) / sides2(1), to_3 = sides2(2) / sides2(1), k = to_1 - to_3;
  const double ca = cosines(0), cb = cosines(1), cc = cosines(2);
  const Quadratic n = {k + 1.0, -2.0 * k * cb, k - 1.0};
  const Quadratic d = {2.0 * cc, -2.0 * ca, 0.0};
  const Quadratic rest = {1.0 - to_3, 2.0 * to_3 * cb, -to_3};
  Quartic quartic{};
  add_product(n, n, 1.0, &quartic);
  add_product(n, d, -2.0 * cc, &quartic);
  Quartic d2{};
  add_product(d, d, 1.0, &d2);
  add_product({d2[0], d2[1], d2[2]}, rest, 1.0, &quartic);

  const RealRoots roots = real_roots(quartic);
  for (size_t i = 0; i < roots.count && result.count < result.T_camera_world.size(); ++i) {
    const double v = roots.value[i];
    const double u = (n[0] + v * (n[1] + v * n[2])) / (d[0] + v * d[1]);
    if (!(v > 0.0 && u > 0.0) || !std::isfinite(u)) continue;
    const double s2 = sides2(1) / (1.0 + v * (v - 2.0 * cb));
    Eigen::Vector3d s = std::sqrt(s2) * Eigen::Vector3d(1.0, u, v);
    polish_distances(cosines, sides2, &s);
    if (!s.allFinite() || !(s.minCoeff() > 0.0)) continue;
    const Eigen::Vector3d c0 = s(0) * bearings_c[0], c1 = s(1) * bearings_c[1], c2 = s(2) * bearings_c[2];
    const Eigen::Matrix3d r =
        triangle_axes(c0, c1, c2) * triangle_axes(points_w[0], points_w[1], points_w[2]).transpose();
    SE3 pose;
    pose.q = Eigen::Quaterniond(r).normalized();
    pose.t = (c0 + c1 + c2) / 3.0 - pose.q * ((points_w[0] + points_w[1] + points_w[2]) / 3.0);
    if (pose.is_finite()) result.T_camera_world[result.count++] = pose;
  }
  return result;
}

SE3 refine_pose(std::span<const Eigen::Vector3d> bearings_c, std::span<const Eigen::Vector3d> points_w,
                double sigma_rad, const SE3& T_camera_world) {
  PnpWorkspace workspace;
  return refine_pose_in(bearings_c, points_w, sigma_rad, T_camera_world, &workspace);
}

void PnpWorkspace::reserve(size_t matches) {
  // Touched, not only reserved.
  points.resize(matches);
  use.resize(matches);
  result.inlier.resize(matches);
}

PnpResult solve_pnp(std::span<const Eigen::Vector3d> bearings_c, std::span<const Eigen::Vector3d> points_w,
                    double sigma_rad, const PnpOptions& options) {
  PnpWorkspace workspace;
  return solve_pnp(bearings_c, points_w, sigma_rad, options, &workspace);
}

const PnpResult& solve_pnp(std::span<const Eigen::Vector3d> bearings_c,
                           std::span<const Eigen::Vector3d> points_w, double sigma_rad,
                           const PnpOptions& options, PnpWorkspace* workspace) {
  PnpResult& result = workspace->result;
  result.ok = false;
  result.T_camera_world = SE3{};
  result.inliers = 0;
  result.samples = 0;
  result.rms_rad = 0.0;
  const size_t n = std::min(bearings_c.size(), points_w.size());
  result.inlier.assign(n, 0);
  if (n < std::max<size_t>(4, options.min_inliers) || !(sigma_rad > 0.0)) return result;
  bearings_c = bearings_c.first(n);
  points_w = points_w.first(n);
  result.samples = find_pose(bearings_c, points_w, sigma_rad, options, &result.T_camera_world);
  if (result.samples == 0) return result;
  result.T_camera_world = refine_pose_in(bearings_c, points_w, sigma_rad, result.T_camera_world, workspace);
  result.inliers = find_inliers(bearings_c, points_w, sigma_rad, result.T_camera_world, &result.inlier);
  const Eigen::Matrix3d r = result.T_camera_world.rotation();
  double sum = 0.0;
  for (size_t i = 0; i < n; ++i) {
    if (result.inlier[i] != 0)
      sum += bearing_error2_rad2(r, result.T_camera_world.t, bearings_c[i], points_w[i]);
  }
  if (result.inliers > 0) result.rms_rad = std::sqrt(0.5 * sum / static_cast<double>(result.inliers));
  result.ok = result.inliers >= std::max<size_t>(4, options.min_inliers) &&
              static_cast<double>(result.inliers) >= options.min_inlier_share * static_cast<double>(n);
  return result;
}

}  // namespace farpoint::slam
