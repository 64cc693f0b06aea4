// SPDX-License-Identifier: Apache-2.0
// Runs the estimator through a simulated scene and compares what it made with the truth.
#pragma once

#include <functional>
#include <vector>

#include "tests/scenes/simulator.h"

namespace farpoint::sim {

// p in 0..1; NaN for no values. Linear between ranks.
[[nodiscard]] double quantile(std::vector<double> values, double p);

// CPU time of this thread: other work on the machine does not count.
[[nodiscard]] double cpu_seconds();

struct LandmarkError {
  double true_depth_m = 0;       // from its anchor
  double relative_error = 0;     // of the inverse depth, the run's one scale
  double normalised_global = 0;  // (inverse depth - truth) / claimed sigma, the run's one scale
  double normalised_local =
      0;  // the same with the scale of the path around the anchor: what the sigma claims
  bool through_vmp = false;
};

struct RunReport {
  int frames = 0;
  int first_pose_frame = -1;              // frame at which the first map began
  int posed_frames = 0;                   // in the final trajectory of the largest map
  int valid_frames = 0;                   // published as valid
  double path_m = 0;                      // true, of all frames
  bool aligned = false;                   // the figures below exist
  double scale = 0;                       // metres a map unit
  double ate_m = 0;                       // RMS, final, sim3
  double live_ate_m = 0;                  // RMS, valid poses of the same map as published, sim3
  double valid_span = 0;                  // largest distance between valid positions, map units
  std::vector<double> creation_depths_m;  // surviving, relative sigma at creation below 30 %
  double median_observation_m = 0;
  std::vector<LandmarkError> landmarks;
  int phantoms = 0;                 // full landmarks of the main map on corners that belong to nothing
  std::vector<double> scale_along;  // local scale / the run's scale, one a tenth of the run
  slam::EstimatorCounts counts;
  std::uint32_t most_keyframes = 0, most_landmarks = 0;
  std::size_t most_world_points = 0;
  double seconds = 0;            // of CPU, spent in the estimator
  double simulator_seconds = 0;  // of CPU
  std::vector<slam::MapTrajectory> trajectories;

  [[nodiscard]] double creation_share_beyond(double depth_m) const;
  // Share of points made through a virtual one.
  [[nodiscard]] double vmp_share() const;
};

// Called after every frame.
using FrameHook = std::function<void(std::uint32_t frame, const slam::FrameResult&, const slam::Estimator&)>;

[[nodiscard]] RunReport run_scene(const Scene& scene, std::uint64_t seed, const slam::EstimatorConfig& config,
                                  const FrameHook& hook = {});

}  // namespace farpoint::sim
