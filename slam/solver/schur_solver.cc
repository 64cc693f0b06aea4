// SPDX-License-Identifier: Apache-2.0
#include "slam/solver/schur_solver.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace farpoint::slam {

namespace {

// Takes and touches memory for `count` entries; the list ends empty.
template <typename T>
void make_room(std::size_t count, const T& anything, std::vector<T>* list) {
  list->assign(count, anything);
  list->clear();
}

}  // namespace

SchurSolver::SchurSolver(std::size_t points, std::size_t measurements) {
  make_room(points, Eigen::Vector3d(0.0, 0.0, 0.0), &bearing_body_);
  make_room(points, {}, &blocks_);
  make_room(measurements + points, {}, &couplings_);  // with each measurement's keyframe, and the host
  for (auto* list : {&point_step_, &point_cost_, &saved_point_cost_, &saved_depths_})
    make_room(points, 0.0, list);
}

std::size_t SchurSolver::bytes() const {
  const std::size_t doubles = point_step_.capacity() + point_cost_.capacity() + saved_point_cost_.capacity() +
                              saved_depths_.capacity();
  return bearing_body_.capacity() * sizeof(Eigen::Vector3d) + blocks_.capacity() * sizeof(PointBlock) +
         couplings_.capacity() * sizeof(Coupling) + doubles * sizeof(double);
}

BundleSummary SchurSolver::solve(const BundleOptions& options, BundleProblem* problem) {
  prepare(*problem);
  const BundleSummary summary = run(options, problem);
  evaluate_bundle(problem);
  return summary;
}

void SchurSolver::prepare(const BundleProblem& problem) {
  p_ = &problem;
  layout_.update(p_->states());
  full_.resize(layout_);
  dense_.resize(layout_.entries(), layout_.entries());
  blocks_.resize(p_->points.size());
  bearing_body_.clear();
  for (const auto& point : p_->points) bearing_body_.push_back(point.T_host_anchor.q * point.bearing);
  frames_.update(*p_);
}

