// solve_schur against solve_ceres at the size of a local bundle adjustment: 20 free and 20 fixed poses, 4000
// points, 8 observations each.   bench_solvers
#include <benchmark/benchmark.h>

#include "tests/mapping/bundle_scene.h"

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

BENCHMARK(run<&solve_schur>)->Name("local_ba/schur")->Unit(benchmark::kMillisecond);
BENCHMARK(run<&solve_ceres>)->Name("local_ba/ceres")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace farpoint::slam
