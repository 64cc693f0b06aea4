// Which keyframes come first as neighbours: those that share what shows translation.
#include <gtest/gtest.h>

#include <initializer_list>
#include <vector>

#include "slam/map/map.h"
#include "tests/map/map_fixture.h"

namespace farpoint::slam {
namespace {

constexpr double kWide_rad = 0.02;

class WideCovisibility : public testing::Test {
 protected:
  KeyframeHandle keyframe() {
    return map.add_keyframe(make_keyframe(map.rig(), 0, random_pose(&random), 10, &random));
  }
  void share(KeyframeHandle a, KeyframeHandle b, std::initializer_list<std::size_t> features,
             double parallax_rad) {
    for (const std::size_t feature : features) {
      const LandmarkHandle h = map.add_landmark(a, feature);
      ASSERT_FALSE(h.is_null());
      ASSERT_TRUE(map.add_observation(h, sighting(map, b, feature)));
      map.landmarks()[h].state = LandmarkState::kFull;
      map.landmarks()[h].max_parallax_rad = parallax_rad;
    }
  }

  explicit WideCovisibility(const MapOptions& options = {.wide_parallax_rad = kWide_rad})
      : map(CapacityConfig{}, two_camera_rig(), options) {}

  Random random{11};
  Map map;
  const KeyframeHandle centre = keyframe(), far = keyframe(), near = keyframe(), nearer = keyframe();
};

TEST_F(WideCovisibility, OneWideLandmarkCountsMoreThanManyNarrowOnes) {
  share(centre, far, {0, 1, 2, 3}, 0.5 * kWide_rad);
  share(centre, near, {4}, 2 * kWide_rad);
  share(centre, near, {5}, 0.5 * kWide_rad);
  share(centre, nearer, {6, 7}, kWide_rad);
  map.update_covisibility(centre);
  const auto& list = map.keyframes()[centre].covisible;
  ASSERT_EQ(list.size(), 3U);
  EXPECT_EQ(list[0].keyframe, nearer);
  EXPECT_EQ(list[0].wide, 2);
  EXPECT_EQ(list[1].keyframe, near);
  EXPECT_EQ(list[1].wide, 1);
  EXPECT_EQ(list[1].shared, 2);
  EXPECT_EQ(list[2].keyframe, far);
  EXPECT_EQ(list[2].wide, 0);
  EXPECT_EQ(list[2].shared, 4);
  // Seen from the other side too.
  ASSERT_EQ(map.keyframes()[near].covisible.size(), 1U);
  EXPECT_EQ(map.keyframes()[near].covisible[0].wide, 1);
}

// With room for two neighbours each.
class ShortLists : public WideCovisibility {
 protected:
  ShortLists() : WideCovisibility({.covisible = 2}) {}
};

TEST_F(ShortLists, KeepTheStrongest) {
  std::vector<KeyframeHandle> k;
  k.reserve(5);
  for (int i = 0; i < 5; ++i) k.push_back(keyframe());
  const auto names = [&](int i) {
    std::vector<KeyframeHandle> list;
    for (const Covisible& c : map.keyframes()[k[static_cast<std::size_t>(i)]].covisible)
      list.push_back(c.keyframe);
    return list;
  };
  share(k[0], k[1], {0}, 1.0);
  share(k[0], k[2], {1, 2}, 1.0);
  share(k[0], k[3], {3, 4, 5}, 1.0);
  map.update_covisibility(k[0]);
  EXPECT_EQ(names(0), (std::vector{k[3], k[2]}));
  EXPECT_EQ(names(1), (std::vector{k[0]})) << "it has room for one that has none for it";
  // A stronger one pushes the weakest out of a full list.
  share(k[4], k[0], {6, 7, 8, 9}, 1.0);
  map.update_covisibility(k[4]);
  EXPECT_EQ(names(0), (std::vector{k[4], k[3]}));
  EXPECT_EQ(names(4), (std::vector{k[0]}));
  // Who goes is in no list afterwards, though its own did not name them all.
  map.remove_keyframe(k[0]);
  for (int i = 1; i < 5; ++i) EXPECT_TRUE(names(i).empty());
}

}  // namespace
}  // namespace farpoint::slam
