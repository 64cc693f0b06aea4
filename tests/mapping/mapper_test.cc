// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/mapper.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "tests/support/point_world.h"

namespace farpoint::slam {
namespace {

using test::PointWorld;

constexpr std::size_t kKnown = 150;  // points that the first two views match; the map lacks the others

class MapperTest : public ::testing::Test {
 protected:
  std::shared_ptr<const LocalView> start(std::int32_t map_id = 1) {
    InitialPair pair = world.initial_pair(world.frame(0), world.frame(1));
    EXPECT_GT(pair.points.size(), kKnown + 20);
    pair.points.resize(kKnown);
    return mapper.start_map(pair, map_id);
  }
  [[nodiscard]] KeyframeRequest request(int step, const LocalView& view) const {
    return world.keyframe_request(step, view);
  }
  // Inserts and refines the keyframes of steps 2 and on.
  std::shared_ptr<const LocalView> drive(int last_step) {
    std::shared_ptr<const LocalView> view = start();
    for (int step = 2; step <= last_step && view; ++step) {
      view = mapper.insert(request(step, *view));
      if (view) view = mapper.refine();
    }
    return view;
  }
  [[nodiscard]] KeyframeHandle by_id(std::uint64_t id) const {
    KeyframeHandle out;
    mapper.map().keyframes().for_each([&](KeyframeHandle h, const Keyframe& k) {
      if (k.id == id) out = h;
    });
    return out;
  }
  // The keyframe's covisible ones against a count of the landmarks that are there now.
  void expect_covisibility(std::uint64_t id) const {
    const Map& map = mapper.map();
    const KeyframeHandle handle = by_id(id);
    std::map<std::uint32_t, int> shared;
    for (const LandmarkHandle& h : map.keyframes()[handle].views[0].landmarks) {
      const Landmark* l = map.landmarks().get(h);
      if (l == nullptr || l->state == LandmarkState::kBearing) continue;
      for (const Observation& o : l->observations)
        if (o.keyframe != handle) ++shared[o.keyframe.index];
    }
    const auto& covisible = map.keyframes()[handle].covisible;
    EXPECT_EQ(covisible.size(), shared.size());
    for (const Covisible& c : covisible) EXPECT_EQ(c.shared, shared[c.keyframe.index]);
  }
  void expect_true_places(const LocalView& view, double tolerance) const {
    for (const ViewKeyframe& k : view.keyframes) {
      const SE3 truth = PointWorld::pose(static_cast<int>(k.id) - 1);
      EXPECT_LT(k.T_world_body.boxminus_to(truth).norm(), tolerance) << "keyframe " << k.id;
    }
    int wrong = 0;
    for (const ViewLandmark& l : view.landmarks) {
      const std::uint32_t point = test::point_of(l.patch);
      const Eigen::Vector3d p = l.point_w.head<3>() / l.point_w[3];
      wrong += (p - world.point_w(point)).norm() > 0.02 * world.point_w(point).norm() ? 1 : 0;
    }
    EXPECT_EQ(wrong, 0);
  }

