// SPDX-License-Identifier: Apache-2.0
// Levenberg-Marquardt on the Schur complement of one-dimensional landmarks.
//
// Eliminating an inverse depth is a division by a scalar, so a landmark seen by k free poses costs
// k (k + 1) / 2 rank-one 6x6 updates. General solvers lack that case (tests/bench/bench_solvers.cc compares
// with Ceres). Poses, motions and globals stay in the reduced system. One thread, no time limit, repeatable
// to the bit.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "slam/solver/bundle_problem.h"
#include "slam/solver/normal_equations.h"

namespace farpoint::slam {

// Keeps its work space from problem to problem. A problem within the constructor's sizes takes no more memory
// for points and measurements.
class SchurSolver {
 public:
  // Takes and touches memory for this many points and measurements. Larger problems make it grow.
  explicit SchurSolver(std::size_t points = 0, std::size_t measurements = 0);

  BundleSummary solve(const BundleOptions& options, BundleProblem* problem);

  // Joint covariance of chosen states at the problem's present state, inverse depths and all other states
  // marginalised out. Rows and columns follow `blocks`; perturbations as in states.h (poses in body axes).
  // A fixed state has zeros. Measurements weigh as in the solve (Huber). False where the system leaves a free
  // state undetermined.
  [[nodiscard]] bool covariance(const BundleProblem& problem, std::span<const StateBlock> blocks,
                                Eigen::MatrixXd* out);

  // Memory of the lists that grow with points and measurements.
  [[nodiscard]] std::size_t bytes() const;

 private:
  // A landmark's part of the normal equations.
  struct PointBlock {
    double hessian = 0, gradient = 0;  // hessian 0: not moved in this step
    int first_coupling = 0, couplings = 0;
  };
  // d2(cost) / d(pose) d(inverse depth) for one free pose.
  struct Coupling {
    int pose = 0;  // index among the free poses
    Vector6d w = Vector6d::Zero();
  };

  void prepare(const BundleProblem& problem);
  [[nodiscard]] BundleSummary run(const BundleOptions& options, BundleProblem* problem);
  [[nodiscard]] const BundleProblem::Measurement& measurement(const BundleProblem::Point& point, int i) const;
  [[nodiscard]] double total_cost();
  [[nodiscard]] double cost_of(std::size_t k) const;  // of the k-th landmark
  [[nodiscard]] double factor_cost() const;
  void linearise_all();
  void linearise_point(std::size_t k, PointBlock* block);
  void add_coupling(int pose, const Vector6d& w, PointBlock* block);
  [[nodiscard]] bool solve_step(double lambda);
  void eliminate_points(double lambda);
  void eliminate(const PointBlock& block, double inverse_hessian);
  [[nodiscard]] double step_of(const PointBlock& block, double lambda) const;
  void save();
  void restore(BundleProblem* problem);
  void move_states(BundleProblem* problem);
  [[nodiscard]] double move_points(BundleProblem* problem);
  double move_point(std::size_t k, BundleProblem::Point* point);
  [[nodiscard]] Eigen::MatrixXd chosen_columns(std::span<const StateBlock> blocks) const;

  const BundleProblem* p_ = nullptr;  // the one being worked on
  BundleFrames frames_;
  StateLayout layout_;
  NormalEquations full_, reduced_;
  Eigen::MatrixXd dense_;
  Eigen::VectorXd step_;                       // of the reduced system
  std::vector<Eigen::Vector3d> bearing_body_;  // of each point, in its host's body axes
  std::vector<PointBlock> blocks_;
  std::vector<Coupling> couplings_;  // grouped by point
  std::vector<double> point_step_, point_cost_, saved_point_cost_;
  std::vector<SE3> saved_poses_;
  std::vector<MotionState> saved_motions_;
  std::vector<GlobalState> saved_globals_;
  std::vector<double> saved_depths_;
};

}  // namespace farpoint::slam
