// SPDX-License-Identifier: Apache-2.0
#include "tests/scenes/evaluation.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>

#include "slam/geometry/point_alignment.h"

namespace farpoint::sim {

using Eigen::Vector3d;
using slam::SE3;

namespace {

// The estimated path beside the true one.
struct Paths {
  std::vector<std::uint32_t> frames;
  std::vector<SE3> estimates, truths;

  [[nodiscard]] std::vector<Vector3d> positions(const std::vector<SE3>& poses, std::size_t first,
                                                std::size_t last) const {
    std::vector<Vector3d> out;
    for (std::size_t i = first; i < last; ++i) out.push_back(poses[i].t);
    return out;
  }
  [[nodiscard]] slam::PointAlignment align(std::size_t first, std::size_t last) const {
    return slam::align_points(positions(estimates, first, last), positions(truths, first, last),
                              slam::AlignmentKind::kSim3);
  }
};

Paths pair_up(const slam::MapTrajectory& trajectory, double rate_hz, Simulator* simulator) {
  Paths p;
  for (const slam::PosedFrame& f : trajectory.frames) {
    p.frames.push_back(
        static_cast<std::uint32_t>(std::llround(static_cast<double>(f.utime) * 1e-6 * rate_hz)));
    p.estimates.push_back(f.T_map_body);
    p.truths.push_back(simulator->truth(p.frames.back()));
  }
  return p;
}

// Metres a map unit around place i: over 20 m of path to either side, or as much as there is.
double local_scale(const Paths& p, std::size_t i, double fallback) {
  constexpr double kReach_m = 20.0;
  std::size_t first = i, last = i;
  for (double way = 0; first > 0 && way < kReach_m; --first)
    way += (p.truths[first].t - p.truths[first - 1].t).norm();
  for (double way = 0; last + 1 < p.truths.size() && way < kReach_m; ++last)
    way += (p.truths[last + 1].t - p.truths[last].t).norm();
  const slam::PointAlignment a = p.align(first, last + 1);
  return a.ok ? a.S_target_source.scale : fallback;
}

void compare_landmarks(const slam::Estimator& estimator, const slam::MapTrajectory& main, const Paths& paths,
                       double rate_hz, const slam::Rig& rig, const ShownPoints& shown, Simulator* simulator,
                       RunReport* report) {
  std::vector<double> scale_at(paths.frames.size(), 0.0);
  for (const slam::LandmarkInfo& l : estimator.inspect().landmarks()) {
    if (l.map_id != main.map_id || !l.full) continue;
    const std::uint32_t point = shown.find(l.anchor_utime, l.anchor_pixel);
    if (point >= kNothing) {
      ++report->phantoms;
      continue;
    }
    if (l.creation_relative_sigma < 0.3)
      report->creation_depths_m.push_back(l.creation_depth * report->scale);
    const auto frame =
        static_cast<std::uint32_t>(std::llround(1e-6 * static_cast<double>(l.anchor_utime) * rate_hz));
    const auto at = std::lower_bound(paths.frames.begin(), paths.frames.end(), frame);
    if (at == paths.frames.end() || *at != frame || !(l.inverse_depth_sigma > 0.0)) continue;
    const auto i = static_cast<std::size_t>(at - paths.frames.begin());
    const Vector3d anchor = (simulator->truth(frame) * rig.cameras.front().T_body_camera).t;
    const double depth_m = (simulator->position(point) - anchor).norm();
    if (scale_at[i] <= 0.0) scale_at[i] = local_scale(paths, i, report->scale);
    LandmarkError e;
    e.true_depth_m = depth_m;
    e.relative_error = l.inverse_depth * depth_m / report->scale - 1.0;
    e.normalised_global = (l.inverse_depth - report->scale / depth_m) / l.inverse_depth_sigma;
    e.normalised_local = (l.inverse_depth - scale_at[i] / depth_m) / l.inverse_depth_sigma;
    e.through_vmp = l.through_vmp;
    report->landmarks.push_back(e);
  }
}

}  // namespace

double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double quantile(std::vector<double> values, double p) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  const double rank = p * static_cast<double>(values.size() - 1);
  const auto low = static_cast<std::size_t>(rank);
  const std::size_t high = std::min(low + 1, values.size() - 1);
  return values[low] + (rank - static_cast<double>(low)) * (values[high] - values[low]);
}

