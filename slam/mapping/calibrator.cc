#include "slam/mapping/calibrator.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace farpoint::slam {

namespace {

constexpr int kParameters = 4;
using Jacobian24 = Eigen::Matrix<double, 2, kParameters>;
using Vector4 = Eigen::Vector4d;

// Steps of the numeric derivative of a projection by delta: a few hundredths of a pixel in the image.
const Vector4 kSteps(1e-5, 1e-2, 1e-2, 1e-4);

// d(pixel)/d(delta) by central differences: the same code for every camera model.
class ProjectionDerivative {
 public:
  ProjectionDerivative(const Camera& given, const CalibrationDelta& delta) {
    for (int i = 0; i < kParameters; ++i) {
      CalibrationDelta step = CalibrationDelta::Zero();
      step[i] = kSteps[i];
      plus_[static_cast<std::size_t>(i)] = refined_camera(given, delta + step);
      minus_[static_cast<std::size_t>(i)] = refined_camera(given, delta - step);
    }
  }
  [[nodiscard]] bool at(const Eigen::Vector3d& point_c, Jacobian24* J) const {
    for (int i = 0; i < kParameters; ++i) {
      Eigen::Vector2d a, b;
      if (!plus_[static_cast<std::size_t>(i)].project(point_c, &a) ||
          !minus_[static_cast<std::size_t>(i)].project(point_c, &b))
        return false;
      J->col(i) = (a - b) / (2.0 * kSteps[i]);
    }
    return true;
  }

