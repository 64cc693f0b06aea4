// SPDX-License-Identifier: Apache-2.0
// solve_schur against solve_ceres at the size of a local bundle adjustment: 20 free and 20 fixed poses, 4000
// points, 8 observations each; and the tracker's pose solver.   bench_solvers
#include <benchmark/benchmark.h>

#include "slam/solver/ceres_solver.h"
#include "slam/tracking/pose_solver.h"
#include "tests/solver/bundle_scene.h"

namespace farpoint::slam {
namespace {

const BundleScene& scene() {
  static const BundleScene scene([] {
    SceneOptions o;
    o.poses = 40, o.fixed = 20, o.points = 4000, o.observations = 8;
    o.outlier_share = 0.03;
    return o;
  }());
  return scene;
}

template <BundleSummary (*solve)(const BundleOptions&, BundleProblem*)>
void run(benchmark::State& state) {
  BundleSummary summary;
  for (auto _ : state) {
    state.PauseTiming();
    BundleProblem problem = scene().start;
    state.ResumeTiming();
    // Mapping's eight iterations, all of them.
    summary = solve({8, 0.0}, &problem);
    benchmark::DoNotOptimize(problem);
  }
  state.counters["iterations"] = summary.iterations;
  state.counters["measurements"] = static_cast<double>(scene().start.measurements.size());
  state.counters["final_cost"] = summary.final_cost;
}

// Everything one pose of that scene sees, outliers included, from a start some pixels off.
void track(benchmark::State& state) {
  constexpr int kPose = 30;
  BundleFrames frames;
  frames.update(scene().truth);
  std::vector<PoseMeasurement> measurements;
  for (const auto& point : scene().start.points)
    for (int i = 0; i < point.measurements; ++i) {
      const auto& seen = scene().start.measurements[static_cast<std::size_t>(point.first_measurement + i)];
      if (seen.pose != kPose) continue;
      const BundleFrames::WorldPoint world = frames.world_point(point);
      PoseMeasurement m;
      m.point_w << world.xyz, world.inverse_depth;
      m.anchor_w = world.d_xyz_d_inverse_depth;
      m.inverse_depth_sigma = 0.1 * world.inverse_depth;  // the scene's start_log_depth
      m.pixel = seen.pixel;
      m.sigma_px = seen.sigma_px;
      measurements.push_back(m);
    }
  const SE3& start = scene().start.poses[kPose].T_world_body;
  PoseSolution solution;
  for (auto _ : state) {
    std::vector<PoseMeasurement> copy = measurements;
    solution = solve_pose(scene().rig, start, copy);
    benchmark::DoNotOptimize(solution);
  }
  state.counters["measurements"] = static_cast<double>(measurements.size());
  state.counters["inliers"] = solution.inliers;
}

BENCHMARK(run<&solve_schur>)->Name("local_ba/schur")->Unit(benchmark::kMillisecond);
BENCHMARK(run<&solve_ceres>)->Name("local_ba/ceres")->Unit(benchmark::kMillisecond);
BENCHMARK(track)->Name("pose")->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace farpoint::slam