double RunReport::creation_share_beyond(double depth_m) const {
  if (creation_depths_m.empty()) return 0.0;
  const auto n = std::count_if(creation_depths_m.begin(), creation_depths_m.end(),
                               [&](double d) { return d > depth_m; });
  return static_cast<double>(n) / static_cast<double>(creation_depths_m.size());
}

double RunReport::vmp_share() const {
  return counts.mapping.landmarks_made == 0 ? 0.0
                                            : static_cast<double>(counts.mapping.vmp_promoted) /
                                                  static_cast<double>(counts.mapping.landmarks_made);
}

RunReport run_scene(const Scene& scene, std::uint64_t seed, const slam::EstimatorConfig& config,
                    const FrameHook& hook) {
  RunReport report;
  Simulator simulator(scene, seed);
  ShownPoints shown;
  slam::Estimator estimator(config, scene.believed_rig());
  struct Live {
    std::int32_t map_id;
    std::uint32_t frame;
    Vector3d position;
  };
  std::vector<Live> live;
  Vector3d before = Vector3d::Zero();
  for (int i = 0; i < scene.frames; ++i) {
    double start = cpu_seconds();
    Sighted s = simulator.next();
    shown.note(s);
    report.simulator_seconds += cpu_seconds() - start;
    report.most_world_points = std::max(report.most_world_points, simulator.points_in_memory());
    if (i > 0) report.path_m += (s.T_world_body.t - before).norm();
    before = s.T_world_body.t;
    start = cpu_seconds();
    const slam::FrameResult& r = estimator.process(std::move(s.input));
    report.seconds += cpu_seconds() - start;
    ++report.frames;
    if (report.first_pose_frame < 0 && r.has_pose) report.first_pose_frame = i;
    if (slam::is_valid(r.state) && r.has_pose) {
      ++report.valid_frames;
      live.push_back({r.map_id, static_cast<std::uint32_t>(i), r.T_map_body.t});
      report.valid_span = std::max(report.valid_span, (r.T_map_body.t - live.front().position).norm());
    }
    report.most_keyframes = std::max(report.most_keyframes, estimator.counts().keyframes);
    report.most_landmarks = std::max(report.most_landmarks, estimator.counts().landmarks);
    if (hook) hook(static_cast<std::uint32_t>(i), r, estimator);
  }
  estimator.finish();
  report.counts = estimator.counts();
  report.trajectories = estimator.inspect().trajectories();
  if (report.trajectories.empty()) return report;

  const slam::MapTrajectory& main = report.trajectories.front();
  const Paths paths = pair_up(main, scene.rate_hz, &simulator);
  report.posed_frames = static_cast<int>(paths.frames.size());
  const slam::PointAlignment a = paths.align(0, paths.frames.size());
  if (!a.ok) return report;
  report.aligned = true;
  report.scale = a.S_target_source.scale;
  report.ate_m = a.rmse;
  std::vector<Vector3d> published, true_positions;
  for (const Live& l : live) {
    if (l.map_id != main.map_id) continue;
    published.push_back(l.position);
    true_positions.push_back(simulator.truth(l.frame).t);
  }
  report.live_ate_m = slam::align_points(published, true_positions, slam::AlignmentKind::kSim3).rmse;
  for (std::size_t k = 0; k < 10; ++k) {
    const std::size_t i = (2 * k + 1) * paths.frames.size() / 20;
    report.scale_along.push_back(local_scale(paths, i, report.scale) / report.scale);
  }
  std::vector<double> distances;
  estimator.inspect().visit_observation_distances([&](std::int32_t map_id, double d) {
    if (map_id == main.map_id) distances.push_back(d * report.scale);
  });
  report.median_observation_m = quantile(distances, 0.5);
  compare_landmarks(estimator, main, paths, scene.rate_hz, scene.rig(), shown, &simulator, &report);
  return report;
}

}  // namespace farpoint::sim
