// SPDX-License-Identifier: Apache-2.0
#include "slam/geometry/relative_motion.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace farpoint::slam {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Limits in sigma within which matches take part in a motion's refinement, round by round. Wide at first: the
// matches that agree with a motion from a minimal sample are a biased choice and would hold it where it is.
constexpr std::array<double, 5> kMotionLimits_sigma = {8.0, 5.0, 3.0, 3.0, 3.0};
// Neighbours on either side in the order of parallax, and the share of them that must fit as well.
constexpr size_t kSupportNeighbours = 10;
constexpr double kMinSupport = 0.5;
constexpr int kStepsARound = 6;
// The same as chi-square limits with 2 degrees of freedom for a homography (the last is 99.7 %).
constexpr std::array<double, 5> kHomographyLimits_chi2 = {64.0, 25.0, 11.8, 11.8, 11.8};
// Huber's tuning constant: 95 % efficiency for Gaussian noise.
constexpr double kHuber = 1.345;

using Matrix5d = Eigen::Matrix<double, 5, 5>;
using Vector5d = Eigen::Matrix<double, 5, 1>;
using Matrix9d = Eigen::Matrix<double, 9, 9>;
using Vector9d = Eigen::Matrix<double, 9, 1>;
using Matrix32d = Eigen::Matrix<double, 3, 2>;
using Matrix29d = Eigen::Matrix<double, 2, 9>;

double huber_cost(double r2) {
  const double r = std::sqrt(r2);
  return r <= kHuber ? r2 : kHuber * (2.0 * r - kHuber);
}
double huber_weight(double r2) {
  const double r = std::sqrt(r2);
  return r <= kHuber ? 1.0 : kHuber / r;
}

Matrix32d tangent_base(const Eigen::Vector3d& unit) {
  Matrix32d base;
  base.col(0) = unit.unitOrthogonal();
  base.col(1) = unit.cross(base.col(0));
  return base;
}

// Epipolar residual r = c / s of one match. With a = R b1 and n = t x a:
//   c = b2 . n,  s^2 = |t x a|^2 + |t x b2|^2 - 2 c^2  (the constraint's gradient over the tangents of both
//   bearings).
struct EpipolarTerm {
  double c, s2;
};
EpipolarTerm epipolar_term(const Eigen::Vector3d& t, const Eigen::Vector3d& a, const Eigen::Vector3d& b2) {
  const Eigen::Vector3d n = t.cross(a);
  const double c = b2.dot(n);
  return {c, n.squaredNorm() + t.cross(b2).squaredNorm() - 2.0 * c * c};
}

double motion_cost(Bearings b1, Bearings b2, std::span<const size_t> use, double sigma_rad,
                   const SE3& T_2_1) {
  const Eigen::Matrix3d r = T_2_1.rotation();
  double cost = 0.0;
  for (const size_t i : use) {
    const EpipolarTerm e = epipolar_term(T_2_1.t, r * b1[i], b2[i]);
    if (e.s2 > 0.0) cost += huber_cost(e.c * e.c / (e.s2 * sigma_rad * sigma_rad));
  }
  return cost;
}

