// SPDX-License-Identifier: Apache-2.0
// Compares virtual map points with the baseline over simulated scenes, paired seed by seed.
//   sim_compare [--seeds N] [--first SEED] [--scene NAME|all] [--frames N] [--features N] [--init-parallax
//   RAD]
//               [--align-bias PX] [--focal-error SHARE] [--markdown | --json] [--verbose]
// --json prints one object with the figures of every seed and no times: equal builds print equal bytes.
// tools/results runs it for tests/RESULTS.md.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/scenes/evaluation.h"
#include "tools/common/json.h"

namespace farpoint::sim {
namespace {

using tools::Json;

struct Options {
  int seeds = 20;
  std::uint64_t first = 1;
  std::string scene = "all";
  int frames = 0;  // 0: the scene's own
  int features = 0;
  double init_parallax_rad = 0;  // 0: the configuration's
  double align_bias_px = 0, focal_error = 0;
  bool markdown = false, json = false, verbose = false;
};

Options parse(int argc, char** argv) {
  Options o;
  for (int i = 1; i < argc; ++i) {
    const std::string key = argv[i];
    const auto value = [&]() -> const char* {
      if (i + 1 >= argc) throw std::invalid_argument(key + ": a value was expected");
      return argv[++i];
    };
    if (key == "--seeds")
      o.seeds = std::atoi(value());
    else if (key == "--first")
      o.first = std::strtoull(value(), nullptr, 10);
    else if (key == "--scene")
      o.scene = value();
    else if (key == "--frames")
      o.frames = std::atoi(value());
    else if (key == "--features")
      o.features = std::atoi(value());
    else if (key == "--init-parallax")
      o.init_parallax_rad = std::atof(value());
    else if (key == "--align-bias")
      o.align_bias_px = std::atof(value());
    else if (key == "--focal-error")
      o.focal_error = std::atof(value());
    else if (key == "--markdown")
      o.markdown = true;
    else if (key == "--json")
      o.json = true;
    else if (key == "--verbose")
      o.verbose = true;
    else
      throw std::invalid_argument(
          key +
          ": unknown; expected --seeds, --first, --scene, --frames, --features, "
          "--init-parallax, --align-bias, --focal-error, --markdown, --json or --verbose");
  }
  if (o.seeds < 1) throw std::invalid_argument("--seeds: at least 1 was expected");
  return o;
}

std::vector<double> normalised(const RunReport& r, bool local) {
  std::vector<double> out;
  for (const LandmarkError& e : r.landmarks) out.push_back(local ? e.normalised_local : e.normalised_global);
  return out;
}

std::vector<double> magnitude(std::vector<double> v) {
  for (double& x : v) x = std::fabs(x);
  return v;
}

void print_run(const char* mode, std::uint64_t seed, const RunReport& r) {
  const std::vector<double> local = normalised(r, true), global = normalised(r, false);
  std::vector<double> far_errors;
  for (const LandmarkError& e : r.landmarks)
    if (e.true_depth_m > 50.0) far_errors.push_back(std::fabs(e.relative_error));
  std::fprintf(stderr,
               "  seed %llu %-8s init %d posed %d/%d valid %d maps %llu lost %llu ate %.3f live %.3f m of "
               "%.0f | created %zu "
               "p10 %.1f p50 %.1f p90 %.1f >50 %.1f%% >100 %.1f%% obs %.1f | vmp %.1f%% made %llu att %llu "
               "mrg %llu prom %llu rej "
               "%llu evict %llu | made %llu culled %llu fused %llu phantoms %d | kf %llu -%llu | z local med "
               "%.2f |z| p50 %.2f "
               "p95 %.2f, global |z| p50 %.2f p95 %.2f | far rel err p50 %.3f p90 %.3f | %.2f ms/frame, sim "
               "%.2f ms | scale",
               static_cast<unsigned long long>(seed), mode, r.first_pose_frame, r.posed_frames, r.frames,
               r.valid_frames, static_cast<unsigned long long>(r.counts.maps),
               static_cast<unsigned long long>(r.counts.lost), r.ate_m, r.live_ate_m, r.path_m,
               r.creation_depths_m.size(), quantile(r.creation_depths_m, 0.1),
               quantile(r.creation_depths_m, 0.5), quantile(r.creation_depths_m, 0.9),
               100 * r.creation_share_beyond(50), 100 * r.creation_share_beyond(100), r.median_observation_m,
               100 * r.vmp_share(), static_cast<unsigned long long>(r.counts.mapping.vmp_made),
               static_cast<unsigned long long>(r.counts.mapping.vmp_attached),
               static_cast<unsigned long long>(r.counts.mapping.vmp_merged),
               static_cast<unsigned long long>(r.counts.mapping.vmp_promoted),
               static_cast<unsigned long long>(r.counts.mapping.vmp_rejected),
               static_cast<unsigned long long>(r.counts.mapping.vmp_evicted),
               static_cast<unsigned long long>(r.counts.mapping.landmarks_made),
               static_cast<unsigned long long>(r.counts.mapping.landmarks_culled),
               static_cast<unsigned long long>(r.counts.mapping.landmarks_fused), r.phantoms,
               static_cast<unsigned long long>(r.counts.mapping.keyframes_made),
               static_cast<unsigned long long>(r.counts.mapping.keyframes_culled), quantile(local, 0.5),
               quantile(magnitude(local), 0.5), quantile(magnitude(local), 0.95),
               quantile(magnitude(global), 0.5), quantile(magnitude(global), 0.95), quantile(far_errors, 0.5),
               quantile(far_errors, 0.9), 1e3 * r.seconds / r.frames, 1e3 * r.simulator_seconds / r.frames);
  for (const double s : r.scale_along) std::fprintf(stderr, " %.3f", s);
  std::fprintf(stderr, "\n");
}

struct Row {
  std::vector<double> ratio, depth_ratio;
  std::vector<double> ate[2], p90[2], beyond50[2], beyond100[2], vmp[2], z[2], posed[2], ms[2];
  int failed = 0;
  Json::Array seeds;  // figures of each, for --json
};

void add(const RunReport& r, int mode, Row* row) {
  row->ate[mode].push_back(r.ate_m);
  row->p90[mode].push_back(quantile(r.creation_depths_m, 0.9));
  row->beyond50[mode].push_back(100 * r.creation_share_beyond(50));
  row->beyond100[mode].push_back(100 * r.creation_share_beyond(100));
  row->vmp[mode].push_back(100 * r.vmp_share());
  row->posed[mode].push_back(100.0 * r.posed_frames / r.frames);
  row->ms[mode].push_back(1e3 * r.seconds / r.frames);
  const std::vector<double> z = normalised(r, false);
  row->z[mode].insert(row->z[mode].end(), z.begin(), z.end());
}

// Named as in farpoint evaluate --json.
Json figures(const RunReport& r) {
  Json json = Json::object(), final = Json::object(), live = Json::object(), depth = Json::object();
  final.set("ate_rmse_m", r.aligned ? Json(r.ate_m) : Json());
  final.set("share", static_cast<double>(r.posed_frames) / r.frames);
  live.set("share", static_cast<double>(r.valid_frames) / r.frames);
  depth.set("p90", quantile(r.creation_depths_m, 0.9));
  json.set("final", final);
  json.set("live", live);
  json.set("triangulation_depth_m", depth);
  json.set("depth_over_50_m_percent", 100 * r.creation_share_beyond(50));
  json.set("depth_over_100_m_percent", 100 * r.creation_share_beyond(100));
  json.set("vmp_percent", 100 * r.vmp_share());
  return json;
}

void add_seed(std::uint64_t seed, bool compared, const RunReport& baseline, const RunReport& vmp, Row* row) {
  Json json = Json::object();
  json.set("start", static_cast<std::int64_t>(seed));
  json.set("compared", compared);
  json.set("baseline", figures(baseline));
  json.set("vmp", figures(vmp));
  row->seeds.push_back(json);
}

// Compared only where both have most of the drive, from where it moves, in one map.
constexpr double kEnoughPosed = 0.9;

slam::EstimatorConfig configuration(const Options& o, const Scene& scene, slam::LandmarkMode mode) {
  slam::EstimatorConfig config = scene.estimator(mode);
  if (o.init_parallax_rad > 0.0) config.initialisation.min_parallax_rad = o.init_parallax_rad;
  return config;
}

Row compare(const Options& o, const Scene& scene) {
  Row row;
  for (int i = 0; i < o.seeds; ++i) {
    const std::uint64_t seed = o.first + static_cast<std::uint64_t>(i);
    const RunReport baseline = run_scene(scene, seed, configuration(o, scene, slam::LandmarkMode::kBaseline));
    const RunReport vmp = run_scene(scene, seed, configuration(o, scene, slam::LandmarkMode::kVmp));
    if (o.verbose) print_run("baseline", seed, baseline), print_run("vmp", seed, vmp);
    add(baseline, 0, &row), add(vmp, 1, &row);
    const double enough = kEnoughPosed * (scene.frames - scene.still_frames);
    const bool compared =
        baseline.aligned && vmp.aligned && baseline.posed_frames >= enough && vmp.posed_frames >= enough;
    add_seed(seed, compared, baseline, vmp, &row);
    if (!compared) {
      ++row.failed;
      continue;
    }
    row.ratio.push_back(vmp.ate_m / baseline.ate_m);
    row.depth_ratio.push_back(quantile(vmp.creation_depths_m, 0.9) /
                              quantile(baseline.creation_depths_m, 0.9));
  }
  return row;
}

void print_header(bool markdown) {
  std::printf(
      "%sscene | seeds | not compared | ATE m base | ATE m vmp | ATE ratio (quartiles) | p90 depth m base / "
      "vmp | "
      "ratio (quartiles) | > 50 m %% | > 100 m %% | VMP %% | abs z p50 base / vmp | abs z p95 | ms a "
      "frame%s\n",
      markdown ? "| " : "", markdown ? " |" : "");
  if (markdown) std::printf("|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
}

void print_row(const Options& o, const std::string& name, const Row& r) {
  const auto mid = [](const std::vector<double>& v) { return quantile(v, 0.5); };
  std::printf(
      "%s%s | %d | %d | %.3f | %.3f | %.3f (%.3f-%.3f) | %.1f / %.1f | %.2f (%.2f-%.2f) | %.1f / %.1f | %.1f "
      "/ %.1f | "
      "%.1f | %.2f / %.2f | %.2f / %.2f | %.1f / %.1f%s\n",
      o.markdown ? "| " : "", name.c_str(), o.seeds, r.failed, mid(r.ate[0]), mid(r.ate[1]), mid(r.ratio),
      quantile(r.ratio, 0.25), quantile(r.ratio, 0.75), mid(r.p90[0]), mid(r.p90[1]), mid(r.depth_ratio),
      quantile(r.depth_ratio, 0.25), quantile(r.depth_ratio, 0.75), mid(r.beyond50[0]), mid(r.beyond50[1]),
      mid(r.beyond100[0]), mid(r.beyond100[1]), mid(r.vmp[1]), quantile(magnitude(r.z[0]), 0.5),
      quantile(magnitude(r.z[1]), 0.5), quantile(magnitude(r.z[0]), 0.95), quantile(magnitude(r.z[1]), 0.95),
      mid(r.ms[0]), mid(r.ms[1]), o.markdown ? " |" : "");
  std::fflush(stdout);
}

// |z|: error of a depth over its claimed sigma, all landmarks of all seeds.
Json scene_json(const std::string& name, const Row& row) {
  Json json = Json::object(), z = Json::object();
  z.set("baseline", quantile(magnitude(row.z[0]), 0.95));
  z.set("vmp", quantile(magnitude(row.z[1]), 0.95));
  json.set("scene", name);
  json.set("abs_z_p95", z);
  json.set("pairs", row.seeds);
  return json;
}

int run(const Options& o) {
  std::vector<std::string> names;
  for (const std::string& name : scene_names())
    if (o.scene == name || (o.scene == "all" && make_scene(name).far)) names.push_back(name);
  if (names.empty()) names.push_back(o.scene);
  if (!o.json) print_header(o.markdown);
  Json::Array scenes;
  for (const std::string& name : names) {
    Scene scene = make_scene(name);
    if (o.frames > 0) scene.frames = o.frames;
    if (o.features > 0) scene.features = o.features;
    scene.noise.align_bias_px = o.align_bias_px;
    scene.focal_error = o.focal_error;
    const Row row = compare(o, scene);
    o.json ? scenes.push_back(scene_json(name, row)) : print_row(o, name, row);
  }
  Json all = Json::object();
  all.set("scenes", scenes);
  if (o.json) std::printf("%s\n", all.dump().c_str());
  return 0;
}

}  // namespace
}  // namespace farpoint::sim

int main(int argc, char** argv) {
  try {
    return farpoint::sim::run(farpoint::sim::parse(argc, argv));
  } catch (const std::exception& e) {
    std::fprintf(stderr, "sim_compare: %s\n", e.what());
    return 2;
  }
}
