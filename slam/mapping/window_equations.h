// SPDX-License-Identifier: Apache-2.0
// The normal equations of a window's poses, inverse depths and calibration, reduced to the calibration.
//
// A model of the calibration has kSize parameters and says how they move pixels:
//     PixelDerivative                          2 x kSize
//     pixel_derivative(camera, point_c, pixel) of a point in that camera's axes that projects to the pixel
//     host_derivative(bearing, &derivative)    the same of the anchor's pixel; false where it has none
//     measures_within(camera)                  whether a sighting by that camera of the host's own keyframe
//                                              is a measurement
#pragma once

#include <Eigen/Cholesky>
#include <cmath>
#include <cstddef>
#include <vector>

#include "slam/geometry/robust.h"
#include "slam/solver/bundle_problem.h"
#include "slam/solver/schur_blocks.h"

namespace farpoint::slam {

// The normal equations of poses and calibration, inverse depths eliminated point by point. All poses are
// free, those too that local BA holds fixed: they were found under the calibration of their day, and fixed
// they would speak for it.
template <typename Model>
class WindowEquations {
 public:
  static constexpr int kSize = Model::kSize;
  using Vector = Eigen::Matrix<double, kSize, 1>;
  using Square = Eigen::Matrix<double, kSize, kSize>;

  WindowEquations(const BundleProblem& problem, const Model& model) : p_(problem), model_(model) {
    poses_.resize(static_cast<int>(p_.poses.size()));
    poses_.set_zero();
    border_.assign(p_.poses.size(), Border::Zero());
    gradient_.assign(p_.poses.size(), Vector6d::Zero());
    frames_.update(p_);
  }

  // d_bearing: of the point, by its host pixel; zero where another camera is the anchor.
  void add(const BundleProblem::Point& point, const Eigen::Matrix<double, 3, 2>& d_bearing) {
    PointDerivative d_xyz_d_delta = PointDerivative::Zero();
    if (!d_bearing.isZero(0.0)) {
      typename Model::PixelDerivative d_host_pixel;
      if (!model_.host_derivative(point.bearing, &d_host_pixel)) return;
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
      if (m.chi2 > kChi2TwoDof || (m.pose == point.host && !model_.measures_within(m.camera))) continue;
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
  bool reduce(Square* H, Vector* g) {
    *H = H_;
    *g = g_;
    const auto n = static_cast<Eigen::Index>(6 * border_.size());
    Eigen::MatrixXd dense(n, n), border(n, kSize);
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
  using Border = Eigen::Matrix<double, 6, kSize>;
  using PointDerivative = Eigen::Matrix<double, 3, kSize>;

  // One point's share of what concerns its depth and the calibration.
  struct Part {
    double hessian = 0, gradient = 0;  // of the inverse depth
    Square H = Square::Zero();
    Vector g = Vector::Zero(), w = Vector::Zero();  // w: with the inverse depth
  };
  // The host's derivatives are carry(host) times these sums over all measurements.
  struct HostSums {
    Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero(), coupling = Eigen::Vector3d::Zero();
    PointDerivative border = PointDerivative::Zero();
  };
  struct Coupling {
    int pose = 0;
    Vector6d w = Vector6d::Zero();
  };

  void add_measurement(const BundleProblem::Point& point, const BundleProblem::Measurement& m,
                       const PointDerivative& d_xyz_d_delta, HostSums* sums) {
    const BundleFrames::View& view = frames_.view(m);
    WorldLinearisation lin;
    if (!linearise_world(world_, view, m, &lin)) return;
    const Eigen::Vector3d p_c = view.R_camera_world * world_.xyz + world_.inverse_depth * view.t_camera_world;
    const typename Model::PixelDerivative d_pixel =
        model_.pixel_derivative(m.camera, p_c, m.pixel + m.sigma_px * lin.residual);
    const typename Model::PixelDerivative Jd = d_pixel / m.sigma_px + lin.d_xyz * d_xyz_d_delta;
    part_.hessian += lin.d_inverse_depth.squaredNorm();
    part_.gradient += lin.d_inverse_depth.dot(lin.residual);
    part_.H.noalias() += Jd.transpose() * Jd;
    part_.g.noalias() += Jd.transpose() * lin.residual;
    part_.w.noalias() += Jd.transpose() * lin.d_inverse_depth;
    if (m.pose == point.host) return;  // by another camera of the host: no pose moves it
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
  const Model& model_;
  BundleFrames frames_;
  BlockMatrix poses_;
  std::vector<Border> border_;  // of the poses, with the calibration
  std::vector<Vector6d> gradient_;
  Square H_ = Square::Zero();
  Vector g_ = Vector::Zero();
  // Of the point that is being added.
  BundleFrames::WorldPoint world_;
  Part part_;
  std::vector<Coupling> couplings_;
};

// Information matrix and gradient of the calibration by one window, its poses free. d_bearing: as
// Calibrator::update. Residuals are not independent (one patch, one wrong assumption about its surface): they
// count as `share` of as many. False where the window determines nothing.
template <typename Model>
bool window_information(const BundleProblem& problem,
                        const std::vector<Eigen::Matrix<double, 3, 2>>& d_bearing, const Model& model,
                        double share, typename WindowEquations<Model>::Square* H,
                        typename WindowEquations<Model>::Vector* g) {
  WindowEquations<Model> equations(problem, model);
  for (std::size_t k = 0; k < problem.points.size(); ++k) equations.add(problem.points[k], d_bearing[k]);
  if (!equations.reduce(H, g) || !H->allFinite() || !g->allFinite()) return false;
  *H = (0.5 * share * (*H + H->transpose())).eval();
  *g *= share;
  return true;
}

}  // namespace farpoint::slam
