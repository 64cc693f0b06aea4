// SPDX-License-Identifier: Apache-2.0
// What the module lib/farpoint/farpoint_ceres.so exports. Module and program must be of one build.
#pragma once

#include "slam/config.h"

namespace farpoint::slam {

// Raised with every change of BundleProblem, its states or StateFactor. A program refuses a module with
// another number.
constexpr int kCeresInterface = 1;
using CeresInterfaceFunction = int (*)();
constexpr const char* kCeresInterfaceName = "farpoint_ceres_interface";
// A SolveBundle.
constexpr const char* kSolveCeresName = "farpoint_solve_ceres";

}  // namespace farpoint::slam
