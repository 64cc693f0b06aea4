// Levenberg-Marquardt on the Schur complement of one-dimensional landmarks.
//
// Eliminating an inverse depth is a division by a scalar, so a landmark seen by k free poses costs k (k + 1)
// / 2 rank-one 6x6 updates; general solvers do not specialise to that (see tests/bench for the comparison
// with Ceres).
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "slam/mapping/bundle_problem.h"

namespace farpoint::slam {

namespace {

double huber_cost(double squared) {
  const double r = std::sqrt(squared);
  return r <= kHuberDelta ? 0.5 * squared : kHuberDelta * (r - 0.5 * kHuberDelta);
}
double huber_weight(double squared) {
  const double r = std::sqrt(squared);
  return r <= kHuberDelta ? 1.0 : kHuberDelta / r;
}

// A landmark's part of the normal equations.
struct PointBlock {
  double hessian = 0, gradient = 0;
  int first_coupling = 0, couplings = 0;
};
// d2(cost) / d(pose) d(inverse depth) for one free pose.
struct Coupling {
  int pose = 0;  // index among the free poses
  Vector6d w = Vector6d::Zero();
};

class SchurSolver {
 public:
  explicit SchurSolver(BundleProblem* problem) : p_(*problem) {
    free_index_.assign(p_.poses.size(), -1);
    for (std::size_t i = 0; i < p_.poses.size(); ++i)
      if (!p_.poses[i].fixed) {
        free_index_[i] = static_cast<int>(free_poses_.size());
        free_poses_.push_back(i);
      }
    const auto n = static_cast<Eigen::Index>(6 * free_poses_.size());
    hessian_.resize(n, n);
    reduced_.resize(n, n);
    gradient_.resize(n);
    reduced_gradient_.resize(n);
    blocks_.resize(p_.points.size());
  }

  BundleSummary run(const BundleOptions& options) {
    BundleSummary summary;
    summary.initial_cost = summary.final_cost = cost();
    summary.usable = std::isfinite(summary.initial_cost);
    double lambda = 1e-4;
    double growth = 2.0;
    bool fresh = false;
    for (int i = 0; i < options.iterations && summary.usable; ++i) {
      ++summary.iterations;
      if (!fresh) linearise_all();
      fresh = true;
      if (!solve(lambda)) {
        lambda *= growth, growth *= 2.0;
        continue;
      }
      save();
      apply();
      const double now = cost();
      if (!(now < summary.final_cost)) {
        restore();
        lambda *= growth, growth *= 2.0;
        continue;
      }
      const double gain = (summary.final_cost - now) / std::max(summary.final_cost, 1e-12);
      summary.final_cost = now;
      lambda = std::max(lambda * 0.2, 1e-9);
      growth = 2.0;
      fresh = false;
      if (gain < options.relative_decrease) break;
    }
    return summary;
  }

 private:
  double cost() const {
    double sum = 0.0;
    for (const auto& point : p_.points)
      for (int i = 0; i < point.measurements; ++i) {
        Eigen::Vector2d r;
        const auto& m = p_.measurements[static_cast<std::size_t>(point.first_measurement + i)];
        sum += residual(p_, point, m, &r) ? huber_cost(r.squaredNorm()) : kLostCost;
      }
    return sum;
  }

  Vector6d& coupling(PointBlock* block, int pose) {
    for (int i = 0; i < block->couplings; ++i) {
      Coupling& c = couplings_[static_cast<std::size_t>(block->first_coupling + i)];
      if (c.pose == pose) return c.w;
    }
    couplings_.push_back({pose, Vector6d::Zero()});
    ++block->couplings;
    return couplings_.back().w;
  }

  void linearise_all() {
    hessian_.setZero();
    gradient_.setZero();
    couplings_.clear();
    for (std::size_t k = 0; k < p_.points.size(); ++k) linearise_point(p_.points[k], &blocks_[k]);
  }

  void linearise_point(const BundleProblem::Point& point, PointBlock* block) {
    *block = {};
    block->first_coupling = static_cast<int>(couplings_.size());
    const int host = free_index_[static_cast<std::size_t>(point.host)];
    for (int i = 0; i < point.measurements; ++i) {
      const auto& m = p_.measurements[static_cast<std::size_t>(point.first_measurement + i)];
      BundleLinearisation lin;
      if (!linearise(p_, point, m, &lin)) continue;
      const double w = huber_weight(lin.residual.squaredNorm());
      block->hessian += w * lin.d_inverse_depth.squaredNorm();
      block->gradient += w * lin.d_inverse_depth.dot(lin.residual);
      const int target = free_index_[static_cast<std::size_t>(m.pose)];
      if (point.host == m.pose) continue;
      if (host >= 0) add_pose(host, lin.d_host, lin, w, block);
      if (target >= 0) add_pose(target, lin.d_target, lin, w, block);
      if (host >= 0 && target >= 0) {
        // Only the upper triangle is kept.
        if (host < target)
          hessian_.block<6, 6>(6 * host, 6 * target).noalias() += w * lin.d_host.transpose() * lin.d_target;
        else
          hessian_.block<6, 6>(6 * target, 6 * host).noalias() += w * lin.d_target.transpose() * lin.d_host;
      }
    }
  }

