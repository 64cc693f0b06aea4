// SPDX-License-Identifier: Apache-2.0
#include "slam/tracking/initialiser.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <vector>

#include "tests/ipc/allocations.h"
#include "tests/support/tracking_scene.h"

namespace farpoint::slam {
namespace {

using test::SceneFrame;
using test::ScenePoint;
using test::TrackingScene;

class InitialiserTest : public testing::Test {
 protected:
  InitialiserTest() {
    // While the scale is unknown the body stands at the camera.
    scene.rig.cameras[0].T_body_camera.t.setZero();
    initialiser.emplace(scene.config, scene.rig);
  }
  std::optional<InitialPair> add(const SE3& T_world_body) {
    frames.push_back(scene.look(T_world_body, static_cast<std::int64_t>(frames.size()) * 100'000));
    const InitialPair* pair = initialiser->add(frames.back().frame);
    return pair != nullptr ? std::optional(*pair) : std::nullopt;
  }
  [[nodiscard]] const SceneFrame& shown(const std::shared_ptr<Frame>& frame) const {
    return frames[static_cast<std::size_t>(frame->number)];
  }
  static SE3 aside(double metres) {
    return TrackingScene::pose({0.1 * metres, metres, 0}, {0, 0, 0.01 * metres});
  }

  TrackingScene scene{400};
  std::optional<Initialiser> initialiser;
  std::vector<SceneFrame> frames;
};

TEST_F(InitialiserTest, FindsMotionAndPointsOfTwoFrames) {
  EXPECT_FALSE(add(aside(0)).has_value());
  const std::optional<InitialPair> pair = add(aside(0.8));
  ASSERT_TRUE(pair.has_value());
  EXPECT_EQ(pair->first, frames[0].frame);
  EXPECT_EQ(pair->second, frames[1].frame);
  const SE3 truth = aside(0).inverse() * aside(0.8);
  const double baseline = truth.t.norm();
  EXPECT_LT((pair->T_first_second.t - truth.t / baseline).norm(), 2e-3);
  EXPECT_LT(so3_log(pair->T_first_second.q.conjugate() * truth.q).norm(), 5e-4);
  EXPECT_GT(pair->points.size(), 300U);
  EXPECT_EQ(initialiser->last_matches(), static_cast<int>(pair->points.size()));
  for (const InitialPoint& p : pair->points) {
    const int point = frames[0].point_of_feature[p.feature_first];
    ASSERT_EQ(point, frames[1].point_of_feature[p.feature_second]);
    const double distance = scene.points[static_cast<std::size_t>(point)].position_w.norm();
    EXPECT_NEAR(p.inverse_depth, baseline / distance, 0.02 * baseline / distance + 1e-3) << point;
  }
}

TEST_F(InitialiserTest, WaitsForParallax) {
  (void)add(aside(0));
  EXPECT_FALSE(add(aside(0.02)).has_value());
  EXPECT_FALSE(add(aside(0.04)).has_value());
  const std::optional<InitialPair> pair = add(aside(0.8));
  ASSERT_TRUE(pair.has_value());
  EXPECT_EQ(pair->first, frames[0].frame);
}

TEST_F(InitialiserTest, InventsNothingFromARotation) {
  for (int i = 0; i < 6; ++i)
    EXPECT_FALSE(add(TrackingScene::pose({0, 0, 0}, {0, 0.01 * i, 0.02 * i})).has_value()) << i;
}

TEST_F(InitialiserTest, NeedsEnoughLandmarks) {
  for (std::size_t i = 70; i < scene.points.size(); ++i) scene.points[i].visible = false;
  (void)add(aside(0));
  EXPECT_FALSE(add(aside(0.8)).has_value());
}

TEST_F(InitialiserTest, AnotherPlaceBecomesTheReference) {
  (void)add(aside(0));
  for (ScenePoint& p : scene.points)
    for (std::uint64_t& word : p.descriptor.words) word = ~word * 0x9E3779B97F4A7C15ULL;
  EXPECT_FALSE(add(aside(0.8)).has_value());
  const std::optional<InitialPair> pair = add(aside(1.6));
  ASSERT_TRUE(pair.has_value());
  EXPECT_EQ(pair->first, frames[1].frame);
}

// Each point goes its own way: by up to `share` of its distance, in any direction.
void scatter(std::vector<ScenePoint>* points, double share) {
  std::uint64_t random = 1;
  for (ScenePoint& p : *points) {
    const double distance = p.position_w.norm();
    for (double& x : p.position_w) {
      random = random * 6364136223846793005ULL + 1442695040888963407ULL;
      x += share * distance * (static_cast<double>(random >> 40) / (1 << 23) - 1.0);
    }
  }
}

TEST_F(InitialiserTest, NamesTheShareThatAgreesOnlyWhereAMotionWasFound) {
  for (const double share : {0.03, 0.05, 0.08, 0.12, 0.2}) {
    initialiser.emplace(scene.config, scene.rig);
    frames.clear();
    (void)add(aside(0));
    scatter(&scene.points, share);
    EXPECT_FALSE(add(aside(0)).has_value()) << share;
    const Refusal refusal = initialiser->refusal();
    EXPECT_EQ(refusal.reason, Reason::kNoCommonMotion) << share;
    if (std::isnan(refusal.value)) continue;
    EXPECT_GT(refusal.value, 0.0) << share;
    EXPECT_LT(refusal.value, refusal.wanted) << share;
  }
}

TEST_F(InitialiserTest, RenewsItsReferenceAfterTheConfiguredFrames) {
  scene.config.initialisation.max_age_s = 0.6;
  initialiser.emplace(scene.config, scene.rig);
  for (int i = 0; i <= 7; ++i) EXPECT_FALSE(add(aside(0.0)).has_value()) << i;
  const std::optional<InitialPair> pair = add(aside(0.8));
  ASSERT_TRUE(pair.has_value());
  EXPECT_EQ(pair->first->number, 4U);  // half way between frame 0 and frame 7
}

// In all 100 px, more than the window of 51 px: each search starts where the last one found the corner.
TEST_F(InitialiserTest, FollowsCornersOverManyFrames) {
  for (int i = 0; i <= 6; ++i) (void)add(TrackingScene::pose({0, 0, 0}, {0, 0, 0.04 * i}));
  const std::optional<InitialPair> pair = add(TrackingScene::pose({0.1, 0.8, 0}, {0, 0, 0.24}));
  ASSERT_TRUE(pair.has_value());
  EXPECT_EQ(pair->first, frames[0].frame);
}

TEST_F(InitialiserTest, AsksForTheConfiguredParallax) {
  scene.config.initialisation.min_parallax_rad = 0.3;  // 0.8 units aside at 4 units are 0.2 rad
  initialiser.emplace(scene.config, scene.rig);
  (void)add(aside(0));
  EXPECT_FALSE(add(aside(0.8)).has_value());
}

TEST_F(InitialiserTest, RemembersTheLastSixtyFramesOldestFirst) {
  for (int i = 0; i < 70; ++i) {
    frames.push_back(scene.look(SE3{}, i));
    initialiser->remember(frames.back().frame);
  }
  ASSERT_EQ(initialiser->history().size(), Initialiser::kHistoryFrames);
  EXPECT_EQ(initialiser->history().front(), frames[10].frame);
  EXPECT_EQ(initialiser->history().back(), frames[69].frame);
  initialiser->clear();
  EXPECT_TRUE(initialiser->history().empty());
}

TEST_F(InitialiserTest, AClearedOneBeginsWithTheNextFrame) {
  (void)add(aside(0));
  initialiser->clear();
  EXPECT_FALSE(add(aside(0.8)).has_value());
  const std::optional<InitialPair> pair = add(aside(1.6));
  ASSERT_TRUE(pair.has_value());
  EXPECT_EQ(pair->first, frames[1].frame);
}

// Waiting, a lost reference, no parallax, and a pair.
TEST_F(InitialiserTest, MakesNoHeapCallAfterTheStart) {
  if (!farpoint::test::counts_allocations()) GTEST_SKIP() << "a sanitizer owns the heap";
  std::vector<SceneFrame> shown;
  for (const double metres : {0.0, 0.01, 0.02, 0.8})
    shown.push_back(scene.look(aside(metres), static_cast<std::int64_t>(shown.size()) * 100'000));
  for (ScenePoint& p : scene.points)
    for (std::uint64_t& word : p.descriptor.words) word = ~word * 0x9E3779B97F4A7C15ULL;
  for (const double metres : {1.6, 2.4})
    shown.push_back(scene.look(aside(metres), static_cast<std::int64_t>(shown.size()) * 100'000));
  const std::uint64_t before = farpoint::test::allocations();
  int pairs = 0;
  for (const SceneFrame& frame : shown) pairs += initialiser->add(frame.frame) != nullptr ? 1 : 0;
  initialiser->clear();
  const std::uint64_t after = farpoint::test::allocations();
  EXPECT_EQ(after - before, 0U);
  EXPECT_GT(before, 0U);  // the count works
  EXPECT_EQ(pairs, 2);
}

// The pixels of most frames go back to their pool: only a frame half way can be the next reference.
TEST_F(InitialiserTest, KeepsThePixelsOfReferenceNewestAndEverySecondFrameSinceHalfWay) {
  for (int i = 0; i <= 10; ++i) (void)add(SE3{});
  std::vector<std::uint64_t> with_pixels;
  for (const auto& f : initialiser->history())
    if (f->has_pixels()) with_pixels.push_back(f->number);
  EXPECT_EQ(with_pixels, (std::vector<std::uint64_t>{0, 6, 8, 10}));
}

}  // namespace
}  // namespace farpoint::slam
