// Levenberg-Marquardt on the Schur complement of one-dimensional landmarks.
//
// Eliminating an inverse depth is a division by a scalar, so a landmark seen by k free poses costs k (k + 1)
// / 2 rank-one 6x6 updates; general solvers do not specialise to that (tests/bench/bench_solvers.cc compares
// with Ceres). One thread, no time limit, the same bytes every time.
#pragma once

#include <cstddef>
#include <vector>

#include "slam/solver/bundle_problem.h"
#include "slam/solver/schur_blocks.h"

namespace farpoint::slam {

// Keeps its work space from problem to problem: within the room it was made for, it takes no more memory.
class SchurSolver {
 public:
  // Room, touched at once, for problems of so many points and measurements; larger ones make it grow.
  explicit SchurSolver(std::size_t points = 0, std::size_t measurements = 0);

  BundleSummary solve(const BundleOptions& options, BundleProblem* problem);

  // Of the lists that grow with points and measurements.
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

  void prepare(BundleProblem* problem);
  [[nodiscard]] BundleSummary run(const BundleOptions& options);
  [[nodiscard]] const BundleProblem::Measurement& measurement(const BundleProblem::Point& point, int i) const;
  [[nodiscard]] double total_cost();
  [[nodiscard]] double cost_of(std::size_t k) const;  // of the k-th landmark, as below
  void linearise_all();
  void linearise_point(std::size_t k, PointBlock* block);
  void add_coupling(int pose, const Vector6d& w, PointBlock* block);
  [[nodiscard]] bool solve_step(double lambda);
  void eliminate(const PointBlock& block, double inverse_hessian);
  [[nodiscard]] double step_of(const PointBlock& block, double lambda) const;
  void save();
  void restore();
  void move_poses();
  [[nodiscard]] double move_points();
  double move_point(std::size_t k);

  BundleProblem* p_ = nullptr;
  BundleFrames frames_;
  std::vector<int> free_index_;  // one a pose: its index among the free ones, or -1
  std::vector<std::size_t> free_poses_;
  BlockMatrix hessian_, reduced_;
  Eigen::MatrixXd dense_;
  Eigen::VectorXd gradient_, reduced_gradient_, pose_step_;
  std::vector<Eigen::Vector3d> bearing_body_;  // of each point, in its host's body axes
  std::vector<PointBlock> blocks_;
  std::vector<Coupling> couplings_;  // grouped by point
  std::vector<double> point_step_, point_cost_, saved_point_cost_;
  std::vector<SE3> saved_poses_;
  std::vector<double> saved_depths_;
};

}  // namespace farpoint::slam
