// The bundle problem by Ceres: the general solver that solve_schur is held to, and the fallback
// `mapping.solver: ceres`.
#include <ceres/ceres.h>

#include <algorithm>
#include <deque>
#include <limits>
#include <memory>
#include <vector>

#include "slam/solver/bundle_problem.h"

namespace farpoint::slam {

namespace {

// A body pose as Ceres sees it: quaternion x y z w, then translation; moved by SE3::boxplus.
//
// The cost functions below give their derivatives by the six numbers of boxplus in the first six of the seven
// columns; the Jacobian of Plus therefore only picks those. Each derivative is thus computed once and for the
// tangent, and nothing is lost, since Ceres uses the seven columns for nothing but their product with this
// matrix.
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

// Ceres's present state as a BundleProblem.
class State final : public ceres::EvaluationCallback {
 public:
  explicit State(BundleProblem* problem) : problem_(*problem), poses_(7 * problem->poses.size()) {
    for (std::size_t i = 0; i < problem_.poses.size(); ++i)
      BodyPoseManifold::write(problem_.poses[i].T_world_body, pose(static_cast<int>(i)));
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
    for (std::size_t k = 0; k < depths_.size(); ++k) problem_.points[k].inverse_depth = depths_[k];
  }

  [[nodiscard]] double* pose(int i) { return &poses_[7 * static_cast<std::size_t>(i)]; }
  [[nodiscard]] double* depth(std::size_t point) { return &depths_[point]; }
  [[nodiscard]] const BundleProblem& problem() const { return problem_; }
  [[nodiscard]] const BundleFrames& frames() const { return frames_; }

 private:
  BundleProblem& problem_;
  BundleFrames frames_;
  std::vector<double> poses_, depths_;
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

// Adds every measurement; pose blocks come into being with their first one, so that none is without a
// residual.
void add_measurements(State* state, std::deque<ceres::ScaledLoss>* losses, ceres::Manifold* manifold,
                      ceres::Problem* problem) {
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
  for (std::size_t i = 0; i < bundle.poses.size(); ++i) {
    double* block = state->pose(static_cast<int>(i));
    if (!problem->HasParameterBlock(block)) continue;
    problem->SetManifold(block, manifold);
    if (bundle.poses[i].fixed) problem->SetParameterBlockConstant(block);
  }
}

// Inverse depths go first; every pose after all of them.
void order_elimination(State* state, const ceres::Problem& problem, ceres::ParameterBlockOrdering* ordering) {
  const BundleProblem& bundle = state->problem();
  for (std::size_t k = 0; k < bundle.points.size(); ++k)
    if (problem.HasParameterBlock(state->depth(k))) ordering->AddElementToGroup(state->depth(k), 0);
  for (std::size_t i = 0; i < bundle.poses.size(); ++i) {
    double* block = state->pose(static_cast<int>(i));
    if (problem.HasParameterBlock(block)) ordering->AddElementToGroup(block, 1);
  }
}

}  // namespace

BundleSummary solve_ceres(const BundleOptions& options, BundleProblem* problem) {
  State state(problem);
  ceres::HuberLoss huber(kHuberDelta);
  std::deque<ceres::ScaledLoss> losses;
  for (const BundleProblem::Point& point : problem->points)
    losses.emplace_back(&huber, point.weight, ceres::DO_NOT_TAKE_OWNERSHIP);
  BodyPoseManifold manifold;
  ceres::Problem ceres_problem(problem_options(&state));
  add_measurements(&state, &losses, &manifold, &ceres_problem);
  ceres::Solver::Options solver = solver_options(options);
  order_elimination(&state, ceres_problem, solver.linear_solver_ordering.get());

  ceres::Solver::Summary report;
  ceres::Solve(solver, &ceres_problem, &report);
  state.store();
  evaluate_bundle(problem);

  BundleSummary summary;
  summary.initial_cost = report.initial_cost;
  summary.final_cost = report.final_cost;
  // Ceres counts the evaluation of the start as an iteration.
  summary.iterations = std::max(0, static_cast<int>(report.iterations.size()) - 1);
  summary.usable = report.IsSolutionUsable();
  return summary;
}

}  // namespace farpoint::slam