// Normal equations over (two tangent coordinates of t, dphi), both in view 1's axes as in se3.h.
void motion_normal_equations(Bearings b1, Bearings b2, std::span<const size_t> use, double sigma_rad,
                             const SE3& T_2_1, const Matrix32d& base_1, Matrix5d* h, Vector5d* g) {
  const Eigen::Matrix3d r = T_2_1.rotation();
  const Eigen::Vector3d& t = T_2_1.t;
  const Matrix32d base_2 = r * base_1;
  h->setZero();
  g->setZero();
  for (const size_t i : use) {
    const Eigen::Vector3d a = r * b1[i];
    const EpipolarTerm e = epipolar_term(t, a, b2[i]);
    if (!(e.s2 > 0.0)) continue;
    // s^2 = 2 - (t.a)^2 - (t.b2)^2 - 2 c^2 for unit vectors; derivatives along a turn w (a moves by w x a)
    // and along t.
    const double ta = t.dot(a), tb = t.dot(b2[i]);
    const Eigen::Vector3d dc_dt = a.cross(b2[i]);
    const Eigen::Vector3d dc_dw = a.cross(b2[i].cross(t));
    const Eigen::Vector3d half_ds2_dt = -ta * a - tb * b2[i] - 2.0 * e.c * dc_dt;
    const Eigen::Vector3d half_ds2_dw = -ta * a.cross(t) - 2.0 * e.c * dc_dw;
    const double s = std::sqrt(e.s2);
    const Eigen::Vector3d dr_dt = (dc_dt - e.c / e.s2 * half_ds2_dt) / s;
    const Eigen::Vector3d dr_dw = (dc_dw - e.c / e.s2 * half_ds2_dw) / s;
    Vector5d j;
    j << base_2.transpose() * dr_dt, r.transpose() * dr_dw;
    const double residual = e.c / s;
    const double w = huber_weight(residual * residual / (sigma_rad * sigma_rad)) / (sigma_rad * sigma_rad);
    h->noalias() += w * j * j.transpose();
    *g += w * residual * j;
  }
}

SE3 moved(const SE3& T_2_1, const Matrix32d& base_1, const Vector5d& step) {
  Vector6d delta;
  delta << base_1 * step.head<2>(), step.tail<3>();
  SE3 next = T_2_1.boxplus(delta);
  next.t.normalize();
  return next;
}

Matrix32d translation_base_1(const SE3& T_2_1) {
  return tangent_base((T_2_1.q.conjugate() * T_2_1.t).normalized());
}

// Levenberg-Marquardt on a fixed set of matches.
SE3 descend(Bearings b1, Bearings b2, std::span<const size_t> use, double sigma_rad, SE3 T_2_1) {
  double cost = motion_cost(b1, b2, use, sigma_rad, T_2_1);
  double lambda = 1e-4;
  for (int i = 0; i < kStepsARound; ++i) {
    const Matrix32d base = translation_base_1(T_2_1);
    Matrix5d h;
    Vector5d g;
    motion_normal_equations(b1, b2, use, sigma_rad, T_2_1, base, &h, &g);
    bool accepted = false;
    Vector5d step = Vector5d::Zero();
    for (int tries = 0; tries < 6 && !accepted; ++tries) {
      Matrix5d damped = h;
      damped.diagonal() *= 1.0 + lambda;
      step = -damped.ldlt().solve(g);
      if (!step.allFinite()) return T_2_1;
      const SE3 next = moved(T_2_1, base, step);
      const double next_cost = motion_cost(b1, b2, use, sigma_rad, next);
      accepted = next_cost <= cost;
      lambda = accepted ? std::max(1e-9, 0.1 * lambda) : 10.0 * lambda;
      if (accepted) {
        T_2_1 = next;
        cost = next_cost;
      }
    }
    if (!accepted || step.norm() < 1e-4 * sigma_rad) break;
  }
  return T_2_1;
}

// Residual of a homography: c = B2^T H b1, zero where H b1 is parallel to b2 (B2: tangent plane of b2), with
// its covariance for unit noise in both tangent planes.
struct HomographyTerm {
  Eigen::Vector2d c;
  Eigen::Matrix2d covariance;
  Matrix32d base_2;
  double forward;  // b2 . H b1
};
HomographyTerm homography_term(const Eigen::Matrix3d& h, const Eigen::Vector3d& b1,
                               const Eigen::Vector3d& b2) {
  HomographyTerm term;
  term.base_2 = tangent_base(b2);
  const Eigen::Vector3d transferred = h * b1;
  const Eigen::Matrix2d through = term.base_2.transpose() * h * tangent_base(b1);
  term.c = term.base_2.transpose() * transferred;
  term.forward = b2.dot(transferred);
  term.covariance = through * through.transpose() + term.forward * term.forward * Eigen::Matrix2d::Identity();
  return term;
}

