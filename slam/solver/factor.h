// SPDX-License-Identifier: Apache-2.0
// One measurement between states of a bundle problem: wheels, inertial measurements, priors.
//
// Landmark measurements are not factors: they are many, and the solver handles them without virtual calls.
#pragma once

#include <limits>
#include <span>

#include "slam/solver/states.h"

namespace farpoint::slam {

// The largest factor: two poses, two motions, a direction and two numbers.
inline constexpr int kMaxFactorResiduals = 15, kMaxFactorColumns = 34;
// Room inside the object, so that no factor takes memory from the heap.
using FactorResidual = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxFactorResiduals, 1>;
using FactorJacobian =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMaxFactorResiduals, kMaxFactorColumns>;

// Cost: the Huber loss of |r|, which is 0.5 r'r up to huber_delta().
class StateFactor {
 public:
  StateFactor() = default;
  StateFactor(const StateFactor&) = default;
  StateFactor& operator=(const StateFactor&) = default;
  virtual ~StateFactor() = default;

  // The states that the residual depends on, none twice, in the order of the Jacobian's columns.
  [[nodiscard]] virtual std::span<const StateBlock> blocks() const = 0;
  [[nodiscard]] virtual int residuals() const = 0;
  // Sets the residual in units of its sigmas and, where `jacobian` is not null, its derivatives by the
  // perturbations of all blocks side by side. Both have the right size on entry and hold zeros.
  virtual void evaluate(const StateWindow& states, FactorResidual* residual,
                        FactorJacobian* jacobian) const = 0;
  // |r| from which the cost grows linearly; infinity keeps it quadratic.
  [[nodiscard]] virtual double huber_delta() const { return std::numeric_limits<double>::infinity(); }
};

// Columns of the factor's Jacobian.
[[nodiscard]] inline int columns(const StateFactor& factor, const StateWindow& states) {
  int sum = 0;
  for (const StateBlock block : factor.blocks()) sum += states.size(block);
  return sum;
}

}  // namespace farpoint::slam
