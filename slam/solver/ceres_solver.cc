// SPDX-License-Identifier: Apache-2.0
#include "slam/solver/ceres_solver.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

namespace farpoint::slam {

namespace {

// A body pose as a parameter block: quaternion x y z w, then translation; moved by SE3::boxplus.
//
// The cost functions below give their derivatives by the six numbers of boxplus in the first six of the seven
// columns; the Jacobian of Plus picks those. Each derivative is computed once, for the tangent. Nothing is
// lost: Ceres uses the seven columns in their product with this matrix only.
class BodyPoseManifold final : public ceres::Manifold {
 public:
  static constexpr int kAmbient = 7, kTangent = 6;

  static SE3 read(const double* x) {
    return {Eigen::Quaterniond(Eigen::Map<const Eigen::Vector4d>(x)),
            Eigen::Map<const Eigen::Vector3d>(x + 4)};
  }
  static void write(const SE3& T, double* x) {
    Eigen::Map<Eigen::Vector4d>{x} = T.q.coeffs();
    Eigen::Map<Eigen::Vector3d>{x + 4} = T.t;
  }

  int AmbientSize() const override { return kAmbient; }
  int TangentSize() const override { return kTangent; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    write(read(x).boxplus(Eigen::Map<const Vector6d>(delta)), x_plus_delta);
    return true;
  }
  bool Minus(const double* y, const double* x, double* y_minus_x) const override {
    Eigen::Map<Vector6d>{y_minus_x} = read(x).boxminus_to(read(y));
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, kAmbient, kTangent, Eigen::RowMajor>>{jacobian}.setIdentity();
    return true;
  }
  bool MinusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, kTangent, kAmbient, Eigen::RowMajor>>{jacobian}.setIdentity();
    return true;
  }
};

// A motion, entry by entry.
struct MotionBlock {
  static constexpr int kAmbient = MotionState::kSize;

  static void read(const double* x, MotionState* m) {
    m->velocity_world = Eigen::Map<const Eigen::Vector3d>(x);
    m->gyroscope_bias_rad_per_s = Eigen::Map<const Eigen::Vector3d>(x + 3);
    m->accelerometer_bias_m_per_s2 = Eigen::Map<const Eigen::Vector3d>(x + 6);
  }
  static void write(const MotionState& m, double* x) {
    Eigen::Map<Vector9d>{x} << m.velocity_world, m.gyroscope_bias_rad_per_s, m.accelerometer_bias_m_per_s2;
  }
};

// A global, by GlobalState::move; derivatives in the first columns, as with poses.
class GlobalManifold final : public ceres::Manifold {
 public:
  static constexpr int kAmbient = 3;

  explicit GlobalManifold(GlobalState like) : like_(std::move(like)) {}

  int AmbientSize() const override { return kAmbient; }
  int TangentSize() const override { return like_.size(); }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    GlobalState g = at(x);
    Eigen::Vector2d d = Eigen::Vector2d::Zero();
    std::copy_n(delta, like_.size(), d.data());
    g.move(d);
    Eigen::Map<Eigen::Vector3d>{x_plus_delta} = g.value;
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, kAmbient, Eigen::Dynamic, Eigen::RowMajor>>(jacobian, kAmbient,
                                                                                 like_.size())
        .setIdentity();
    return true;
  }
  // Ceres uses Minus only where residuals are manifold-valued; there are none.
  bool Minus(const double*, const double*, double*) const override { return false; }
  bool MinusJacobian(const double*, double*) const override { return false; }

 private:
  [[nodiscard]] GlobalState at(const double* x) const {
    GlobalState g = like_;
    g.value = Eigen::Map<const Eigen::Vector3d>(x);
    return g;
  }
  GlobalState like_;
};

// Ceres's present state as a BundleProblem.
class State final : public ceres::EvaluationCallback {
 public:
  explicit State(BundleProblem* problem)
      : problem_(*problem),
        poses_(BodyPoseManifold::kAmbient * problem->poses.size()),
        motions_(MotionBlock::kAmbient * problem->motions.size()),
        globals_(GlobalManifold::kAmbient * problem->globals.size()) {
    for (std::size_t i = 0; i < problem_.poses.size(); ++i)
      BodyPoseManifold::write(problem_.poses[i].T_world_body, pose(static_cast<int>(i)));
    for (std::size_t i = 0; i < problem_.motions.size(); ++i)
      MotionBlock::write(problem_.motions[i], motion(static_cast<int>(i)));
    for (std::size_t i = 0; i < problem_.globals.size(); ++i)
      Eigen::Map<Eigen::Vector3d>{global(static_cast<int>(i))} = problem_.globals[i].value;
    depths_.reserve(problem_.points.size());
    for (const auto& point : problem_.points) depths_.push_back(point.inverse_depth);
  }

