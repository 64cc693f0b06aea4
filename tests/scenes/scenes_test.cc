// SPDX-License-Identifier: Apache-2.0
// The estimator in simulated worlds: initialisation, life of virtual map points, scale, forgetting, sigma,
// modes.
//
// Bounds follow the spread over seeds that sim_compare printed; each comment holds what was seen.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/scenes/evaluation.h"

namespace farpoint::sim {
namespace {

using slam::EstimatorConfig;
using slam::LandmarkMode;

Scene shortened(const std::string& name, int frames) {
  Scene s = make_scene(name);
  s.frames = frames;
  return s;
}

RunReport run_mode(const Scene& scene, std::uint64_t seed, LandmarkMode mode) {
  return run_scene(scene, seed, scene.estimator(mode));
}

std::vector<double> magnitudes(const std::vector<LandmarkError>& errors) {
  std::vector<double> out;
  out.reserve(errors.size());
  for (const LandmarkError& e : errors) out.push_back(std::fabs(e.normalised_global));
  return out;
}

// --------------------------------------------------------------------------------------------------
// initialisation

TEST(Initialisation, RotationAloneMakesNoMap) {
  const Scene scene = shortened("rotating", 250);
  for (const LandmarkMode mode : {LandmarkMode::kVmp, LandmarkMode::kBaseline}) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      const RunReport r = run_mode(scene, seed, mode);
      EXPECT_EQ(r.counts.maps, 0U) << "seed " << seed;
      EXPECT_EQ(r.first_pose_frame, -1) << "seed " << seed;
      EXPECT_EQ(r.valid_frames, 0) << "seed " << seed;
    }
  }
}

TEST(Initialisation, WaitsWhileHoveringAndStartsWithTheFlight) {
  const Scene scene = shortened("hover_start", 300);
  constexpr int kTakesOff = 120;  // frame at which the hover at 70 m ends
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const RunReport r = run_mode(scene, seed, LandmarkMode::kVmp);
    ASSERT_TRUE(r.aligned) << "seed " << seed;
    // Seen: 198, 199. At the latest when it has flown 30 m.
    EXPECT_GE(r.first_pose_frame, kTakesOff) << "seed " << seed;
    EXPECT_LT(r.first_pose_frame, 220) << "seed " << seed;
    // Seen: 0.13 to 0.15 m of 73 m, depths to 0.6 to 0.9 %.
    EXPECT_LT(r.ate_m, 0.4) << "seed " << seed;
    std::vector<double> errors;
    for (const LandmarkError& e : r.landmarks) errors.push_back(std::fabs(e.relative_error));
    EXPECT_GT(errors.size(), 200U);
    EXPECT_LT(quantile(errors, 0.5), 0.025) << "seed " << seed;
  }
}

TEST(Initialisation, StartsSoonUnderMotion) {
  // Straight ahead there is little parallax, and many points are far: still enough near ones show how it
  // moves.
  for (const char* name : {"straight", "turning", "highway"}) {
    const Scene scene = shortened(name, 80);
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      const RunReport r = run_mode(scene, seed, LandmarkMode::kVmp);
      ASSERT_TRUE(r.aligned) << name << ", seed " << seed;
      EXPECT_LT(r.first_pose_frame, 60) << name << ", seed " << seed;
      EXPECT_EQ(r.counts.maps, 1U) << name << ", seed " << seed;
      EXPECT_LT(r.ate_m, 0.01 * r.path_m) << name << ", seed " << seed;
    }
  }
}

// ------------------------------------------------------------------------------------------ life of virtual
// points

