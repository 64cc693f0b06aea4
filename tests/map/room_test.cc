// The memory of keyframes: taken at the start, and no more of it later.
#include <gtest/gtest.h>

#include <vector>

#include "slam/map/map.h"
#include "tests/map/map_fixture.h"

namespace farpoint::slam {
namespace {

constexpr int kFeatures = 60;

class KeyframeRoom : public testing::Test {
 protected:
  KeyframeRoom() {
    with_room.features = kFeatures;
    with_room.covisible = 2;
    capacity.keyframes = 30;
    capacity.landmarks = 1000;
    capacity.window_images = 4;
  }
  // Filled into the room of one that has gone, as mapping does; makes `landmarks` with the one before, which
  // all that have pixels see.
  KeyframeHandle next_keyframe(Map* map, KeyframeHandle before, int landmarks) {
    const Keyframe made = make_keyframe(map->rig(), 0, random_pose(&random), kFeatures, &random);
    Keyframe k = map->roomy_keyframe();
    k.image = made.image;
    k.set = made.set;
    k.bearings = made.bearings;
    const KeyframeHandle handle = map->add_keyframe(std::move(k));
    for (int i = 0; !before.is_null() && i < landmarks; ++i) {
      const auto feature = static_cast<std::size_t>(i);
      const LandmarkHandle l = map->add_landmark(handle, feature);
      for (const KeyframeHandle older : alive_)
        (void)map->add_observation(l, sighting(*map, older, kFeatures - 1 - feature));
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
  MapOptions with_room;
  Random random{5};
  std::vector<KeyframeHandle> alive_;
};

TEST_F(KeyframeRoom, ALongDriveTakesNoMoreThanWasTakenAtTheStart) {
  Map map(capacity, two_camera_rig(), with_room);
  const std::size_t at_start = map.keyframe_bytes();
  EXPECT_GT(at_start, map.keyframes().bytes() + 5 * kFeatures * (sizeof(Feature) + sizeof(Descriptor)));
  // Each sees 3 landmarks of its own and those of the next 4: fewer than a third of its features.
  for (int part = 0; part < 10; ++part) {
    drive(&map, 25, 3);
    EXPECT_EQ(map.keyframe_bytes(), at_start);
  }
}

TEST_F(KeyframeRoom, WhatIsTakenBeyondItGoesBack) {
  Map map(capacity, two_camera_rig(), with_room);
  const std::size_t at_start = map.keyframe_bytes();
  drive(&map, 40, 25);
  EXPECT_GT(map.keyframe_bytes(), at_start);
  drive(&map, 40, 3);
  EXPECT_EQ(map.keyframe_bytes(), at_start);
}

TEST_F(KeyframeRoom, WithoutASizeRoomIsTakenAsNeeded) {
  Map map(capacity, two_camera_rig());
  EXPECT_EQ(map.keyframe_bytes(), map.keyframes().bytes());
  drive(&map, 40, 10);
  EXPECT_GT(map.keyframe_bytes(), map.keyframes().bytes());
}

// Landmarks come and go, their lists grow and shrink.
void live_through(ObservationRoom* room, int landmarks, Random* random) {
  using List = std::pmr::vector<Observation>;
  std::vector<List> lists;
  lists.reserve(static_cast<std::size_t>(landmarks));
  for (int i = 0; i < landmarks; ++i) lists.emplace_back(room->resource());
  for (int step = 0; step < 20 * landmarks; ++step) {
    List& list = lists[random->below(lists.size())];
    if (list.size() == 16) {
      list.clear();
      list.shrink_to_fit();
    }
    Observation o;
    o.feature = static_cast<std::int32_t>(list.size());
    list.push_back(o);
    ASSERT_EQ(list.front().feature, 0);
    ASSERT_EQ(list.back().feature, static_cast<std::int32_t>(list.size()) - 1);
  }
}

TEST(ObservationRoom, IsUsedAgainAndThenTheHeap) {
  Random random{3};
  ObservationRoom room(4000, 20);
  EXPECT_EQ(room.bytes(), 4000 * sizeof(Observation));
  for (int drive = 0; drive < 5; ++drive) live_through(&room, 100, &random);
  EXPECT_EQ(room.heap_bytes(), 0U) << "100 lists of 16 have room, and give it back";
  live_through(&room, 2000, &random);
  EXPECT_GT(room.heap_bytes(), 0U);
}

TEST(ObservationRoom, OfNoSizeIsTheHeap) {
  Random random{4};
  ObservationRoom room(0, 48);
  live_through(&room, 50, &random);
  EXPECT_GT(room.heap_bytes(), 0U);
}

}  // namespace
}  // namespace farpoint::slam
