// SPDX-License-Identifier: Apache-2.0
// What the tests of factors share: random states, numeric derivatives.
#pragma once

#include <gtest/gtest.h>

#include <vector>

#include "slam/solver/bundle_problem.h"

namespace farpoint::slam {

// The problem with one state moved by a perturbation.
inline BundleProblem moved(BundleProblem problem, StateBlock block, const Eigen::VectorXd& delta) {
  const auto i = static_cast<std::size_t>(block.index);
  switch (block.kind) {
    case StateBlock::Kind::kPose:
      problem.poses[i].T_world_body = problem.poses[i].T_world_body.boxplus(Vector6d(delta));
      break;
    case StateBlock::Kind::kMotion:
      problem.motions[i].move(Vector9d(delta));
      break;
    case StateBlock::Kind::kGlobal: {
      Eigen::Vector2d d = Eigen::Vector2d::Zero();
      d.head(delta.size()) = delta;
      problem.globals[i].move(d);
      break;
    }
  }
  return problem;
}

inline FactorResidual residual_of(const StateFactor& factor, const BundleProblem& problem) {
  FactorResidual r;
  r.setZero(factor.residuals());
  factor.evaluate(problem.states(), &r, nullptr);
  return r;
}

inline FactorJacobian jacobian_of(const StateFactor& factor, const BundleProblem& problem) {
  FactorResidual r;
  FactorJacobian J;
  r.setZero(factor.residuals());
  J.setZero(factor.residuals(), columns(factor, problem.states()));
  factor.evaluate(problem.states(), &r, &J);
  EXPECT_EQ(r, residual_of(factor, problem));
  return J;
}

// By central differences over the perturbations of all blocks.
inline Eigen::MatrixXd numeric_jacobian(const StateFactor& factor, const BundleProblem& problem) {
  constexpr double kStep = 1e-6;
  Eigen::MatrixXd J(factor.residuals(), columns(factor, problem.states()));
  Eigen::Index column = 0;
  for (const StateBlock block : factor.blocks()) {
    const int size = problem.states().size(block);
    for (int k = 0; k < size; ++k) {
      const Eigen::VectorXd step = kStep * Eigen::VectorXd::Unit(size, k);
      J.col(column++) = (residual_of(factor, moved(problem, block, step)) -
                         residual_of(factor, moved(problem, block, -step))) /
                        (2.0 * kStep);
    }
  }
  return J;
}

inline void expect_jacobian(const StateFactor& factor, const BundleProblem& problem) {
  const Eigen::MatrixXd J = jacobian_of(factor, problem), numeric = numeric_jacobian(factor, problem);
  ASSERT_EQ(J.cols(), numeric.cols());
  for (Eigen::Index k = 0; k < J.cols(); ++k)
    EXPECT_LT((J.col(k) - numeric.col(k)).norm(), 1e-6 * (1.0 + J.norm())) << "column " << k;
}

}  // namespace farpoint::slam
