// SPDX-License-Identifier: Apache-2.0
#include "slam/map/keyframe_memory.h"

#include <gtest/gtest.h>

#include <vector>

#include "tests/map/map_fixture.h"

namespace farpoint::slam {
namespace {

constexpr std::size_t kFeatures = 30;

TEST(KeyframeMemory, GivesWhatItPreallocatedAndThenNothing) {
  KeyframeMemory memory({.features = kFeatures, .with_pixels = 2, .thinned = 0});
  for (int i = 0; i < 2; ++i) {
    const KeyframeView k = memory.take();
    EXPECT_GE(k.set.features.capacity(), kFeatures);
    EXPECT_GE(k.set.descriptors.capacity(), kFeatures);
    EXPECT_GE(k.landmarks.capacity(), kFeatures);
    EXPECT_GE(k.bearings.capacity(), kFeatures);
  }
  EXPECT_EQ(KeyframeMemory::array_bytes(memory.take()), 0U);
}

TEST(KeyframeMemory, WhatIsGivenBackIsGivenAgain) {
  KeyframeMemory memory({.features = kFeatures, .with_pixels = 1, .thinned = 0});
  KeyframeView k = memory.take();
  k.set.features.emplace_back();
  const Feature* features = k.set.features.data();
  const LandmarkHandle* landmarks = k.landmarks.data();
  const std::size_t bytes = KeyframeMemory::array_bytes(k);
  EXPECT_EQ(memory.bytes(), 0U);
  memory.give_back(&k);
  EXPECT_EQ(memory.bytes(), bytes);
  EXPECT_EQ(KeyframeMemory::array_bytes(k), 0U) << "the keyframe has none of it any more";
  const KeyframeView again = memory.take();
  EXPECT_EQ(again.set.features.data(), features);
  EXPECT_EQ(again.landmarks.data(), landmarks);
}

TEST(KeyframeMemory, ThinnedListsAreEmptyAndUsedAgain) {
  KeyframeMemory memory({.features = kFeatures, .with_pixels = 0, .thinned = 1});
  auto list = memory.take_thinned(kFeatures / 3);
  EXPECT_TRUE(list.empty());
  EXPECT_EQ(list.capacity(), kFeatures / 3);
  const LandmarkHandle* data = list.data();
  list.emplace_back();
  memory.give_back_thinned(std::move(list));
  list = memory.take_thinned(1);
  EXPECT_TRUE(list.empty());
  EXPECT_EQ(list.data(), data);
}

TEST(KeyframeMemory, LongListsGoBackToTheHeap) {
  KeyframeMemory memory({.features = kFeatures, .with_pixels = 0, .thinned = 1});
  const std::size_t at_start = memory.bytes();
  auto list = memory.take_thinned(kFeatures / 3 + 1);
  EXPECT_GT(list.capacity(), kFeatures / 3);
  memory.give_back_thinned(std::move(list));
  EXPECT_EQ(memory.bytes(), at_start);
}

TEST(KeyframeMemory, OfNoFeaturesPreallocatesNothing) {
  KeyframeMemory memory({.features = 0, .with_pixels = 3, .thinned = 3});
  EXPECT_EQ(memory.bytes(), 0U);
  EXPECT_EQ(KeyframeMemory::array_bytes(memory.take()), 0U);
  EXPECT_GE(memory.take_thinned(7).capacity(), 7U);
}

// --- in the map: allocated at the start, and no more of it later

constexpr int kMostFeatures = 60;

class MapMemory : public testing::Test {
 protected:
  MapMemory() {
    preallocated.features = kMostFeatures;
    preallocated.covisible = 2;
    capacity.keyframes = 30;
    capacity.landmarks = 1000;
    capacity.window_images = 4;
  }
  // Filled into preallocated arrays, as mapping does; makes `landmarks` with the one before, which
  // all that have pixels see.
  KeyframeHandle next_keyframe(Map* map, KeyframeHandle before, int landmarks) {
    const KeyframeView made = make_view(map->camera(0).camera, kMostFeatures, &random);
    Keyframe k = map->new_keyframe();
    k.T_world_body = random_pose(&random);
    k.views[0] = map->preallocated_view();
    k.views[0].image = made.image;
    k.views[0].set = made.set;
    k.views[0].bearings = made.bearings;
    const KeyframeHandle handle = map->add_keyframe(std::move(k));
    for (int i = 0; !before.is_null() && i < landmarks; ++i) {
      const auto feature = static_cast<std::size_t>(i);
      const LandmarkHandle l = map->add_landmark(handle, 0, feature);
      for (const KeyframeHandle older : alive_)
        (void)map->add_observation(l, sighting(*map, older, kMostFeatures - 1 - feature));
    }
    map->update_covisibility(handle);
    return handle;
  }
  // Drives on: the newest `window_images` keep their pixels, the oldest goes when the map is full.
  void drive(Map* map, int keyframes, int landmarks) {
    for (int i = 0; i < keyframes; ++i) {
      if (map->keyframes().full()) {
        map->remove_keyframe(alive_.front());
        alive_.erase(alive_.begin());
      }
      alive_.push_back(next_keyframe(map, alive_.empty() ? KeyframeHandle{} : alive_.back(), landmarks));
      const auto images = static_cast<std::size_t>(capacity.window_images);
      if (alive_.size() > images) map->thin_keyframe(alive_[alive_.size() - 1 - images]);
    }
  }

  CapacityConfig capacity;
  MapOptions preallocated;
  Random random{5};
  std::vector<KeyframeHandle> alive_;
};

TEST_F(MapMemory, ALongDriveTakesNoMoreThanWasTakenAtTheStart) {
  Map map(capacity, two_camera_rig(), preallocated);
  const std::size_t at_start = map.keyframe_bytes();
  EXPECT_GT(at_start, map.keyframes().bytes() + 5 * kMostFeatures * (sizeof(Feature) + sizeof(Descriptor)));
  // Each sees 3 landmarks of its own and those of the next 4: fewer than a third of its features.
  for (int part = 0; part < 10; ++part) {
    drive(&map, 25, 3);
    EXPECT_EQ(map.keyframe_bytes(), at_start);
  }
}

TEST_F(MapMemory, WhatIsTakenBeyondItGoesBack) {
  Map map(capacity, two_camera_rig(), preallocated);
  const std::size_t at_start = map.keyframe_bytes();
  drive(&map, 40, 25);
  EXPECT_GT(map.keyframe_bytes(), at_start);
  drive(&map, 40, 3);
  EXPECT_EQ(map.keyframe_bytes(), at_start);
}

TEST_F(MapMemory, WithoutASizeRoomIsTakenAsNeeded) {
  Map map(capacity, two_camera_rig());
  EXPECT_EQ(map.keyframe_bytes(), map.keyframes().bytes());
  drive(&map, 40, 10);
  EXPECT_GT(map.keyframe_bytes(), map.keyframes().bytes());
}

}  // namespace
}  // namespace farpoint::slam