// d(c)/d(H), H's entries column by column.
Matrix29d homography_jacobian(const Matrix32d& base_2, const Eigen::Vector3d& b1) {
  Matrix29d j;
  for (Eigen::Index k = 0; k < 3; ++k) j.middleCols<3>(3 * k) = b1(k) * base_2.transpose();
  return j;
}

}  // namespace

double epipolar_residual2_rad2(const SE3& T_2_1, const Eigen::Vector3d& bearing_1,
                               const Eigen::Vector3d& bearing_2) {
  const EpipolarTerm e = epipolar_term(T_2_1.t, T_2_1.q * bearing_1, bearing_2);
  return e.s2 > 0.0 ? e.c * e.c / e.s2 : kInfinity;
}

void MotionWorkspace::reserve(size_t matches) {
  by_parallax.resize(matches);
  fitting_before.resize(matches + 1);
  supported.resize(matches);
  use.resize(matches);
}

size_t MotionWorkspace::bytes() const {
  return by_parallax.capacity() * sizeof(Entry) + fitting_before.capacity() * sizeof(size_t) +
         supported.capacity() + use.capacity() * sizeof(size_t);
}

std::vector<uint8_t> supported_matches(Bearings bearings_1, Bearings bearings_2, const SE3& T_2_1,
                                       double limit_rad) {
  MotionWorkspace workspace;
  return supported_matches(bearings_1, bearings_2, T_2_1, limit_rad, &workspace);
}

const std::vector<uint8_t>& supported_matches(Bearings bearings_1, Bearings bearings_2, const SE3& T_2_1,
                                              double limit_rad, MotionWorkspace* workspace) {
  using Entry = MotionWorkspace::Entry;
  const size_t n = bearings_1.size();
  std::vector<Entry>& entries = workspace->by_parallax;
  entries.resize(n);
  for (size_t i = 0; i < n; ++i) {
    const double r2 = epipolar_residual2_rad2(T_2_1, bearings_1[i], bearings_2[i]);
    // The chord grows with the angle, which is all that sorting needs.
    entries[i] = {(T_2_1.q * bearings_1[i] - bearings_2[i]).squaredNorm(), i, r2 < limit_rad * limit_rad};
  }
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return a.parallax != b.parallax ? a.parallax < b.parallax : a.match < b.match;
  });
  std::vector<size_t>& fitting_before = workspace->fitting_before;
  fitting_before.assign(n + 1, 0);
  for (size_t i = 0; i < n; ++i) fitting_before[i + 1] = fitting_before[i] + (entries[i].fits ? 1U : 0U);
  std::vector<uint8_t>& mask = workspace->supported;
  mask.assign(n, 0);
  for (size_t i = 0; i < n; ++i) {
    if (!entries[i].fits) continue;
    const size_t first = i > kSupportNeighbours ? i - kSupportNeighbours : 0;
    const size_t last = std::min(n, i + kSupportNeighbours + 1);
    const size_t others = last - first - 1, fitting = fitting_before[last] - fitting_before[first] - 1;
    mask[entries[i].match] =
        static_cast<double>(fitting) >= kMinSupport * static_cast<double>(others) ? 1 : 0;
  }
  return mask;
}

std::array<SE3, 4> decompose_essential(const Eigen::Matrix3d& essential) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(essential, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU(), v = svd.matrixV();
  if (u.determinant() < 0.0) u.col(2) = -u.col(2);
  if (v.determinant() < 0.0) v.col(2) = -v.col(2);
  Eigen::Matrix3d w;
  w << 0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0;
  const Eigen::Quaterniond q_1(Eigen::Matrix3d(u * w * v.transpose()));
  const Eigen::Quaterniond q_2(Eigen::Matrix3d(u * w.transpose() * v.transpose()));
  const Eigen::Vector3d t = u.col(2);
  return {SE3{q_1.normalized(), t}, SE3{q_1.normalized(), -t}, SE3{q_2.normalized(), t},
          SE3{q_2.normalized(), -t}};
}

