// SPDX-License-Identifier: Apache-2.0
#include "slam/map/observation_room.h"

#include <gtest/gtest.h>

#include <memory_resource>
#include <vector>

#include "tests/map/map_fixture.h"

namespace farpoint::slam {
namespace {

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