  PointWorld world;
  Mapper mapper{test::small_config(), world.rig()};
};

TEST_F(MapperTest, StartsAMapFromTwoViews) {
  const auto view = start(7);
  ASSERT_TRUE(view);
  EXPECT_EQ(view->map_id, 7);
  EXPECT_EQ(view->reference_id, 2U);
  EXPECT_EQ(view->keyframes.size(), 2U);
  EXPECT_GT(view->landmarks.size(), 100U);
  EXPECT_FALSE(view->judgement.steady);
  EXPECT_EQ(mapper.counts().landmarks_made, view->landmarks.size());
  EXPECT_EQ(mapper.counts().keyframes_made, 2U);
  EXPECT_EQ(mapper.counts().local_ba, 1U);
  expect_true_places(*view, 1e-3);
  expect_covisibility(2);
}

TEST_F(MapperTest, MapWithTooFewPointsIsDiscarded) {
  InitialPair pair = world.initial_pair(world.frame(0), world.frame(1));
  pair.points.resize(30);
  EXPECT_EQ(mapper.start_map(pair, 1), nullptr);
  EXPECT_EQ(mapper.map().keyframes().size(), 0U);
  EXPECT_EQ(mapper.map().landmarks().size(), 0U);
}

TEST_F(MapperTest, InsertsTheKeyframeWhereTheRequestPutsIt) {
  const auto first = start();
  ASSERT_TRUE(first);
  const auto view = mapper.insert(request(2, *first));
  ASSERT_TRUE(view);
  EXPECT_EQ(view->reference_id, 3U);
  EXPECT_LT(view->T_world_reference.boxminus_to(PointWorld::pose(2)).norm(), 1e-9);
  EXPECT_EQ(view->keyframes.size(), 3U);
  EXPECT_EQ(view->sequence, 2U);
}

TEST_F(MapperTest, InsertAttachesWhatTrackingSaw) {
  const auto first = start();
  ASSERT_TRUE(first);
  const KeyframeRequest r = request(2, *first);
  const auto view = mapper.insert(r);
  ASSERT_TRUE(view);
  int attached = 0;
  const KeyframeHandle k = by_id(view->reference_id);
  for (const Sighting& s : r.sightings) {
    const Landmark* l = mapper.map().landmarks().get(s.landmark);
    attached += l != nullptr && Map::find_observation(*l, k) != nullptr ? 1 : 0;
  }
  EXPECT_GT(attached, 100);
}

TEST_F(MapperTest, InsertMakesLandmarksAndCountsCovisibilityWithThem) {
  const auto first = start();
  ASSERT_TRUE(first);
  const std::uint64_t made = mapper.counts().landmarks_made;
  const auto view = mapper.insert(request(2, *first));
  ASSERT_TRUE(view);
  EXPECT_GT(mapper.counts().landmarks_made, made);
  expect_covisibility(view->reference_id);
}

TEST_F(MapperTest, SightingCountsAddUp) {
  const auto first = start();
  ASSERT_TRUE(first);
  const KeyframeRequest r = request(2, *first);
  ASSERT_TRUE(mapper.insert(r));
  const Landmark* l = mapper.map().landmarks().get(r.counts.front().landmark);
  ASSERT_NE(l, nullptr);
  EXPECT_EQ(l->visible, 3U);
  EXPECT_EQ(l->found, 2U);
}

TEST_F(MapperTest, UnknownReferenceChangesNothing) {
  const auto first = start();
  ASSERT_TRUE(first);
  KeyframeRequest r = request(2, *first);
  r.reference_id = 99;
  EXPECT_EQ(mapper.insert(r), nullptr);
  EXPECT_EQ(mapper.map().keyframes().size(), 2U);
}

TEST_F(MapperTest, RefineCorrectsAKeyframeThatCameInWrong) {
  const auto view = drive(4);
  ASSERT_TRUE(view);
  KeyframeRequest r = request(5, *view);
  Vector6d delta;
  delta << 0.02, -0.02, 0.01, 0.002, -0.001, 0.001;
  r.T_reference_body = r.T_reference_body.boxplus(delta);
  const LandmarkHandle mistaken = r.sightings[3].landmark;
  r.sightings[3].pixel.x() += 30.0F;
  ASSERT_TRUE(mapper.insert(r));
  const auto refined = mapper.refine();
  ASSERT_TRUE(refined);
  EXPECT_EQ(refined->reference_id, 6U);
  EXPECT_LT(refined->T_world_reference.boxminus_to(PointWorld::pose(5)).norm(), 5e-3);
  // The wrong sighting is removed, and no longer counts.
  const Landmark* l = mapper.map().landmarks().get(mistaken);
  ASSERT_NE(l, nullptr);
  EXPECT_EQ(Map::find_observation(*l, by_id(refined->reference_id)), nullptr);
  expect_covisibility(refined->reference_id);
}

TEST_F(MapperTest, DriveSettlesInTheTruePlaces) {
  const auto view = drive(6);
  ASSERT_TRUE(view);
  EXPECT_TRUE(view->judgement.steady);
  EXPECT_GT(view->landmarks.size(), kKnown);
  expect_true_places(*view, 5e-3);
  EXPECT_EQ(mapper.counts().local_ba, 6U);
  EXPECT_EQ(mapper.counts().vmp_alive, [&] {
    std::uint32_t n = 0;
    mapper.map().landmarks().for_each(
        [&](LandmarkHandle, const Landmark& l) { n += l.state == LandmarkState::kBearing ? 1U : 0U; });
    return n;
  }());
}

TEST_F(MapperTest, NoViewIsMadeWhileAllAreInUse) {
  std::vector<std::shared_ptr<const LocalView>> held{start()};
  while (held.size() < ViewBuilder::kViews) {
    held.push_back(mapper.refine());
    ASSERT_TRUE(held.back());
  }
  EXPECT_EQ(mapper.refine(), nullptr);
  held.pop_back();
  EXPECT_TRUE(mapper.refine());
}

TEST_F(MapperTest, RefineWithoutItsKeyframeDoesNothing) {
  EXPECT_EQ(mapper.refine(), nullptr);
  ASSERT_TRUE(start());
  mapper.discard_map(1);
  EXPECT_EQ(mapper.refine(), nullptr);
  EXPECT_EQ(mapper.map().landmarks().size(), 0U);
}

TEST_F(MapperTest, RetiredMapKeepsItsKeyframesWithoutPixels) {
  ASSERT_TRUE(start(1));
  ASSERT_TRUE(start(2));
  mapper.retire_map(1);
  int with_pixels = 0;
  mapper.map().keyframes().for_each([&](KeyframeHandle, const Keyframe& k) {
    EXPECT_EQ(k.has_pixels(), k.map_id == 2);
    with_pixels += k.has_pixels() ? 1 : 0;
  });
  EXPECT_EQ(with_pixels, 2);
  EXPECT_EQ(mapper.map().keyframes().size(), 4U);
}

}  // namespace
}  // namespace farpoint::slam
