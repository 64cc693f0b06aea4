// SPDX-License-Identifier: Apache-2.0
// Links, lists and the chain stay consistent whatever is done to the map.
#include <gtest/gtest.h>

#include <vector>

#include "tests/map/map_harness.h"

namespace farpoint::slam {
namespace {

TEST(Map, LinksHoldThroughThousandsOfOperations) {
  const CapacityConfig capacity = small_capacity();
  Map map(capacity, two_camera_rig());
  Shaker shaker(&map, 11);
  for (int i = 0; i < 8000; ++i) {
    shaker.step();
    check(map, capacity);
    if (HasFatalFailure() || HasNonfatalFailure()) FAIL() << "after operation " << i;
  }
  // It did what it was meant to do.
  EXPECT_GT(shaker.added, 1000);
  EXPECT_GT(shaker.refused, 100);
  EXPECT_GT(shaker.gone, 100);
  EXPECT_GT(shaker.full, 5);
}

TEST(Map, TheSameOperationsGiveTheSameHandles) {
  std::vector<LandmarkHandle> first, second;
  for (auto* out : {&first, &second}) {
    Map map(small_capacity(), two_camera_rig());
    Shaker shaker(&map, 12);
    for (int i = 0; i < 3000; ++i) shaker.step();
    *out = shaker.handles;
  }
  EXPECT_GT(first.size(), 300U);
  EXPECT_EQ(first, second);
}

}  // namespace
}  // namespace farpoint::slam
