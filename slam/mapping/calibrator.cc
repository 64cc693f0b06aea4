// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/calibrator.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "slam/solver/schur_blocks.h"

namespace farpoint::slam {

namespace {

constexpr int kParameters = 4;
// Of what windows said, this share is remembered from one to the next, about 50 windows. Each spoke of a map
// that the calibration of its day had bent; kept for good, the first of them would outvote all that come
// later.
constexpr double kRemembered = 0.98;
using Jacobian24 = Eigen::Matrix<double, 2, kParameters>;
using Vector4 = Eigen::Vector4d;

// d(pixel)/d(delta) at a point that projects to `pixel`.
Jacobian24 parameter_derivative(const Camera& camera, const Eigen::Vector3d& point_c,
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
  Jacobian24 J;
  J.col(0) = pixel - Eigen::Vector2d(p.cx_px, p.cy_px);  // delta[0] is the logarithm of the focal length
  J.col(1) = Eigen::Vector2d::UnitX();
  J.col(2) = Eigen::Vector2d::UnitY();
  J.col(3) = Eigen::Vector2d(p.fx_px * x, p.fy_px * y) * factor;
  return J;
}

// The normal equations of poses and calibration, inverse depths eliminated point by point. All poses are
// free, those too that local BA holds fixed: they were found under the calibration of their day, and fixed
// they would speak for it.
class WindowEquations {
 public:
  WindowEquations(const BundleProblem& problem, const Camera& camera, int index)
      : p_(problem), camera_(camera), index_(index) {
    poses_.resize(static_cast<int>(p_.poses.size()));
    poses_.set_zero();
    border_.assign(p_.poses.size(), Matrix64::Zero());
    gradient_.assign(p_.poses.size(), Vector6d::Zero());
    frames_.update(p_);
  }

  // d_bearing: of the point, by its host pixel; zero where another camera is the anchor.
  void add(const BundleProblem::Point& point, const Eigen::Matrix<double, 3, 2>& d_bearing) {
    Matrix34 d_xyz_d_delta = Matrix34::Zero();
    if (!d_bearing.isZero(0.0)) {
      Eigen::Vector2d host_pixel;
      if (!camera_.project(point.bearing, &host_pixel)) return;
      const Jacobian24 d_host_pixel = parameter_derivative(camera_, point.bearing, host_pixel);
      // The host's pixel is given; its bearing moves against what the projection would do.
      d_xyz_d_delta = -(frames_.body(point.host).R_world_body * point.T_host_anchor.rotation()) * d_bearing *
                      d_host_pixel;
    }
    world_ = frames_.world_point(point);
    part_ = {};
    couplings_.clear();
    HostSums sums;
    for (int i = 0; i < point.measurements; ++i) {
      const int index = point.first_measurement + i;
      BundleProblem::Measurement m = p_.measurements[static_cast<std::size_t>(index)];
      if (m.pose == point.host || m.chi2 > kChi2TwoDof) continue;
      m.sigma_px /= std::sqrt(point.weight);
      add_measurement(point, m, d_xyz_d_delta, &sums);
    }
    add_host(point.host, sums);
    H_.noalias() += part_.H;
    g_ += part_.g;
    if (part_.hessian > 0.0) eliminate_depth();
  }

  // Information matrix and gradient of the calibration alone, the poses eliminated. False where the poses
  // are not determined.
  bool reduce(Eigen::Matrix4d* H, Vector4* g) {
    *H = H_;
    *g = g_;
    const auto n = static_cast<Eigen::Index>(6 * border_.size());
    Eigen::MatrixXd dense(n, n), border(n, kParameters);
    Eigen::VectorXd gradient(n);
    poses_.copy_to(&dense);
    for (std::size_t i = 0; i < border_.size(); ++i) {
      border.middleRows<6>(static_cast<Eigen::Index>(6 * i)) = border_[i];
      gradient.segment<6>(static_cast<Eigen::Index>(6 * i)) = gradient_[i];
    }
    // A little damping stands in for place, attitude and scale of the whole, which nothing fixes.
    dense.diagonal() += (1e-6 * dense.diagonal().array() + 1e-9).matrix();
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>, Eigen::Upper> factor(dense);
    if (factor.info() != Eigen::Success) return false;
    const Eigen::MatrixXd X = factor.solve(border);
    *H -= border.transpose() * X;
    *g -= X.transpose() * gradient;
    return true;
  }

 private:
  using Matrix64 = Eigen::Matrix<double, 6, kParameters>;
  using Matrix34 = Eigen::Matrix<double, 3, kParameters>;

  // One point's share of what concerns its depth and the calibration.
  struct Part {
    double hessian = 0, gradient = 0;  // of the inverse depth
    Eigen::Matrix4d H = Eigen::Matrix4d::Zero();
    Vector4 g = Vector4::Zero(), w = Vector4::Zero();  // w: with the inverse depth
  };
  // The host's derivatives are carry(host) times these sums over all measurements.
  struct HostSums {
    Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero(), coupling = Eigen::Vector3d::Zero();
    Matrix34 border = Matrix34::Zero();
  };
  struct Coupling {
    int pose = 0;
    Vector6d w = Vector6d::Zero();
  };