MotionFit refine_motion(Bearings bearings_1, Bearings bearings_2, double sigma_rad, const SE3& T_2_1) {
  MotionWorkspace workspace;
  return refine_motion(bearings_1, bearings_2, sigma_rad, T_2_1, &workspace);
}

MotionFit refine_motion(Bearings bearings_1, Bearings bearings_2, double sigma_rad, const SE3& T_2_1,
                        MotionWorkspace* workspace) {
  MotionFit fit{T_2_1, kInfinity, 0};
  fit.T_2_1.t.normalize();
  std::vector<size_t>& use = workspace->use;
  for (const double limit_sigma : kMotionLimits_sigma) {
    const std::vector<uint8_t>& mask =
        supported_matches(bearings_1, bearings_2, fit.T_2_1, limit_sigma * sigma_rad, workspace);
    use.clear();
    for (size_t i = 0; i < mask.size(); ++i) {
      if (mask[i] != 0) use.push_back(i);
    }
    if (use.size() < 6) return fit;
    fit.T_2_1 = descend(bearings_1, bearings_2, use, sigma_rad, fit.T_2_1);
    fit.used = use.size();
  }
  Matrix5d h;
  Vector5d g;
  motion_normal_equations(bearings_1, bearings_2, use, sigma_rad, fit.T_2_1, translation_base_1(fit.T_2_1),
                          &h, &g);
  const Eigen::FullPivLU<Matrix5d> lu(h);
  if (lu.isInvertible()) {
    const Eigen::Matrix2d covariance = lu.inverse().topLeftCorner<2, 2>();
    const double largest = Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(covariance).eigenvalues()(1);
    if (largest >= 0.0) fit.translation_sigma_rad = std::sqrt(largest);
  }
  return fit;
}

double homography_residual2_rad2(const Eigen::Matrix3d& homography, const Eigen::Vector3d& bearing_1,
                                 const Eigen::Vector3d& bearing_2) {
  const HomographyTerm term = homography_term(homography, bearing_1, bearing_2);
  if (!(term.forward > 0.0)) return kInfinity;
  return term.c.dot(term.covariance.inverse() * term.c);
}

bool fit_homography(Bearings bearings_1, Bearings bearings_2, Mask used, Eigen::Matrix3d* homography) {
  Matrix9d normal = Matrix9d::Zero();
  size_t count = 0;
  for (size_t i = 0; i < bearings_1.size(); ++i) {
    if (used[i] == 0) continue;
    const Matrix29d j = homography_jacobian(tangent_base(bearings_2[i]), bearings_1[i]);
    normal.noalias() += j.transpose() * j;
    ++count;
  }
  if (count < 4) return false;
  const Eigen::SelfAdjointEigenSolver<Matrix9d> eigen(normal);
  // The second eigenvalue near zero: more than one homography fits (points on a line).
  if (!(eigen.eigenvalues()(1) > 1e-12 * eigen.eigenvalues()(8))) return false;
  const Vector9d v = eigen.eigenvectors().col(0);
  *homography = Eigen::Map<const Eigen::Matrix3d>(v.data());
  double forward = 0.0;
  for (size_t i = 0; i < bearings_1.size(); ++i) {
    if (used[i] != 0) forward += bearings_2[i].dot(*homography * bearings_1[i]) > 0.0 ? 1.0 : -1.0;
  }
  if (forward < 0.0) *homography = -*homography;
  return homography->allFinite();
}