  void add_pose(int pose, const Eigen::Matrix<double, 2, 6>& J, const BundleLinearisation& lin, double w,
                PointBlock* block) {
    hessian_.block<6, 6>(6 * pose, 6 * pose).noalias() += w * J.transpose() * J;
    gradient_.segment<6>(6 * pose).noalias() += w * J.transpose() * lin.residual;
    coupling(block, pose).noalias() += w * J.transpose() * lin.d_inverse_depth;
  }

  // Damped normal equations, inverse depths eliminated. False where the system is not positive definite.
  bool solve(double lambda) {
    reduced_ = hessian_;
    reduced_gradient_ = gradient_;
    for (Eigen::Index i = 0; i < reduced_.rows(); ++i)
      reduced_(i, i) += lambda * std::clamp(hessian_(i, i), 1e-6, 1e32);
    for (const PointBlock& b : blocks_) {
      if (b.hessian <= 0.0) continue;
      const double inverse = 1.0 / (b.hessian * (1.0 + lambda));
      const Coupling* c = couplings_.data() + b.first_coupling;
      for (int i = 0; i < b.couplings; ++i) {
        const Vector6d scaled = inverse * c[i].w;
        reduced_gradient_.segment<6>(6 * c[i].pose) -= scaled * b.gradient;
        for (int j = 0; j < b.couplings; ++j)
          if (c[i].pose <= c[j].pose)
            reduced_.block<6, 6>(6 * c[i].pose, 6 * c[j].pose).noalias() -= scaled * c[j].w.transpose();
      }
    }
    if (reduced_.rows() > 0) {
      const Eigen::LLT<Eigen::MatrixXd, Eigen::Upper> factor(reduced_);
      if (factor.info() != Eigen::Success) return false;
      pose_step_ = factor.solve(-reduced_gradient_);
      if (!pose_step_.allFinite()) return false;
    } else {
      pose_step_.resize(0);
    }
    point_step_.assign(blocks_.size(), 0.0);
    for (std::size_t k = 0; k < blocks_.size(); ++k) {
      const PointBlock& b = blocks_[k];
      if (b.hessian <= 0.0) continue;
      double right = -b.gradient;
      const Coupling* c = couplings_.data() + b.first_coupling;
      for (int i = 0; i < b.couplings; ++i) right -= c[i].w.dot(pose_step_.segment<6>(6 * c[i].pose));
      point_step_[k] = right / (b.hessian * (1.0 + lambda));
    }
    return true;
  }

  void save() {
    saved_poses_.clear();
    for (const std::size_t i : free_poses_) saved_poses_.push_back(p_.poses[i].T_world_body);
    saved_depths_.clear();
    for (const auto& point : p_.points) saved_depths_.push_back(point.inverse_depth);
  }
  void restore() {
    for (std::size_t i = 0; i < free_poses_.size(); ++i)
      p_.poses[free_poses_[i]].T_world_body = saved_poses_[i];
    for (std::size_t k = 0; k < p_.points.size(); ++k) p_.points[k].inverse_depth = saved_depths_[k];
  }
  void apply() {
    for (std::size_t i = 0; i < free_poses_.size(); ++i) {
      SE3& T = p_.poses[free_poses_[i]].T_world_body;
      T = T.boxplus(pose_step_.segment<6>(static_cast<Eigen::Index>(6 * i)));
    }
    // Nothing lies beyond infinity.
    for (std::size_t k = 0; k < p_.points.size(); ++k)
      p_.points[k].inverse_depth = std::max(0.0, p_.points[k].inverse_depth + point_step_[k]);
  }

  BundleProblem& p_;
  std::vector<int> free_index_;
  std::vector<std::size_t> free_poses_;
  Eigen::MatrixXd hessian_, reduced_;
  Eigen::VectorXd gradient_, reduced_gradient_, pose_step_;
  std::vector<PointBlock> blocks_;
  std::vector<Coupling> couplings_;
  std::vector<double> point_step_;
  std::vector<SE3> saved_poses_;
  std::vector<double> saved_depths_;
};

}  // namespace

BundleSummary solve_schur(const BundleOptions& options, BundleProblem* problem) {
  SchurSolver solver(problem);
  const BundleSummary summary = solver.run(options);
  evaluate_bundle(problem);
  return summary;
}

}  // namespace farpoint::slam