  void add_measurement(const BundleProblem::Point& point, const BundleProblem::Measurement& m,
                       const Matrix34& d_xyz_d_delta, HostSums* sums) {
    const BundleFrames::View& view = frames_.view(m);
    WorldLinearisation lin;
    if (!linearise_world(world_, view, m, &lin)) return;
    const Eigen::Vector3d p_c = view.R_camera_world * world_.xyz + world_.inverse_depth * view.t_camera_world;
    Jacobian24 d_pixel = Jacobian24::Zero();
    if (m.camera == index_) d_pixel = parameter_derivative(camera_, p_c, m.pixel + m.sigma_px * lin.residual);
    const Jacobian24 Jd = d_pixel / m.sigma_px + lin.d_xyz * d_xyz_d_delta;
    part_.hessian += lin.d_inverse_depth.squaredNorm();
    part_.gradient += lin.d_inverse_depth.dot(lin.residual);
    part_.H.noalias() += Jd.transpose() * Jd;
    part_.g.noalias() += Jd.transpose() * lin.residual;
    part_.w.noalias() += Jd.transpose() * lin.d_inverse_depth;
    sums->hessian.noalias() += lin.d_xyz.transpose() * lin.d_xyz;
    sums->gradient.noalias() += lin.d_xyz.transpose() * lin.residual;
    sums->coupling.noalias() += lin.d_xyz.transpose() * lin.d_inverse_depth;
    sums->border.noalias() += lin.d_xyz.transpose() * Jd;
    const Matrix26d J = carried(lin.d_xyz, -1.0, world_, frames_.body(m.pose).t_world_body);
    poses_.at(m.pose, m.pose).noalias() += J.transpose() * J;
    border_[static_cast<std::size_t>(m.pose)].noalias() += J.transpose() * Jd;
    gradient_[static_cast<std::size_t>(m.pose)].noalias() += J.transpose() * lin.residual;
    couple(m.pose, J.transpose() * lin.d_inverse_depth);
    const Matrix26d J_host = carried(lin.d_xyz, 1.0, world_, frames_.body(point.host).t_world_body);
    if (point.host < m.pose)
      poses_.at(point.host, m.pose).noalias() += J_host.transpose() * J;
    else
      poses_.at(m.pose, point.host).noalias() += J.transpose() * J_host;
  }

  void add_host(int host, const HostSums& sums) {
    const Matrix36d d = carry(world_, frames_.body(host).t_world_body);
    poses_.at(host, host).noalias() += d.transpose() * (sums.hessian * d);
    border_[static_cast<std::size_t>(host)].noalias() += d.transpose() * sums.border;
    gradient_[static_cast<std::size_t>(host)].noalias() += d.transpose() * sums.gradient;
    couple(host, d.transpose() * sums.coupling);
  }

  void couple(int pose, const Vector6d& w) {
    for (Coupling& c : couplings_)
      if (c.pose == pose) {
        c.w += w;
        return;
      }
    couplings_.push_back({pose, w});
  }

  void eliminate_depth() {
    const double inverse = 1.0 / part_.hessian;
    for (const Coupling& a : couplings_) {
      const Vector6d scaled = inverse * a.w;
      for (const Coupling& b : couplings_)
        if (a.pose <= b.pose) poses_.at(a.pose, b.pose).noalias() -= scaled * b.w.transpose();
      border_[static_cast<std::size_t>(a.pose)].noalias() -= scaled * part_.w.transpose();
      gradient_[static_cast<std::size_t>(a.pose)] -= scaled * part_.gradient;
    }
    H_.noalias() -= inverse * part_.w * part_.w.transpose();
    g_ -= (inverse * part_.gradient) * part_.w;
  }

  const BundleProblem& p_;
  const Camera& camera_;
  const int index_;  // of camera_ in the rig
  BundleFrames frames_;
  BlockMatrix poses_;
  std::vector<Matrix64> border_;  // of the poses, with the calibration
  std::vector<Vector6d> gradient_;
  Eigen::Matrix4d H_ = Eigen::Matrix4d::Zero();
  Vector4 g_ = Vector4::Zero();
  // Of the point that is being added.
  BundleFrames::WorldPoint world_;
  Part part_;
  std::vector<Coupling> couplings_;
};

Eigen::Matrix4d prior_information(const CalibrationConfig& config) {
  const Vector4 sigma(config.focal_sigma, config.centre_sigma_px, config.centre_sigma_px,
                      config.distortion_sigma);
  return sigma.cwiseAbs2().cwiseInverse().asDiagonal();
}

}  // namespace

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
  WindowEquations equations(problem, camera_, index_);
  for (std::size_t k = 0; k < problem.points.size(); ++k) equations.add(problem.points[k], d_bearing[k]);
  if (!equations.reduce(&out.H, &out.g)) return out;
  out.H = (0.5 * (out.H + out.H.transpose())).eval();
  out.usable = out.H.allFinite() && out.g.allFinite();
  return out;
}

double Calibrator::image_change_px(const Camera& next) const {
  // Largest move of a ray's pixel over the image's edge.
  const double w = given_.width_px() - 1, h = given_.height_px() - 1;
  double largest = 0.0;
  for (const Eigen::Vector2d& pixel :
       {Eigen::Vector2d(0, 0), Eigen::Vector2d(w, 0), Eigen::Vector2d(0, h), Eigen::Vector2d(w, h),
        Eigen::Vector2d(0, h / 2), Eigen::Vector2d(w, h / 2)}) {
    Eigen::Vector3d ray;
    Eigen::Vector2d moved;
    if (camera_.unproject(pixel, &ray) && next.project(ray, &moved))
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
  if (image_change_px(next) < kNoticeable_px) return false;
  if (!Camera::check(next.parameters()).empty()) return false;
  delta_ = best;
  camera_ = next;
  return true;
}

}  // namespace farpoint::slam
