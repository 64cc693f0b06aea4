// SPDX-License-Identifier: Apache-2.0
#include "slam/ceres_module.h"

#include "slam/solver/ceres_solver.h"

extern "C" {

[[gnu::visibility("default")]] int farpoint_ceres_interface() {
  return farpoint::slam::kCeresInterface;
}

[[gnu::visibility("default")]] void farpoint_solve_ceres(const farpoint::slam::BundleOptions* options,
                                                         farpoint::slam::BundleProblem* problem,
                                                         farpoint::slam::BundleSummary* summary) {
  *summary = farpoint::slam::solve_ceres(*options, problem);
}
}
