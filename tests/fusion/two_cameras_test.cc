// SPDX-License-Identifier: Apache-2.0
// The seam for more than one camera: a metric rig of two, from frames through map and solver to tracked
// poses.
//
// Made-up points around a short drive; features stand where the points project. Nothing of the estimator
// beyond its parts is used.
#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <memory>
#include <vector>

#include "slam/fusion/wheel_factor.h"
#include "slam/map/frame.h"
#include "slam/map/map.h"
#include "slam/mapping/keyframe_maker.h"
#include "slam/mapping/window.h"
#include "slam/solver/schur_solver.h"
#include "slam/tracking/pose_solver.h"
#include "tests/map/map_fixture.h"

namespace farpoint::slam {
namespace {

constexpr double kBaseline_m = 0.4;
constexpr int kKeyframes = 5, kPoints = 150;
constexpr double kStep_m = 0.8;

// Two equal cameras side by side, looking along the body's x axis, 1.5 m before the body's origin.
Rig stereo_rig() {
  Rig rig = two_camera_rig();
  rig.cameras[0].T_body_camera = {q_body_forward_camera(), {1.5, 0.5 * kBaseline_m, 1.2}};
  rig.cameras[1] = rig.cameras[0];
  rig.cameras[1].T_body_camera.t.y() -= kBaseline_m;
  return rig;
}

SE3 true_pose(int keyframe) {
  return {so3_exp({0.0, 0.01 * keyframe, 0.05 * keyframe}),
          {kStep_m * keyframe, 0.02 * keyframe * keyframe, 0.0}};
}

class TwoCameras : public testing::Test {
 protected:
  TwoCameras() {
    for (int i = 0; i < kPoints; ++i)
      points_.emplace_back(random_.uniform(6.0, 30.0), random_.uniform(-8.0, 8.0),
                           random_.uniform(-2.0, 5.0));
  }

  // What both cameras of a body at this pose show; feature i of a camera is its i-th visible point.
  Frame frame_at(const SE3& T_world_body) {
    Frame frame;
    frame.views = PerCamera<FrameView>(2);
    visible_.assign(2, {});
    for (int c = 0; c < 2; ++c) {
      const RigCamera& camera = rig_.cameras[static_cast<std::size_t>(c)];
      const SE3 T_camera_world = (T_world_body * camera.T_body_camera).inverse();
      for (std::size_t i = 0; i < points_.size(); ++i) {
        Eigen::Vector2d pixel;
        if (!camera.camera.project(T_camera_world * points_[i], &pixel) ||
            !camera.camera.in_image(pixel, 5.0))
          continue;
        Feature f;
        f.u_px = static_cast<float>(pixel.x());
        f.v_px = static_cast<float>(pixel.y());
        frame.views[c].set.features.push_back(f);
        frame.views[c].set.descriptors.emplace_back();
        visible_[static_cast<std::size_t>(c)].push_back(i);
      }
      frame.views[c].image = std::make_shared<FakeImage>();
    }
    return frame;
  }

  // Keyframes at poses that are off by a few centimetres and degrees (the first is right), and landmarks
  // whose depth is off by a third, each seen by all cameras that show it.
  void build_map() {
    landmarks_.assign(points_.size(), {});
    for (int k = 0; k < kKeyframes; ++k) {
      const Frame frame = frame_at(true_pose(k));
      SE3 start = true_pose(k);
      if (k > 0) start = start * SE3{so3_exp(random_.vector(0.01)), random_.vector(0.05)};
      keyframes_.push_back(keyframe_maker_.make(frame, start, 0));
      ASSERT_FALSE(keyframes_.back().is_null());
      for (int c = 0; c < 2; ++c) add_sightings(keyframes_.back(), c);
    }
  }
  void add_sightings(KeyframeHandle keyframe, int camera) {
    const std::vector<std::size_t>& visible = visible_[static_cast<std::size_t>(camera)];
    for (std::size_t f = 0; f < visible.size(); ++f) {
      LandmarkHandle& h = landmarks_[visible[f]];
      if (!h.is_null()) {
        ASSERT_TRUE(map_.add_observation(h, sighting(map_, keyframe, f, camera)));
        continue;
      }
      h = map_.add_landmark(keyframe, camera, f);
      ASSERT_FALSE(h.is_null());
      Landmark& l = map_.landmarks()[h];
      const double distance = (map_.T_world_anchor(l).inverse() * points_[visible[f]]).norm();
      l.inverse_depth = random_.uniform(0.7, 1.4) / distance;
      l.state = LandmarkState::kFull;
    }
  }
  BundleSummary adjust() {
    map_.update_covisibility(keyframes_.back());
    window_.build(keyframes_.back());
    BundleOptions options;
    options.iterations = 30;
    options.relative_decrease = 1e-9;
    return SchurSolver().solve(options, &window_.problem());
  }