TEST(VirtualPoints, AllOfTheirLifeHappensAndTheCountsBalance) {
  const Scene scene = shortened("straight", 150);
  const EstimatorConfig config = scene.estimator(LandmarkMode::kVmp);
  slam::EstimatorCounts before;
  int compared = 0;
  const RunReport r =
      run_scene(scene, 3, config,
                [&](std::uint32_t frame, const slam::FrameResult& result, const slam::Estimator& estimator) {
                  const slam::EstimatorCounts& c = estimator.counts();
                  EXPECT_GE(c.mapping.vmp_made, before.mapping.vmp_made);
                  EXPECT_GE(c.mapping.vmp_promoted, before.mapping.vmp_promoted);
                  EXPECT_GE(c.mapping.vmp_evicted, before.mapping.vmp_evicted);
                  before = c;
                  // Counts come with mapping's replies: they are of the present map where no job is under
                  // way.
                  if (frame < 20 || result.jobs_under_way > 0) return;
                  ++compared;
                  std::uint64_t virtual_points = 0, all = 0;
                  for (const slam::LandmarkInfo& l : estimator.inspect().landmarks()) {
                    ++all;
                    virtual_points += l.full ? 0 : 1;
                    EXPECT_FALSE(l.through_vmp && !l.full);
                    EXPECT_GE(l.observations, 2);
                    EXPECT_GE(l.inverse_depth, 0.0);
                  }
                  EXPECT_EQ(all, c.landmarks);
                  EXPECT_LE(virtual_points, static_cast<std::uint64_t>(config.landmarks.max_bearing));
                  // No more are alive than were made and have not ended. (Fewer may be: a full landmark found
                  // on its corner takes a virtual one's place.)
                  EXPECT_LE(virtual_points + c.mapping.vmp_merged + c.mapping.vmp_promoted +
                                c.mapping.vmp_rejected + c.mapping.vmp_evicted,
                            c.mapping.vmp_made);
                  // The facade counts those alive.
                  EXPECT_EQ(virtual_points, c.mapping.vmp_alive) << "frame " << frame;
                });
  EXPECT_GT(compared, 5);
  EXPECT_GT(r.counts.mapping.vmp_made, 300U);
  EXPECT_GT(r.counts.mapping.vmp_attached, 300U);
  EXPECT_GT(r.counts.mapping.vmp_merged, 0U);
  EXPECT_GT(r.counts.mapping.vmp_promoted, 100U);
  EXPECT_GT(r.counts.mapping.vmp_rejected, 0U);
  EXPECT_GT(r.counts.mapping.vmp_evicted, 0U);
  EXPECT_GE(r.counts.mapping.landmarks_made, r.counts.mapping.vmp_promoted);

  const RunReport baseline = run_mode(shortened("straight", 60), 3, LandmarkMode::kBaseline);
  EXPECT_EQ(baseline.counts.mapping.vmp_made + baseline.counts.mapping.vmp_attached +
                baseline.counts.mapping.vmp_promoted,
            0U);
  EXPECT_GT(baseline.counts.mapping.landmarks_made, 300U);
}

// -----------------------------------------------------------------------------------------------------------
// scale

TEST(Scale, HoldsAlongTheWay) {
  // Seen over six seeds: within 0.2 % on the straight, 0.4 % through four quarter turns.
  for (const char* name : {"straight", "turning"}) {
    Scene scene = shortened(name, name[0] == 's' ? 120 : 280);
    for (std::uint64_t seed = 1; seed <= 2; ++seed) {
      const RunReport r = run_mode(scene, seed, LandmarkMode::kVmp);
      ASSERT_TRUE(r.aligned) << name << ", seed " << seed;
      EXPECT_GT(r.posed_frames, 0.95 * scene.frames) << name << ", seed " << seed;
      for (const double s : r.scale_along) EXPECT_NEAR(s, 1.0, 0.01) << name << ", seed " << seed;
    }
  }
}

// ------------------------------------------------------------------------------------------------------
// forgetting

TEST(Forgetting, SmallMapsGoOnForEver) {
  const Scene scene = shortened("endless", 250);
  EstimatorConfig config = scene.estimator(LandmarkMode::kVmp);
  config.capacity.keyframes = 24;
  config.capacity.landmarks = 2500;
  config.capacity.window_images = 12;
  config.landmarks.max_bearing = 400;
  int most_images = 0;
  const RunReport r = run_scene(
      scene, 2, config, [&](std::uint32_t frame, const slam::FrameResult&, const slam::Estimator& estimator) {
        EXPECT_LE(estimator.counts().keyframes, 24U) << "frame " << frame;
        EXPECT_LE(estimator.counts().landmarks, 2500U) << "frame " << frame;
        if (frame > 100) most_images = std::max(most_images, SimImage::alive());
      });
  EXPECT_GE(r.most_keyframes, 23U);  // it was full
  EXPECT_GT(r.counts.mapping.keyframes_made, 40U);
  EXPECT_GT(r.counts.mapping.keyframes_forgotten, 10U);
  EXPECT_GT(r.counts.mapping.landmarks_forgotten, 500U);
  EXPECT_LE(r.counts.mapping.keyframes_forgotten, r.counts.mapping.keyframes_culled);
  EXPECT_EQ(r.counts.lost, 0U);
  EXPECT_EQ(r.counts.maps, 1U);
  EXPECT_GT(r.posed_frames, 0.98 * scene.frames);
  EXPECT_LT(r.ate_m, 0.01 * r.path_m);
  // The window's pixels, and those of frames under way.
  EXPECT_LE(most_images, config.capacity.window_images + 8);
}

// -----------------------------------------------------------------------------------------------------------
// sigma