  void PrepareForEvaluation(bool, bool new_evaluation_point) override {
    if (!new_evaluation_point) return;
    store();
    frames_.update(problem_);
  }
  // Copies Ceres's parameters into the problem.
  void store() {
    for (std::size_t i = 0; i < problem_.poses.size(); ++i)
      if (!problem_.poses[i].fixed) problem_.poses[i].T_world_body = BodyPoseManifold::read(&poses_[7 * i]);
    for (std::size_t i = 0; i < problem_.motions.size(); ++i)
      MotionBlock::read(motion(static_cast<int>(i)), &problem_.motions[i]);
    for (std::size_t i = 0; i < problem_.globals.size(); ++i)
      problem_.globals[i].value = Eigen::Map<const Eigen::Vector3d>(global(static_cast<int>(i)));
    for (std::size_t k = 0; k < depths_.size(); ++k) problem_.points[k].inverse_depth = depths_[k];
  }

  [[nodiscard]] double* pose(int i) {
    return &poses_[BodyPoseManifold::kAmbient * static_cast<std::size_t>(i)];
  }
  [[nodiscard]] double* motion(int i) {
    return &motions_[MotionBlock::kAmbient * static_cast<std::size_t>(i)];
  }
  [[nodiscard]] double* global(int i) {
    return &globals_[GlobalManifold::kAmbient * static_cast<std::size_t>(i)];
  }
  [[nodiscard]] double* block(StateBlock b) {
    switch (b.kind) {
      case StateBlock::Kind::kPose:
        return pose(b.index);
      case StateBlock::Kind::kMotion:
        return motion(b.index);
      case StateBlock::Kind::kGlobal:
        break;
    }
    return global(b.index);
  }
  [[nodiscard]] double* depth(std::size_t point) { return &depths_[point]; }
  [[nodiscard]] const BundleProblem& problem() const { return problem_; }
  [[nodiscard]] const BundleFrames& frames() const { return frames_; }

 private:
  BundleProblem& problem_;
  BundleFrames frames_;
  std::vector<double> poses_, motions_, globals_, depths_;
};

// One measurement. Parameters: inverse depth, then (unless host and target are one) host pose and target
// pose. Reads the state from the problem, where the callback has put it.
class MeasurementCost final : public ceres::CostFunction {
 public:
  MeasurementCost(const State& state, std::size_t point, std::size_t measurement)
      : state_(state), point_(point), measurement_(measurement) {
    set_num_residuals(2);
    mutable_parameter_block_sizes()->push_back(1);
    if (moves()) {
      mutable_parameter_block_sizes()->push_back(BodyPoseManifold::kAmbient);
      mutable_parameter_block_sizes()->push_back(BodyPoseManifold::kAmbient);
    }
  }

  bool Evaluate(double const* const*, double* residuals, double** jacobians) const override {
    const BundleFrames& frames = state_.frames();
    const BundleProblem::Measurement& m = measurement();
    Eigen::Map<Eigen::Vector2d> r(residuals);
    if (jacobians == nullptr) {
      Eigen::Vector2d now;
      r = residual_world(frames.world_point(point()), frames.view(m), m, &now) ? now : lost();
      return true;
    }
    BundleLinearisation lin;
    if (!linearise(frames, point(), m, &lin)) {
      lin.residual = lost();
      lin.d_inverse_depth.setZero();
      lin.d_host.setZero();
      lin.d_target.setZero();
    }
    r = lin.residual;
    if (jacobians[0] != nullptr) Eigen::Map<Eigen::Vector2d>{jacobians[0]} = lin.d_inverse_depth;
    if (moves()) {
      write(lin.d_host, jacobians[1]);
      write(lin.d_target, jacobians[2]);
    }
    return true;
  }

 private:
  [[nodiscard]] const BundleProblem::Point& point() const { return state_.problem().points[point_]; }
  [[nodiscard]] const BundleProblem::Measurement& measurement() const {
    return state_.problem().measurements[measurement_];
  }
  [[nodiscard]] bool moves() const { return point().host != measurement().pose; }

  // The residual whose loss is kLostCost: 0.5 rho(s) = delta (sqrt(s) - delta / 2).
  static Eigen::Vector2d lost() { return {kLostCost / kHuberDelta + 0.5 * kHuberDelta, 0.0}; }

