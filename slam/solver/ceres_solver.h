// SPDX-License-Identifier: Apache-2.0
// The bundle problem by Ceres: the reference that tests hold SchurSolver to, and `mapping.solver: ceres`.
//
// Not part of the estimator's library: Debian's Ceres brings GPL code. Tests and tools link it; farpointd
// loads it as a module (slam/ceres_module.h).
#pragma once

#include <span>

#include "slam/solver/bundle_problem.h"

namespace farpoint::slam {

// Minimises the same cost as solve_schur. One thread, no time limit, repeatable to the bit.
BundleSummary solve_ceres(const BundleOptions& options, BundleProblem* problem);

// The same as SchurSolver::covariance, by ceres::Covariance over all states and inverse depths.
[[nodiscard]] bool covariance_ceres(const BundleProblem& problem, std::span<const StateBlock> blocks,
                                    Eigen::MatrixXd* out);

}  // namespace farpoint::slam