TEST(Sigma, DepthErrorsAreWhatIsClaimed) {
  for (const LandmarkMode mode : {LandmarkMode::kVmp, LandmarkMode::kBaseline}) {
    std::vector<double> z;
    for (const char* name : {"straight", "hovering"}) {
      const Scene scene = shortened(name, name[0] == 's' ? 120 : 250);
      const std::vector<double> add = magnitudes(run_mode(scene, 5, mode).landmarks);
      EXPECT_GT(add.size(), 300U) << name;
      z.insert(z.end(), add.begin(), add.end());
    }
    // A normal error's are 0.67 and 1.96. Seen: 0.42 to 0.60 and 1.4 to 2.2.
    EXPECT_GT(quantile(z, 0.5), 0.25);
    EXPECT_LT(quantile(z, 0.5), 0.9);
    EXPECT_LT(quantile(z, 0.95), 2.6);
  }
}

// -----------------------------------------------------------------------------------------------------------
// modes

// The short form of sim_compare. Every seed separates the depths. The errors are a few centimetres at the
// simulator's noise and vary by a factor of two from seed to seed: here the error must only not be far
// worse.
TEST(Modes, VirtualPointsReachFurther) {
  for (const char* name : {"straight", "hovering"}) {
    const Scene scene = shortened(name, name[0] == 's' ? 150 : 600);
    double depth_ratios = 0;
    constexpr int kSeeds = 3;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
      const RunReport baseline = run_mode(scene, seed, LandmarkMode::kBaseline);
      const RunReport vmp = run_mode(scene, seed, LandmarkMode::kVmp);
      ASSERT_TRUE(baseline.aligned && vmp.aligned) << name << ", seed " << seed;
      EXPECT_GT(baseline.posed_frames, 0.95 * scene.frames) << name << ", seed " << seed;
      EXPECT_GT(vmp.posed_frames, 0.95 * scene.frames) << name << ", seed " << seed;
      depth_ratios +=
          quantile(vmp.creation_depths_m, 0.9) / quantile(baseline.creation_depths_m, 0.9) / kSeeds;
      // The drone has nothing nearer than 50 m and little nearer than 100 m.
      if (scene.motion == Motion::kVehicle) {
        EXPECT_GT(vmp.creation_share_beyond(50), baseline.creation_share_beyond(50))
            << name << ", seed " << seed;
        EXPECT_GT(vmp.creation_share_beyond(100), baseline.creation_share_beyond(100))
            << name << ", seed " << seed;
      } else {
        EXPECT_GT(vmp.creation_share_beyond(300), baseline.creation_share_beyond(300))
            << name << ", seed " << seed;
      }
      EXPECT_GT(vmp.vmp_share(), 0.05) << name << ", seed " << seed;
      // Which mode is the more accurate takes 20 seeds to tell (sim_compare; one pair differs by half either
      // way). Neither may be off by more than a thousandth of the way.
      EXPECT_LT(baseline.ate_m, 0.001 * baseline.path_m) << name << ", seed " << seed;
      EXPECT_LT(vmp.ate_m, 0.001 * vmp.path_m) << name << ", seed " << seed;
    }
    // Seen over 20 seeds: 1.34 on the straight (quartiles 1.33 to 1.36), 1.07 for the drone (1.05 to 1.08).
    EXPECT_GT(depth_ratios, scene.motion == Motion::kVehicle ? 1.15 : 1.02) << name;
  }
}

TEST(Modes, SameSeedSameBytesWhateverTheProcessorsCaches) {
  const Scene scene = shortened("turning", 80);
  const EstimatorConfig config = scene.estimator(LandmarkMode::kVmp);
  std::vector<slam::SE3> live[2];
  RunReport r[2];
  for (int i = 0; i < 2; ++i) {
    // What Eigen would find on a processor with tiny caches, and cut its products by.
    if (i == 1) Eigen::setCpuCacheSizes(2 << 10, 4 << 10, 8 << 10);
    r[i] =
        run_scene(scene, 9, config, [&](std::uint32_t, const slam::FrameResult& f, const slam::Estimator&) {
          if (f.has_pose) live[i].push_back(f.T_map_body);
        });
  }
  ASSERT_GT(live[0].size(), 30U);
  ASSERT_EQ(live[0].size(), live[1].size());
  const auto same = [](const slam::SE3& a, const slam::SE3& b) {
    return a.t == b.t && a.q.coeffs() == b.q.coeffs();
  };
  for (std::size_t k = 0; k < live[0].size(); ++k) EXPECT_TRUE(same(live[0][k], live[1][k])) << k;
  ASSERT_EQ(r[0].trajectories.size(), 1U);
  ASSERT_EQ(r[0].trajectories[0].frames.size(), r[1].trajectories[0].frames.size());
  for (std::size_t k = 0; k < r[0].trajectories[0].frames.size(); ++k)
    EXPECT_TRUE(same(r[0].trajectories[0].frames[k].T_map_body, r[1].trajectories[0].frames[k].T_map_body))
        << k;
}

}  // namespace
}  // namespace farpoint::sim