  static void write(const Eigen::Matrix<double, 2, 6>& by_tangent, double* jacobian) {
    if (jacobian == nullptr) return;
    Eigen::Map<Eigen::Matrix<double, 2, BodyPoseManifold::kAmbient, Eigen::RowMajor>> out(jacobian);
    out.leftCols<6>() = by_tangent;
    out.col(6).setZero();
  }

  const State& state_;
  std::size_t point_, measurement_;
};

int ambient_size(StateBlock block) {
  switch (block.kind) {
    case StateBlock::Kind::kPose:
      return BodyPoseManifold::kAmbient;
    case StateBlock::Kind::kMotion:
      return MotionBlock::kAmbient;
    case StateBlock::Kind::kGlobal:
      break;
  }
  return GlobalManifold::kAmbient;
}

// One factor. Parameters: its states. Reads them from the problem, where the callback has put them.
class FactorCost final : public ceres::CostFunction {
 public:
  FactorCost(const State& state, const StateFactor& factor) : state_(state), factor_(factor) {
    set_num_residuals(factor.residuals());
    for (const StateBlock block : factor.blocks())
      mutable_parameter_block_sizes()->push_back(ambient_size(block));
  }

  bool Evaluate(double const* const*, double* residuals, double** jacobians) const override {
    const StateWindow states = state_.problem().states();
    FactorResidual r;
    FactorJacobian J;
    r.setZero(num_residuals());
    J.setZero(num_residuals(), columns(factor_, states));
    factor_.evaluate(states, &r, jacobians == nullptr ? nullptr : &J);
    Eigen::Map<Eigen::VectorXd>(residuals, num_residuals()) = r;
    if (jacobians == nullptr) return true;
    int first = 0;
    for (std::size_t i = 0; i < factor_.blocks().size(); ++i) {
      const StateBlock block = factor_.blocks()[i];
      const int size = states.size(block);
      if (jacobians[i] != nullptr) {
        Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> out(
            jacobians[i], num_residuals(), ambient_size(block));
        out.setZero();
        out.leftCols(size) = J.middleCols(first, size);
      }
      first += size;
    }
    return true;
  }

 private:
  const State& state_;
  const StateFactor& factor_;
};

ceres::Problem::Options problem_options(State* state) {
  ceres::Problem::Options options;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.evaluation_callback = state;
  return options;
}

// One thread and a limit on iterations, not on time: the same bytes every time.
ceres::Solver::Options solver_options(const BundleOptions& options) {
  ceres::Solver::Options o;
  o.linear_solver_type = ceres::DENSE_SCHUR;
  o.max_num_iterations = options.iterations;
  o.function_tolerance = options.relative_decrease;
  o.gradient_tolerance = 0.0;
  o.parameter_tolerance = 0.0;
  o.max_solver_time_in_seconds = std::numeric_limits<double>::max();
  o.num_threads = 1;
  o.logging_type = ceres::SILENT;
  o.minimizer_progress_to_stdout = false;
  o.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  return o;
}

// Adds every measurement. A pose's block is added with its first measurement, so that none is without a
// residual.
void add_measurements(State* state, std::deque<ceres::ScaledLoss>* losses, ceres::Problem* problem) {
  const BundleProblem& bundle = state->problem();
  for (std::size_t k = 0; k < bundle.points.size(); ++k) {
    const BundleProblem::Point& point = bundle.points[k];
    ceres::ScaledLoss* loss = &(*losses)[k];
    for (int i = 0; i < point.measurements; ++i) {
      const auto index = static_cast<std::size_t>(point.first_measurement + i);
      const int target = bundle.measurements[index].pose;
      auto* cost = new MeasurementCost(*state, k, index);  // the problem owns it
      if (target == point.host) {
        problem->AddResidualBlock(cost, loss, state->depth(k));
      } else {
        problem->AddResidualBlock(cost, loss, state->depth(k), state->pose(point.host), state->pose(target));
      }
    }
    if (point.measurements > 0) problem->SetParameterLowerBound(state->depth(k), 0, 0.0);
  }
}

void add_factors(State* state, std::deque<ceres::HuberLoss>* losses, ceres::Problem* problem) {
  for (const StateFactor* factor : state->problem().factors) {
    ceres::LossFunction* loss = nullptr;
    if (std::isfinite(factor->huber_delta())) loss = &losses->emplace_back(factor->huber_delta());
    std::vector<double*> parameters;
    for (const StateBlock block : factor->blocks()) parameters.push_back(state->block(block));
    problem->AddResidualBlock(new FactorCost(*state, *factor), loss, parameters);  // the problem owns it
  }
}

