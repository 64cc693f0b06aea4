// SPDX-License-Identifier: Apache-2.0
// What tests of the map share: checks of every link, random operations, and a map to be filled by hand.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "tests/map/map_fixture.h"

namespace farpoint::slam {

inline constexpr int kFeatures = 40;  // of a keyframe

// 14 keyframes, 120 landmarks, 6 observations a landmark: full soon.
CapacityConfig small_capacity();

// Fails the running test where a link, a list or a value of the map is inconsistent.
void check(const Map& map, const CapacityConfig& capacity);

void expect_same_pose(const SE3& a, const SE3& b);

// Random use of every operation that changes links. Either camera gives an image, or both.
class Shaker {
 public:
  Shaker(Map* map, std::uint64_t seed) : map_(*map), random_(seed) {}

  void step();

  int added = 0, refused = 0, gone = 0, full = 0;
  std::vector<LandmarkHandle> handles;  // every one ever given

 private:
  void add_keyframe();
  void remove_keyframe(KeyframeHandle k);
  void add_landmark(Observer by);
  void add_observation(LandmarkHandle l, Observer by);
  void remove_observation(LandmarkHandle h);

  Map& map_;
  Random random_;
  std::int64_t utime_ = 0;
};

class MapTest : public testing::Test {
 protected:
  KeyframeHandle keyframe(int camera = 0) {
    return map.add_keyframe(make_keyframe(rig, camera, random_pose(&random), kFeatures, &random));
  }
  // Seen by all of `keyframes` at the feature of that number; the first is the host.
  LandmarkHandle landmark(const std::vector<KeyframeHandle>& keyframes, std::size_t feature,
                          double rho = 0.1) {
    const LandmarkHandle h = add_landmark(&map, keyframes[0], feature);
    EXPECT_FALSE(h.is_null());
    map.landmarks()[h].state = LandmarkState::kFull;
    map.landmarks()[h].inverse_depth = rho;
    for (std::size_t i = 1; i < keyframes.size(); ++i)
      EXPECT_TRUE(map.add_observation(h, sighting(map, keyframes[i], feature)));
    return h;
  }
  std::vector<KeyframeHandle> keyframes(int n) {
    std::vector<KeyframeHandle> out(static_cast<std::size_t>(n));
    for (int i = 0; i < n; ++i) out[static_cast<std::size_t>(i)] = keyframe(i % 2);
    return out;
  }
  std::vector<std::uint64_t> observers(LandmarkHandle h) {
    std::vector<std::uint64_t> ids;
    for (const Observation& o : map.landmarks()[h].observations)
      ids.push_back(map.keyframes()[o.keyframe].id);
    return ids;
  }

  KeyframeView& view(KeyframeHandle h) { return map.keyframes()[h].views[camera_of(map.keyframes()[h])]; }
  bool remove_observation(LandmarkHandle h, KeyframeHandle k) {
    return map.remove_observation(h, k, camera_of(map.keyframes()[k]));
  }

  Rig rig = two_camera_rig();
  CapacityConfig capacity = small_capacity();
  Map map{capacity, rig};
  Random random{5};
};

}  // namespace farpoint::slam
