// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/view_builder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/support/point_world.h"

namespace farpoint::slam {
namespace {

using test::MappedWorld;

struct Drive {
  explicit Drive(const EstimatorConfig& config = test::small_config()) : w(config), k(w.add_keyframes(4)) {
    landmarks = w.add_landmarks(0, 60, {k[0], k[1], k[2], k[3]});
    const auto more = w.add_landmarks(60, 100, {k[0], k[1]});
    landmarks.insert(landmarks.end(), more.begin(), more.end());
    w.update_covisibility(k);
  }
  MappedWorld w;
  std::vector<KeyframeHandle> k;
  std::vector<LandmarkHandle> landmarks;
};

const ViewLandmark* find(const LocalView& view, LandmarkHandle handle) {
  for (const ViewLandmark& l : view.landmarks)
    if (l.handle == handle) return &l;
  return nullptr;
}

const MapJudgement kSteady{.steady = true};

TEST(ViewBuilder, KeyframesHaveTheirOwnPosesByAscendingId) {
  Drive d;
  ViewBuilder builder(d.w.config, &d.w.map);
  const auto view = builder.build(d.k[3], kSteady);
  ASSERT_TRUE(view);
  EXPECT_EQ(view->reference_id, d.w.id(d.k[3]));
  EXPECT_EQ(view->T_world_reference.t, test::PointWorld::pose(3).t);
  EXPECT_EQ(view->map_id, 1);
  EXPECT_EQ(view->map_keyframes, 4);
  EXPECT_TRUE(view->judgement.steady);
  ASSERT_EQ(view->keyframes.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(view->keyframes[i].id, d.w.id(d.k[i]));
    EXPECT_EQ(view->keyframes[i].T_world_body.t, test::PointWorld::pose(static_cast<int>(i)).t);
    EXPECT_EQ(view->keyframes[i].T_world_body.q.coeffs(),
              test::PointWorld::pose(static_cast<int>(i)).q.coeffs());
  }
}

TEST(ViewBuilder, KeyframesHaveTheirOwnScales) {
  Drive d;
  ViewBuilder builder(d.w.config, &d.w.map);
  d.w.map.correct_keyframe(d.k[1], {2.0, Eigen::Quaterniond::Identity(), {0, 0, 0}});
  d.w.map.correct_keyframe(d.k[3], {3.0, Eigen::Quaterniond::Identity(), {0, 0, 0}});
  const auto view = builder.build(d.k[3], kSteady);
  ASSERT_EQ(view->keyframes.size(), 4U);
  EXPECT_EQ(view->keyframes[0].scale, 1.0);
  EXPECT_EQ(view->keyframes[1].scale, 2.0);
  EXPECT_EQ(view->keyframes[3].scale, 3.0);
  EXPECT_EQ(view->reference_scale, 3.0);
  EXPECT_EQ(builder.build(d.k[1], kSteady)->S_world_reference().scale, 2.0);
}

TEST(ViewBuilder, EveryLandmarkAppearsOnceAndInItsPlace) {
  Drive d;
  ViewBuilder builder(d.w.config, &d.w.map);
  const auto view = builder.build(d.k[3], {});
  EXPECT_FALSE(view->judgement.steady);
  ASSERT_EQ(view->landmarks.size(), d.landmarks.size());
  std::set<std::uint32_t> slots;
  for (const ViewLandmark& l : view->landmarks) {
    EXPECT_TRUE(slots.insert(l.handle.index).second) << "twice";
    ASSERT_TRUE(d.w.map.landmarks().contains(l.handle));
    const Landmark& landmark = d.w.map.landmarks()[l.handle];
    const std::uint32_t point = test::point_of(landmark.patch);
    EXPECT_LT((l.point_w.head<3>() / l.point_w[3] - d.w.world.point_w(point)).norm(), 1e-4);
    EXPECT_EQ(l.descriptor, landmark.descriptor);
    EXPECT_EQ(l.in_reference, Map::find_observation(landmark, d.k[3]) != nullptr);
  }
}

TEST(ViewBuilder, MovedKeyframeMovesItsLandmarksInTheNextView) {
  Drive d;
  ViewBuilder builder(d.w.config, &d.w.map);
  const auto before = builder.build(d.k[3], {});
  const Eigen::Vector3d moved(0.5, -0.25, 0.125);
  d.w.map.keyframes()[d.k[0]].T_world_body.t += moved;
  const auto after = builder.build(d.k[3], {});
  const ViewLandmark &a = before->landmarks.front(), &b = after->landmarks.front();
  ASSERT_EQ(a.handle, b.handle);
  EXPECT_LT((b.point_w.head<3>() / b.point_w[3] - a.point_w.head<3>() / a.point_w[3] - moved).norm(), 1e-9);
}

TEST(ViewBuilder, LandmarksSayHowOftenTheyAreFound) {
  Drive d;
  ViewBuilder builder(d.w.config, &d.w.map);
  Landmark& often = *d.w.map.landmarks().get(d.landmarks[0]);
  often.visible = 10, often.found = 9;
  Landmark& seldom = *d.w.map.landmarks().get(d.landmarks[1]);
  seldom.visible = 40, seldom.found = 4;
  const auto view = builder.build(d.k[3], kSteady);
  ASSERT_TRUE(view);
  EXPECT_FLOAT_EQ(find(*view, d.landmarks[0])->found_share, 0.9F);
  EXPECT_FLOAT_EQ(find(*view, d.landmarks[1])->found_share, 0.1F);
}

TEST(ViewBuilder, RemovedLandmarksAreNotInTheNextView) {
  Drive d;
  ViewBuilder builder(d.w.config, &d.w.map);
  // Every view of the pool holds it once.
  for (std::size_t i = 0; i < ViewBuilder::kViews; ++i)
    EXPECT_NE(find(*builder.build(d.k[3], {}), d.landmarks[5]), nullptr);
  d.w.map.remove_landmark(d.landmarks[5]);
  for (std::size_t i = 0; i < ViewBuilder::kViews; ++i) {
    const auto view = builder.build(d.k[3], {});
    EXPECT_EQ(find(*view, d.landmarks[5]), nullptr);
    EXPECT_EQ(view->landmarks.size(), d.landmarks.size() - 1);
    EXPECT_EQ(view->keyframes.size(), 4U);
  }
}

TEST(ViewBuilder, VirtualPointsNeedSightingsAndNoFailedPromotion) {
  EstimatorConfig config = test::small_config();
  config.landmarks.bearing_observations = 3;
  Drive d(config);
  const auto make_virtual = [&](std::size_t i, std::uint8_t failures) {
    Landmark& l = d.w.map.landmarks()[d.landmarks[i]];
    l.state = LandmarkState::kBearing;
    l.failures = failures;
  };
  make_virtual(0, 0);
  make_virtual(1, 1);
  make_virtual(d.landmarks.size() - 1, 0);  // two sightings only
  ViewBuilder builder(d.w.config, &d.w.map);
  const auto view = builder.build(d.k[3], {});
  ASSERT_NE(find(*view, d.landmarks[0]), nullptr);
  EXPECT_FALSE(find(*view, d.landmarks[0])->confirmed);
  EXPECT_EQ(find(*view, d.landmarks[1]), nullptr);
  EXPECT_EQ(find(*view, d.landmarks.back()), nullptr);
}

TEST(ViewBuilder, FullViewHoldsTheReferencesLandmarksFirst) {
  EstimatorConfig config = test::small_config();
  config.capacity.view_landmarks = 20;
  Drive d(config);
  ViewBuilder builder(d.w.config, &d.w.map);
  const std::size_t bytes = builder.bytes();
  const auto view = builder.build(d.k[3], {});
  EXPECT_EQ(view->landmarks.size(), 20U);
  for (const ViewLandmark& l : view->landmarks) EXPECT_TRUE(l.in_reference);
  EXPECT_EQ(view->keyframes.size(), 4U);
  EXPECT_EQ(builder.bytes(), bytes);
}

TEST(ViewBuilder, ReferenceIsSummarised) {
  Drive d;
  const LandmarkHandle weak = d.w.map.keyframes()[d.k[3]].views[0].landmarks[0];
  ASSERT_TRUE(d.w.map.landmarks().contains(weak));
  d.w.map.landmarks()[weak].state = LandmarkState::kWeak;  // confirmed by its four sightings
  const LandmarkHandle seldom = d.landmarks[2];
  ASSERT_NE(seldom, weak);
  d.w.map.landmarks()[seldom].state = LandmarkState::kWeak;
  ASSERT_TRUE(d.w.map.remove_observation(seldom, d.k[1], 0));
  ASSERT_TRUE(d.w.map.remove_observation(seldom, d.k[2], 0));
  ViewBuilder builder(d.w.config, &d.w.map);
  const auto view = builder.build(d.k[3], {});
  int confirmed = 0;
  double nearness = 0.0;
  std::vector<double> depths;
  const Eigen::Vector3d camera = d.w.map.T_world_camera(d.w.map.keyframes()[d.k[3]], 0).t;
  for (const ViewLandmark& l : view->landmarks) {
    if (!l.in_reference) continue;
    const double depth = (l.point_w.head<3>() / l.point_w[3] - camera).norm();
    EXPECT_NEAR(l.nearness, 1.0 / depth, 1e-9);
    EXPECT_EQ(l.confirmed, l.handle != seldom);
    confirmed += l.confirmed ? 1 : 0;
    nearness += l.confirmed ? 1.0 / depth : 0.0;
    depths.push_back(depth);
  }
  EXPECT_GT(confirmed, 20);
  EXPECT_EQ(view->reference_landmarks, confirmed);
  EXPECT_NEAR(view->reference_nearness, nearness, 1e-9);
  std::sort(depths.begin(), depths.end());
  EXPECT_NEAR(view->median_depth, depths[depths.size() / 2], 1e-9);
}

TEST(ViewBuilder, ExhaustedPoolGivesNoViewUntilOneIsDropped) {
  Drive d;
  ViewBuilder builder(d.w.config, &d.w.map);
  std::vector<std::shared_ptr<const LocalView>> held;
  for (std::size_t i = 0; i < ViewBuilder::kViews; ++i) {
    held.push_back(builder.build(d.k[3], {}));
    ASSERT_TRUE(held.back());
    EXPECT_EQ(held.back()->sequence, i + 1);
  }
  EXPECT_EQ(builder.build(d.k[3], {}), nullptr);
  // The views in use are untouched.
  for (std::size_t i = 0; i < held.size(); ++i) EXPECT_EQ(held[i]->sequence, i + 1);
  const LocalView* dropped = held[2].get();
  held[2].reset();
  const auto view = builder.build(d.k[3], {});
  EXPECT_EQ(view.get(), dropped);
  EXPECT_EQ(view->sequence, ViewBuilder::kViews + 1);
  EXPECT_EQ(view->landmarks.size(), held[0]->landmarks.size());
}

TEST(ViewBuilder, OtherMapsKeyframesDoNotCount) {
  Drive d;
  d.w.maker.make(*d.w.world.frame(5), test::PointWorld::pose(5), 2);
  ViewBuilder builder(d.w.config, &d.w.map);
  EXPECT_EQ(builder.build(d.k[3], {})->map_keyframes, 4);
}

}  // namespace
}  // namespace farpoint::slam