// Every state of the problem that some residual depends on.
std::vector<StateBlock> blocks_in_use(State* state, const ceres::Problem& problem) {
  const BundleProblem& bundle = state->problem();
  std::vector<StateBlock> out;
  const auto add = [&](StateBlock block) {
    if (problem.HasParameterBlock(state->block(block))) out.push_back(block);
  };
  for (std::size_t i = 0; i < bundle.poses.size(); ++i) add(StateBlock::pose(static_cast<int>(i)));
  for (std::size_t i = 0; i < bundle.motions.size(); ++i) add(StateBlock::motion(static_cast<int>(i)));
  for (std::size_t i = 0; i < bundle.globals.size(); ++i) add(StateBlock::global(static_cast<int>(i)));
  return out;
}

// A bundle problem as Ceres holds it.
class CeresProblem {
 public:
  explicit CeresProblem(BundleProblem* bundle) : state_(bundle), problem_(problem_options(&state_)) {
    for (const BundleProblem::Point& point : bundle->points)
      losses_.emplace_back(&huber_, point.weight, ceres::DO_NOT_TAKE_OWNERSHIP);
    for (const GlobalState& global : bundle->globals) global_manifolds_.emplace_back(global);
    add_measurements(&state_, &losses_, &problem_);
    add_factors(&state_, &factor_losses_, &problem_);
    set_manifolds();
  }
  CeresProblem(const CeresProblem&) = delete;
  CeresProblem& operator=(const CeresProblem&) = delete;

  State& state() { return state_; }
  ceres::Problem& problem() { return problem_; }

  // Inverse depths go first; all other states after all of them.
  void order_elimination(ceres::ParameterBlockOrdering* ordering) {
    for (std::size_t k = 0; k < state_.problem().points.size(); ++k)
      if (problem_.HasParameterBlock(state_.depth(k))) ordering->AddElementToGroup(state_.depth(k), 0);
    for (const StateBlock block : blocks_in_use(&state_, problem_))
      ordering->AddElementToGroup(state_.block(block), 1);
  }

 private:
  void set_manifolds() {
    for (const StateBlock block : blocks_in_use(&state_, problem_)) {
      double* x = state_.block(block);
      if (block.kind == StateBlock::Kind::kPose) problem_.SetManifold(x, &pose_manifold_);
      if (block.kind == StateBlock::Kind::kGlobal)
        problem_.SetManifold(x, &global_manifolds_[static_cast<std::size_t>(block.index)]);
      if (state_.problem().states().is_fixed(block)) problem_.SetParameterBlockConstant(x);
    }
  }

  State state_;
  ceres::HuberLoss huber_{kHuberDelta};
  std::deque<ceres::ScaledLoss> losses_;
  std::deque<ceres::HuberLoss> factor_losses_;
  BodyPoseManifold pose_manifold_;
  std::deque<GlobalManifold> global_manifolds_;
  ceres::Problem problem_;
};

}  // namespace

BundleSummary solve_ceres(const BundleOptions& options, BundleProblem* problem) {
  CeresProblem bundle(problem);
  ceres::Solver::Options solver = solver_options(options);
  bundle.order_elimination(solver.linear_solver_ordering.get());

  ceres::Solver::Summary report;
  ceres::Solve(solver, &bundle.problem(), &report);
  bundle.state().store();
  evaluate_bundle(problem);

  BundleSummary summary;
  summary.initial_cost = report.initial_cost;
  summary.final_cost = report.final_cost;
  // Ceres counts the evaluation of the start as an iteration.
  summary.iterations = std::max(0, static_cast<int>(report.iterations.size()) - 1);
  summary.usable = report.IsSolutionUsable();
  return summary;
}

bool covariance_ceres(const BundleProblem& problem, std::span<const StateBlock> blocks,
                      Eigen::MatrixXd* out) {
  BundleProblem copy = problem;
  CeresProblem bundle(&copy);
  std::vector<const double*> parameters;
  Eigen::Index columns = 0;
  for (const StateBlock block : blocks) {
    parameters.push_back(bundle.state().block(block));
    columns += problem.states().size(block);
  }
  ceres::Covariance::Options options;
  options.num_threads = 1;
  ceres::Covariance covariance(options);
  if (!covariance.Compute(parameters, &bundle.problem())) return false;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> joint(columns, columns);
  if (!covariance.GetCovarianceMatrixInTangentSpace(parameters, joint.data())) return false;
  *out = joint;
  return true;
}

}  // namespace farpoint::slam
