// SPDX-License-Identifier: Apache-2.0
#include "daemon/system/solver_loader.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "daemon/config/config.h"
#include "slam/mapping/mapper.h"
#include "tests/solver/bundle_scene.h"

namespace farpoint::daemon {
namespace {

std::string refusal(const std::string& path) {
  slam::MappingConfig mapping;
  mapping.solver = "ceres";
  try {
    load_solver(path, &mapping);
  } catch (const ConfigError& error) {
    EXPECT_EQ(mapping.solve_instead, nullptr);
    return error.what();
  }
  return "";
}

TEST(SolverLoader, LoadsNothingForTheOwnSolver) {
  slam::MappingConfig mapping;
  load_solver("/nonexistent", &mapping);
  EXPECT_EQ(mapping.solve_instead, nullptr);
}

TEST(SolverLoader, SaysWhichModuleIsMissingAndForWhichKey) {
  const std::string text = refusal("/nonexistent/farpoint_ceres.so");
  EXPECT_NE(text.find("mapping.solver: ceres"), std::string::npos) << text;
  EXPECT_NE(text.find("/nonexistent/farpoint_ceres.so"), std::string::npos) << text;
}

TEST(SolverLoader, RefusesALibraryThatIsNoSuchModule) {
  EXPECT_NE(refusal("libm.so.6").find("of another version"), std::string::npos);
}

TEST(SolverLoader, TheModuleSolvesAsTheOwnSolverDoes) {
  slam::MappingConfig mapping;
  mapping.solver = "ceres";
  load_solver(ceres_module_path(), &mapping);
  ASSERT_NE(mapping.solve_instead, nullptr);
  slam::SceneOptions options;
  options.poses = 8, options.points = 200, options.infinite_share = 0.0, options.far_m = 60.0;
  const slam::BundleScene scene(options);
  slam::BundleProblem by_module = scene.start, by_own = scene.start;
  const slam::BundleOptions to_the_end{100, 1e-12};
  slam::BundleSummary summary;
  mapping.solve_instead(&to_the_end, &by_module, &summary);
  EXPECT_TRUE(summary.usable);
  EXPECT_NEAR(summary.final_cost, slam::solve_schur(to_the_end, &by_own).final_cost,
              1e-6 * summary.final_cost);
  for (std::size_t i = 0; i < by_own.poses.size(); ++i)
    EXPECT_LT((by_module.poses[i].T_world_body.t - by_own.poses[i].T_world_body.t).norm(), 1e-4) << i;
}

TEST(SolverLoader, AMapperThatIsToUseCeresWithoutItIsRefused) {
  slam::EstimatorConfig config;
  config.mapping.solver = "ceres";
  EXPECT_THROW(slam::Mapper(config, slam::BundleScene(slam::SceneOptions{}).rig), std::invalid_argument);
}

}  // namespace
}  // namespace farpoint::daemon