 private:
  std::array<Camera, kParameters> plus_, minus_;
};

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

Calibrator::Calibrator(const CalibrationConfig& config, const Camera& given)
    : config_(config), given_(given) {
  const Vector4 sigma(config.focal_sigma, config.centre_sigma_px, config.centre_sigma_px,
                      config.distortion_sigma);
  information_ = sigma.cwiseAbs2().cwiseInverse().asDiagonal();
}

CalibrationDelta Calibrator::sigma() const {
  return information_.inverse().diagonal().cwiseSqrt();
}

Calibrator::Quadratic Calibrator::window_information(
    const BundleProblem& problem, const std::vector<Eigen::Matrix<double, 3, 2>>& d_bearing) const {
  Quadratic out;
  std::vector<int> block(problem.poses.size(), -1);
  int free = 0;
  for (std::size_t i = 0; i < problem.poses.size(); ++i)
    if (!problem.poses[i].fixed) block[i] = free++;
  const Eigen::Index n = 6 * free + kParameters, c = 6 * free;
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd g = Eigen::VectorXd::Zero(n), w = Eigen::VectorXd::Zero(n);
  const ProjectionDerivative derivative(given_, delta_);
  BundleFrames frames;
  frames.update(problem);
  std::vector<Eigen::Index> touched;

  for (std::size_t k = 0; k < problem.points.size(); ++k) {
    const BundleProblem::Point& point = problem.points[k];
    const BundleFrames::WorldPoint world = frames.world_point(point);
    Jacobian24 d_host_pixel;
    if (!derivative.at(point.bearing, &d_host_pixel)) continue;
    // The host's pixel is given; its bearing moves against what the projection would do.
    const Eigen::Matrix<double, 3, kParameters> d_xyz_d_delta =
        -(frames.body(point.host).R_world_body * point.T_host_anchor.rotation()) * d_bearing[k] *
        d_host_pixel;
    double h = 0.0, gradient = 0.0;
    touched.clear();
    const auto add_pose = [&](int b, const Eigen::Matrix<double, 2, 6>& J, const BundleLinearisation& lin,
                              double weight, const Jacobian24& Jd) {
      const Eigen::Index at = 6 * b;
      if (std::find(touched.begin(), touched.end(), at) == touched.end()) touched.push_back(at);
      H.block<6, 6>(at, at).noalias() += weight * J.transpose() * J;
      H.block<6, kParameters>(at, c).noalias() += weight * J.transpose() * Jd;
      g.segment<6>(at).noalias() += weight * J.transpose() * lin.residual;
      w.segment<6>(at).noalias() += weight * J.transpose() * lin.d_inverse_depth;
    };
    for (int i = 0; i < point.measurements; ++i) {
      const auto& m = problem.measurements[static_cast<std::size_t>(point.first_measurement + i)];
      BundleLinearisation lin;
      WorldLinearisation lw;
      Jacobian24 Jd;
      if (m.pose == point.host || m.chi2 > kChi2TwoDof) continue;
      if (!linearise(frames, point, m, &lin) || !linearise_world(world, frames.view(m), m, &lw)) continue;
      const BundleFrames::View& view = frames.view(m);
      const Eigen::Vector3d p_c = view.R_camera_world * world.xyz + world.inverse_depth * view.t_camera_world;
      if (!derivative.at(p_c, &Jd)) continue;
      Jd = (Jd / m.sigma_px + lw.d_xyz * d_xyz_d_delta).eval();
      const double weight = 1.0;
      h += lin.d_inverse_depth.squaredNorm();
      gradient += lin.d_inverse_depth.dot(lin.residual);
      const int bh = block[static_cast<std::size_t>(point.host)],
                bt = block[static_cast<std::size_t>(m.pose)];
      if (bh >= 0) add_pose(bh, lin.d_host, lin, weight, Jd);
      if (bt >= 0) add_pose(bt, lin.d_target, lin, weight, Jd);
      if (bh >= 0 && bt >= 0) {
        const Eigen::Index r = 6 * std::min(bh, bt), q = 6 * std::max(bh, bt);
        if (bh < bt)
          H.block<6, 6>(r, q).noalias() += lin.d_host.transpose() * lin.d_target;
        else
          H.block<6, 6>(r, q).noalias() += lin.d_target.transpose() * lin.d_host;
      }
      H.block<kParameters, kParameters>(c, c).noalias() += Jd.transpose() * Jd;
      g.segment<kParameters>(c).noalias() += Jd.transpose() * lin.residual;
      w.segment<kParameters>(c).noalias() += Jd.transpose() * lin.d_inverse_depth;
    }
    if (h > 0.0) {
      const double inverse = 1.0 / h;
      for (std::size_t a = 0; a < touched.size(); ++a) {
        const Vector6d scaled = inverse * w.segment<6>(touched[a]);
        for (std::size_t b = 0; b < touched.size(); ++b)
          if (touched[a] <= touched[b])
            H.block<6, 6>(touched[a], touched[b]).noalias() -= scaled * w.segment<6>(touched[b]).transpose();
        H.block<6, kParameters>(touched[a], c).noalias() -= scaled * w.segment<kParameters>(c).transpose();
        g.segment<6>(touched[a]) -= scaled * gradient;
      }
      const Vector4 scaled = inverse * w.segment<kParameters>(c);
      H.block<kParameters, kParameters>(c, c).noalias() -= scaled * w.segment<kParameters>(c).transpose();
      g.segment<kParameters>(c) -= scaled * gradient;
    }
    for (const Eigen::Index at : touched) w.segment<6>(at).setZero();
    w.segment<kParameters>(c).setZero();
  }
  // Poses eliminated; a little damping stands in for the scale, which a young window leaves open.
  for (Eigen::Index i = 0; i < c; ++i) H(i, i) += 1e-6 * H(i, i) + 1e-9;
  if (c > 0) {
    const Eigen::MatrixXd Hpp = H.topLeftCorner(c, c).selfadjointView<Eigen::Upper>();
    const Eigen::LLT<Eigen::MatrixXd> factor(Hpp);
    if (factor.info() != Eigen::Success) return out;
    const Eigen::MatrixXd X = factor.solve(H.block(0, c, c, kParameters));
    out.H = H.block<kParameters, kParameters>(c, c) - H.block(0, c, c, kParameters).transpose() * X;
    out.g = g.segment<kParameters>(c) - X.transpose() * g.head(c);
  } else {
    out.H = H;
    out.g = g;
  }
  out.H = (0.5 * (out.H + out.H.transpose())).eval();
  out.usable = out.H.allFinite() && out.g.allFinite();
  return out;
}

double Calibrator::image_change_px(const CalibrationDelta& change) const {
  // Largest move of a ray's pixel over the image's edge.
  const Camera before = camera(), after = refined_camera(given_, delta_ + change);
  const double w = given_.width_px() - 1, h = given_.height_px() - 1;
  double largest = 0.0;
  for (const Eigen::Vector2d& pixel :
       {Eigen::Vector2d(0, 0), Eigen::Vector2d(w, 0), Eigen::Vector2d(0, h), Eigen::Vector2d(w, h),
        Eigen::Vector2d(0, h / 2), Eigen::Vector2d(w, h / 2)}) {
    Eigen::Vector3d ray;
    Eigen::Vector2d moved;
    if (before.unproject(pixel, &ray) && after.project(ray, &moved))
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
  // Kept for good: the share of this window that no later window will see again.
  information_ += q.H / free;
  information_vector_ += (q.H * delta_ - q.g) / free;
  const CalibrationDelta change = best - delta_;
  constexpr double kNoticeable_px = 0.02;
  if (image_change_px(change) < kNoticeable_px) return false;
  const Camera next = refined_camera(given_, best);
  if (!Camera::check(next.parameters()).empty()) return false;
  delta_ = best;
  return true;
}

}  // namespace farpoint::slam