Eigen::Matrix3d refine_homography(Bearings bearings_1, Bearings bearings_2, double sigma_rad,
                                  const Eigen::Matrix3d& homography) {
  Eigen::Matrix3d h = homography / homography.norm();
  const double sigma2 = sigma_rad * sigma_rad;
  for (const double limit_chi2 : kHomographyLimits_chi2) {
    Matrix9d normal = Matrix9d::Zero();
    Vector9d gradient = Vector9d::Zero();
    for (size_t i = 0; i < bearings_1.size(); ++i) {
      const HomographyTerm term = homography_term(h, bearings_1[i], bearings_2[i]);
      if (!(term.forward > 0.0)) continue;
      const Eigen::Matrix2d information = term.covariance.inverse() / sigma2;
      const double r2 = term.c.dot(information * term.c);
      if (r2 > limit_chi2) continue;
      const Matrix29d j = homography_jacobian(term.base_2, bearings_1[i]);
      const Eigen::Matrix2d weight = huber_weight(r2) * information;
      normal.noalias() += j.transpose() * weight * j;
      gradient += j.transpose() * (weight * term.c);
    }
    // H's own direction changes no residual: pin it, so that the step is orthogonal to H.
    const Vector9d v = Eigen::Map<const Vector9d>(h.data());
    normal += normal.trace() / 9.0 * v * v.transpose();
    const Vector9d step = -normal.ldlt().solve(gradient - v * v.dot(gradient));
    if (!step.allFinite()) return h;
    h += Eigen::Map<const Eigen::Matrix3d>(step.data());
    h /= h.norm();
  }
  return h;
}

PlaneMotions decompose_homography(const Eigen::Matrix3d& homography) {
  PlaneMotions result;
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(homography, Eigen::ComputeFullV);
  // H = R + t n^T / d has the middle singular value 1.
  const Eigen::Vector3d s = svd.singularValues() / svd.singularValues()(1);
  const Eigen::Matrix3d h = homography / svd.singularValues()(1);
  const double s1 = s(0) * s(0), s3 = s(2) * s(2);
  if (!h.allFinite() || !(s1 - s3 > 1e-12)) return result;
  Eigen::Matrix3d v = svd.matrixV();
  if (v.determinant() < 0.0) v = -v;
  // Directions in the plane's tangent that H maps without changing their length.
  const double along_1 = std::sqrt(std::max(0.0, (1.0 - s3) / (s1 - s3)));
  const double along_3 = std::sqrt(std::max(0.0, (s1 - 1.0) / (s1 - s3)));
  const Eigen::Vector3d middle = v.col(1);
  for (const double sign : {1.0, -1.0}) {
    const Eigen::Vector3d kept = along_1 * v.col(0) + sign * along_3 * v.col(2);
    const Eigen::Vector3d normal = middle.cross(kept);
    Eigen::Matrix3d from, to;
    from << middle, kept, normal;
    to << h * middle, h * kept, (h * middle).cross(h * kept);
    const Eigen::Matrix3d r = to * from.transpose();
    const Eigen::Vector3d t = (h - r) * normal;
    if (!(t.norm() > 0.0)) return PlaneMotions{};
    const Eigen::Quaterniond q = Eigen::Quaterniond(r).normalized();
    result.motion[result.count++] = {{q, t.normalized()}, normal};
    result.motion[result.count++] = {{q, -t.normalized()}, -normal};
  }
  return result;
}

double rotation_residual2_rad2(const Eigen::Matrix3d& R_2_1, const Eigen::Vector3d& bearing_1,
                               const Eigen::Vector3d& bearing_2) {
  return 0.5 * (bearing_2 - R_2_1 * bearing_1).squaredNorm();
}

Eigen::Matrix3d fit_rotation(Bearings bearings_1, Bearings bearings_2, Mask used) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (size_t i = 0; i < bearings_1.size(); ++i) {
    if (used[i] != 0) sum += bearings_2[i] * bearings_1[i].transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU();
  if (u.determinant() * svd.matrixV().determinant() < 0.0) u.col(2) = -u.col(2);
  return u * svd.matrixV().transpose();
}

}  // namespace farpoint::slam