BundleSummary SchurSolver::run(const BundleOptions& options, BundleProblem* problem) {
  BundleSummary summary;
  summary.initial_cost = summary.final_cost = total_cost();
  summary.usable = std::isfinite(summary.initial_cost);
  double lambda = 1e-4;
  double growth = 2.0;
  bool fresh = false;
  for (int i = 0; i < options.iterations && summary.usable; ++i) {
    ++summary.iterations;
    if (!fresh) linearise_all();
    fresh = true;
    if (!solve_step(lambda)) {
      lambda *= growth, growth *= 2.0;
      continue;
    }
    save();
    move_states(problem);
    const double now = move_points(problem) + factor_cost();
    if (!(now < summary.final_cost)) {
      restore(problem);
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

const BundleProblem::Measurement& SchurSolver::measurement(const BundleProblem::Point& point, int i) const {
  const int index = point.first_measurement + i;
  return p_->measurements[static_cast<std::size_t>(index)];
}

double SchurSolver::total_cost() {
  double sum = 0.0;
  point_cost_.clear();
  for (std::size_t k = 0; k < p_->points.size(); ++k) {
    point_cost_.push_back(cost_of(k));
    sum += point_cost_.back();
  }
  return sum + factor_cost();
}
double SchurSolver::factor_cost() const {
  double sum = 0.0;
  for (const StateFactor* factor : p_->factors) sum += cost(*factor, p_->states());
  return sum;
}
double SchurSolver::cost_of(std::size_t k) const {
  const BundleProblem::Point& point = p_->points[k];
  const BundleFrames::WorldPoint world = frames_.world_point(point, bearing_body_[k]);
  double sum = 0.0;
  for (int i = 0; i < point.measurements; ++i) {
    Eigen::Vector2d r;
    const auto& m = measurement(point, i);
    sum += residual_world(world, frames_.view(m), m, &r) ? huber_cost(r.squaredNorm()) : kLostCost;
  }
  return point.weight * sum;
}

void SchurSolver::linearise_all() {
  full_.set_zero();
  couplings_.clear();
  for (std::size_t k = 0; k < p_->points.size(); ++k) linearise_point(k, &blocks_[k]);
  for (const StateFactor* factor : p_->factors) full_.add(*factor, p_->states(), layout_);
}

void SchurSolver::linearise_point(std::size_t k, PointBlock* block) {
  const BundleProblem::Point& point = p_->points[k];
  *block = {};
  block->first_coupling = static_cast<int>(couplings_.size());
  const int host = layout_.free_index(point.host);
  const BundleFrames::WorldPoint world = frames_.world_point(point, bearing_body_[k]);
  const Eigen::Vector3d& t_host = frames_.body(point.host).t_world_body;
  // The host's derivatives are carry(host) times these sums over all measurements.
  Eigen::Matrix3d host_hessian = Eigen::Matrix3d::Zero();
  Eigen::Vector3d host_gradient = Eigen::Vector3d::Zero(), host_coupling = Eigen::Vector3d::Zero();
  for (int i = 0; i < point.measurements; ++i) {
    const auto& m = measurement(point, i);
    WorldLinearisation lin;
    if (!linearise_world(world, frames_.view(m), m, &lin)) continue;
    const double w = point.weight * huber_weight(lin.residual.squaredNorm());
    block->hessian += w * lin.d_inverse_depth.squaredNorm();
    block->gradient += w * lin.d_inverse_depth.dot(lin.residual);
    if (m.pose == point.host) continue;  // host and target move together: nothing changes
    const int target = layout_.free_index(m.pose);
    if (host >= 0) {
      const Eigen::Matrix<double, 3, 2> weighted = w * lin.d_xyz.transpose();
      host_hessian.noalias() += weighted * lin.d_xyz;
      host_gradient.noalias() += weighted * lin.residual;
      host_coupling.noalias() += weighted * lin.d_inverse_depth;
    }
    if (target < 0) continue;
    const Matrix26d J = carried(lin.d_xyz, -1.0, world, frames_.body(m.pose).t_world_body);
    const Matrix26d weighted = w * J;
    full_.poses.at(target, target).noalias() += J.transpose() * weighted;
    full_.gradient.segment<6>(6 * target).noalias() += weighted.transpose() * lin.residual;
    add_coupling(target, weighted.transpose() * lin.d_inverse_depth, block);
    if (host < 0) continue;
    const Matrix26d J_host = carried(lin.d_xyz, 1.0, world, t_host);
    if (host < target)
      full_.poses.at(host, target).noalias() += J_host.transpose() * weighted;
    else
      full_.poses.at(target, host).noalias() += weighted.transpose() * J_host;
  }
  if (host >= 0) {
    const Matrix36d d = carry(world, t_host);
    full_.poses.at(host, host).noalias() += d.transpose() * (host_hessian * d);
    full_.gradient.segment<6>(6 * host).noalias() += d.transpose() * host_gradient;
    add_coupling(host, d.transpose() * host_coupling, block);
  }
  // At infinity already and asked to go beyond: it stays, and the poses do not count on its going.
  if (point.inverse_depth <= 0.0 && block->gradient > 0.0) block->hessian = 0.0;
}

// Keeps a landmark's couplings in ascending order of poses; there are few.
void SchurSolver::add_coupling(int pose, const Vector6d& w, PointBlock* block) {
  const auto first = couplings_.begin() + block->first_coupling;
  auto at = couplings_.end();
  while (at != first && std::prev(at)->pose > pose) --at;
  if (at != first && std::prev(at)->pose == pose) {
    std::prev(at)->w += w;
    return;
  }
  couplings_.insert(at, {pose, w});
  ++block->couplings;
}

// Damped normal equations, inverse depths eliminated. False where the system is not positive definite.
bool SchurSolver::solve_step(double lambda) {
  reduced_ = full_;
  reduced_.damp(lambda);
  eliminate_points(lambda);
  step_.resize(reduced_.gradient.size());
  if (step_.size() > 0) {
    reduced_.copy_to(&dense_);
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>, Eigen::Upper> factor(dense_);
    if (factor.info() != Eigen::Success) return false;
    step_ = factor.solve(-reduced_.gradient);
    if (!step_.allFinite()) return false;
  }
  point_step_.assign(blocks_.size(), 0.0);
  for (std::size_t k = 0; k < blocks_.size(); ++k)
    if (blocks_[k].hessian > 0.0) point_step_[k] = step_of(blocks_[k], lambda);
  return true;
}

void SchurSolver::eliminate_points(double lambda) {
  for (const PointBlock& b : blocks_)
    if (b.hessian > 0.0) eliminate(b, 1.0 / (b.hessian * (1.0 + lambda)));
}

void SchurSolver::eliminate(const PointBlock& b, double inverse_hessian) {
  const Coupling* c = couplings_.data() + b.first_coupling;
  for (int j = 0; j < b.couplings; ++j) {
    const Vector6d scaled = inverse_hessian * c[j].w;
    reduced_.gradient.segment<6>(6 * c[j].pose) -= scaled * b.gradient;
    for (int i = 0; i <= j; ++i)
      reduced_.poses.at(c[i].pose, c[j].pose).noalias() -= c[i].w * scaled.transpose();
  }
}

double SchurSolver::step_of(const PointBlock& b, double lambda) const {
  double right = -b.gradient;
  const Coupling* c = couplings_.data() + b.first_coupling;
  for (int i = 0; i < b.couplings; ++i) right -= c[i].w.dot(step_.segment<6>(6 * c[i].pose));
  return right / (b.hessian * (1.0 + lambda));
}

void SchurSolver::save() {
  saved_poses_.clear();
  for (const std::size_t i : layout_.free_poses()) saved_poses_.push_back(p_->poses[i].T_world_body);
  saved_motions_ = p_->motions;
  saved_globals_ = p_->globals;
  saved_depths_.clear();
  for (const auto& point : p_->points) saved_depths_.push_back(point.inverse_depth);
  saved_point_cost_ = point_cost_;
}
void SchurSolver::restore(BundleProblem* problem) {
  const std::vector<std::size_t>& free_poses = layout_.free_poses();
  for (std::size_t i = 0; i < free_poses.size(); ++i)
    problem->poses[free_poses[i]].T_world_body = saved_poses_[i];
  problem->motions = saved_motions_;
  problem->globals = saved_globals_;
  for (std::size_t k = 0; k < problem->points.size(); ++k)
    problem->points[k].inverse_depth = saved_depths_[k];
  point_cost_ = saved_point_cost_;
  frames_.update(*p_);
}

void SchurSolver::move_states(BundleProblem* problem) {
  const std::vector<std::size_t>& free_poses = layout_.free_poses();
  for (std::size_t i = 0; i < free_poses.size(); ++i) {
    SE3& T = problem->poses[free_poses[i]].T_world_body;
    const auto first = static_cast<Eigen::Index>(6 * i);
    T.t += step_.segment<3>(first);
    T.q = (so3_exp(step_.segment<3>(first + 3)) * T.q).normalized();
  }
  for (std::size_t i = 0; i < problem->motions.size(); ++i) {
    const int first = layout_.offset(StateBlock::motion(static_cast<int>(i)));
    if (first >= 0) problem->motions[i].move(step_.segment<MotionState::kSize>(first));
  }
  for (std::size_t i = 0; i < problem->globals.size(); ++i) {
    const int first = layout_.offset(StateBlock::global(static_cast<int>(i)));
    if (first < 0) continue;
    Eigen::Vector2d step = Eigen::Vector2d::Zero();
    step.head(problem->globals[i].size()) = step_.segment(first, problem->globals[i].size());
    problem->globals[i].move(step);
  }
  frames_.update(*p_);
}
// Returns the cost of all landmarks afterwards.
double SchurSolver::move_points(BundleProblem* problem) {
  double sum = 0.0;
  for (std::size_t k = 0; k < problem->points.size(); ++k) sum += move_point(k, &problem->points[k]);
  return sum;
}
// A landmark whose own cost rises goes a shorter way or stays, for example where its ray passes close to a
// camera and inverse depth is far from linear. Otherwise it would have the whole step refused.
double SchurSolver::move_point(std::size_t k, BundleProblem::Point* point) {
  const double start = point->inverse_depth, before = point_cost_[k];
  const auto go = [&](double share) {
    // Nothing lies beyond infinity.
    point->inverse_depth = std::max(0.0, start + share * point_step_[k]);
    return point_cost_[k] = cost_of(k);
  };
  const double all_the_way = go(1.0);
  if (all_the_way <= before || point_step_[k] == 0.0) return all_the_way;
  const double stayed = go(0.0);
  for (const double share : {1.0, 0.125, 0.015625})
    if (go(share) < stayed) return point_cost_[k];
  return go(0.0);
}

bool SchurSolver::covariance(const BundleProblem& problem, std::span<const StateBlock> blocks,
                             Eigen::MatrixXd* out) {
  prepare(problem);
  linearise_all();
  reduced_ = full_;
  eliminate_points(0.0);
  if (layout_.entries() == 0) {
    *out = chosen_columns(blocks).transpose() * chosen_columns(blocks);
    return true;
  }
  reduced_.copy_to(&dense_);
  // Scaled to a unit diagonal: metres, radians and biases differ by orders of magnitude.
  const Eigen::ArrayXd diagonal = dense_.diagonal().array();
  if (!(diagonal > 0.0).all()) return false;
  const Eigen::VectorXd scale = diagonal.rsqrt();
  dense_ = scale.asDiagonal() * dense_ * scale.asDiagonal();
  const Eigen::LLT<Eigen::MatrixXd, Eigen::Upper> factor(dense_);
  // A direction that nothing measures leaves a condition of about 1e16; the rest of the largest windows 1e8.
  constexpr double kSingular = 1e-13;
  if (factor.info() != Eigen::Success || factor.rcond() < kSingular) return false;
  const Eigen::MatrixXd chosen = scale.asDiagonal() * chosen_columns(blocks);
  *out = chosen.transpose() * factor.solve(chosen);
  return out->allFinite();
}

// Maps the reduced system's steps (transposed) to the perturbations of the blocks, side by side.
Eigen::MatrixXd SchurSolver::chosen_columns(std::span<const StateBlock> blocks) const {
  const StateWindow states = p_->states();
  int columns = 0;
  for (const StateBlock block : blocks) columns += states.size(block);
  Eigen::MatrixXd chosen = Eigen::MatrixXd::Zero(layout_.entries(), columns);
  int column = 0;
  for (const StateBlock block : blocks) {
    const int size = states.size(block), row = layout_.offset(block);
    if (row >= 0 && block.kind == StateBlock::Kind::kPose) {
      const Eigen::Matrix3d R_world_body = states.T_world_body(block.index).rotation();
      chosen.block<3, 3>(row, column) = R_world_body;
      chosen.block<3, 3>(row + 3, column + 3) = R_world_body;
    } else if (row >= 0) {
      chosen.block(row, column, size, size).setIdentity();
    }
    column += size;
  }
  return chosen;
}

BundleSummary solve_schur(const BundleOptions& options, BundleProblem* problem) {
  return SchurSolver().solve(options, problem);
}

}  // namespace farpoint::slam