  Random random_{41};
  const Rig rig_ = stereo_rig();
  EstimatorConfig config_;
  Map map_{config_.capacity, rig_};
  MappingCounts counts_;
  KeyframeMaker keyframe_maker_{&map_, &counts_};
  Window window_{config_, &map_, &counts_};
  std::vector<Eigen::Vector3d> points_;
  std::vector<std::vector<std::size_t>> visible_;  // points of the last frame, by camera and feature
  std::vector<KeyframeHandle> keyframes_;
  std::vector<LandmarkHandle> landmarks_;  // by point
};

TEST_F(TwoCameras, KeyframesHoldAViewOfEach) {
  build_map();
  const Keyframe& k = map_.keyframes()[keyframes_[0]];
  ASSERT_EQ(k.views.size(), 2);
  for (int c = 0; c < 2; ++c) {
    EXPECT_GT(k.views[c].set.features.size(), 40U);
    EXPECT_EQ(k.views[c].bearings.size(), k.views[c].set.features.size());
    EXPECT_EQ(k.views[c].landmarks.size(), k.views[c].set.features.size());
  }
  int seen_by_both = 0;
  map_.landmarks().for_each([&](LandmarkHandle, const Landmark& l) {
    seen_by_both += Map::find_observation(l, keyframes_[0], 0) != nullptr &&
                    Map::find_observation(l, keyframes_[0], 1) != nullptr;
  });
  EXPECT_GT(seen_by_both, 40);
}

TEST_F(TwoCameras, AdjustmentFindsPosesAndMetricScale) {
  build_map();
  // Only the first pose is fixed: the scale comes from the baseline between the cameras.
  const BundleSummary summary = adjust();
  ASSERT_TRUE(summary.usable);
  ASSERT_EQ(window_.keyframes().size(), static_cast<std::size_t>(kKeyframes));
  (void)window_.take_back();
  EXPECT_LT(summary.final_cost, 1e-3 * summary.initial_cost);
  for (int k = 0; k < kKeyframes; ++k) {
    const SE3& T = map_.keyframes()[keyframes_[static_cast<std::size_t>(k)]].T_world_body;
    EXPECT_LT((T.t - true_pose(k).t).norm(), 1e-3) << k;
    EXPECT_LT((T.rotation() - true_pose(k).rotation()).norm(), 1e-4) << k;
  }
  double worst = 0.0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const Landmark* l = map_.landmarks().get(landmarks_[i]);
    if (l == nullptr) continue;
    const Eigen::Vector4d p = map_.world_point(*l);
    worst = std::max(worst, (p.head<3>() / p[3] - points_[i]).norm() / points_[i].norm());
  }
  EXPECT_LT(worst, 0.01);
}

TEST_F(TwoCameras, TheScaleFollowsTheBaselineOfTheRig) {
  // The same images under a rig that claims twice the baseline: everything is twice as large.
  Rig wide = rig_;
  for (RigCamera& c : wide.cameras) c.T_body_camera.t *= 2.0;
  build_map();
  map_.update_covisibility(keyframes_.back());
  window_.build(keyframes_.back());
  BundleProblem& problem = window_.problem();
  problem.rig = &wide;
  for (BundleProblem::Point& p : problem.points) p.T_host_anchor.t *= 2.0;
  BundleOptions options;
  options.iterations = 60;
  options.relative_decrease = 1e-9;
  ASSERT_TRUE(SchurSolver().solve(options, &problem).usable);
  (void)window_.take_back();
  const double way = (map_.keyframes()[keyframes_.back()].T_world_body.t -
                      map_.keyframes()[keyframes_.front()].T_world_body.t)
                         .norm();
  EXPECT_NEAR(way / (true_pose(kKeyframes - 1).t - true_pose(0).t).norm(), 2.0, 0.01);
}

// Index of a keyframe's pose in the window's problem.
int pose_of(const Window& window, KeyframeHandle keyframe) {
  const auto& all = window.keyframes();
  return static_cast<int>(std::find(all.begin(), all.end(), keyframe) - all.begin());
}

TEST_F(TwoCameras, WheelsAlongTheChainAreMeasuredByTheRig) {
  constexpr double kTyres = 1.04;  // true metres a metre of the wheels
  build_map();
  map_.update_covisibility(keyframes_.back());
  window_.build(keyframes_.back());
  BundleProblem& problem = window_.problem();
  problem.globals.push_back(GlobalState::positive(1.0));
  std::deque<WheelFactor> factors;
  for (std::size_t k = 1; k < keyframes_.size(); ++k) {
    const KeyframeHandle before = map_.chain().before(keyframes_[k]);
    ASSERT_EQ(before, keyframes_[k - 1]);
    const SE3 T_a_b = true_pose(static_cast<int>(k) - 1).inverse() * true_pose(static_cast<int>(k));
    WheelMotion motion;
    motion.displacement_m = T_a_b.t.head<2>() / kTyres;
    motion.yaw_rad = so3_log(T_a_b.q).z();
    motion.covariance = Eigen::Vector3d(1e-6, 1e-6, 1e-6).asDiagonal();
    factors.emplace_back(WheelFactorStates{pose_of(window_, before), pose_of(window_, keyframes_[k]),
                                           WheelFactorStates::kNone, 0},
                         motion);
  }
  for (const WheelFactor& factor : factors) problem.factors.push_back(&factor);
  BundleOptions options;
  options.iterations = 40;
  options.relative_decrease = 1e-9;
  ASSERT_TRUE(SchurSolver().solve(options, &problem).usable);
  EXPECT_NEAR(problem.globals[0].value.x(), kTyres, 1e-3);
  for (int k = 0; k < kKeyframes; ++k) {
    const int at = pose_of(window_, keyframes_[static_cast<std::size_t>(k)]);
    const SE3& T = problem.poses[static_cast<std::size_t>(at)].T_world_body;
    EXPECT_LT((T.t - true_pose(k).t).norm(), 1e-3) << k;
  }
}

// Sightings of all landmarks by the given cameras of a body at this pose.
std::vector<PoseMeasurement> measure(const Rig& rig, const std::vector<Eigen::Vector3d>& points,
                                     const SE3& T_world_body, const std::vector<int>& cameras) {
  std::vector<PoseMeasurement> out;
  for (const int c : cameras) {
    const RigCamera& camera = rig.cameras[static_cast<std::size_t>(c)];
    const SE3 T_camera_world = (T_world_body * camera.T_body_camera).inverse();
    for (const Eigen::Vector3d& point : points) {
      PoseMeasurement m;
      if (!camera.camera.project(T_camera_world * point, &m.pixel) || !camera.camera.in_image(m.pixel, 5.0))
        continue;
      m.point_w << point, 1.0;
      m.camera = c;
      out.push_back(m);
    }
  }
  return out;
}

TEST_F(TwoCameras, TrackingUsesBothCameras) {
  const SE3 truth = true_pose(2) * SE3{so3_exp({0.0, 0.0, 0.1}), {0.3, 0.1, 0.0}};
  for (const std::vector<int>& cameras : {std::vector{0}, std::vector{1}, std::vector{0, 1}}) {
    std::vector<PoseMeasurement> measurements = measure(rig_, points_, truth, cameras);
    ASSERT_GT(measurements.size(), 60U);
    const PoseSolution solution = solve_pose(rig_, true_pose(2), measurements);
    ASSERT_TRUE(solution.ok);
    EXPECT_LT((solution.T_world_body.t - truth.t).norm(), 1e-4) << cameras.size();
    EXPECT_LT((solution.T_world_body.rotation() - truth.rotation()).norm(), 1e-5) << cameras.size();
    EXPECT_EQ(solution.inliers, static_cast<int>(measurements.size()));
  }
}

}  // namespace
}  // namespace farpoint::slam
