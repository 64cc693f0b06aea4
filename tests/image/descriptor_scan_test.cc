// SPDX-License-Identifier: Apache-2.0
#include "slam/image/descriptor_scan.h"

#include <gtest/gtest.h>

#include <random>

#include "slam/image/descriptor_search.h"

namespace farpoint::slam {
namespace {

constexpr int kWidth_px = 640, kHeight_px = 480, kMaxHamming = 48;
constexpr float kRatio = 0.75F;

class DescriptorScanTest : public testing::Test {
 protected:
  Descriptor any() {
    Descriptor d;
    for (std::uint64_t& word : d.words) word = random_();
    return d;
  }
  // Differs from `d` in this many bits, spread over all words.
  Descriptor near(Descriptor d, int bits) {
    for (int changed = 0; changed < bits;) {
      const auto bit = random_() % 256;
      const std::uint64_t mask = std::uint64_t{1} << (bit % 64);
      if ((marks_[bit / 64] & mask) != 0) continue;
      marks_[bit / 64] |= mask;
      d.words[bit / 64] ^= mask;
      ++changed;
    }
    marks_ = {};
    return d;
  }
  void add(const Descriptor& d, float u_px, float v_px) {
    set.features.push_back({u_px, v_px, 0, 1, 0});
    set.descriptors.push_back(d);
  }
  void add_others(int count) {
    for (int i = 0; i < count; ++i)
      add(any(), static_cast<float>(random_() % kWidth_px), static_cast<float>(random_() % kHeight_px));
  }
  int find(const Descriptor& d) {
    scan.set(set);
    return scan.find(d, kMaxHamming, kRatio);
  }
  FeatureSet set;
  DescriptorScan scan;

 private:
  std::mt19937_64 random_{7};
  std::array<std::uint64_t, 4> marks_{};
};

TEST_F(DescriptorScanTest, FindsWhatTheSearchOfTheWholeWindowFinds) {
  add_others(1300);
  scan.reserve(set.features.size());
  FeatureGrid grid(kWidth_px, kHeight_px, 24, 2000);
  grid.build(set.features);
  DescriptorQuery q;
  q.u_px = kWidth_px / 2.0F, q.v_px = kHeight_px / 2.0F, q.radius_px = 1e6F;
  q.max_hamming = kMaxHamming, q.ratio = kRatio, q.max_level = 7;
  int found = 0, equal = 0;
  for (int i = 0; i < 1300; ++i) {
    q.descriptor = near(set.descriptors[static_cast<std::size_t>(i)], i % 60);
    const int expected = find_descriptor(set, grid, q, [](std::size_t) { return true; });
    equal += find(q.descriptor) == expected ? 1 : 0;
    found += expected >= 0 ? 1 : 0;
  }
  EXPECT_GT(found, 1000);
  // The first word alone misses a few of those at the limit.
  EXPECT_GE(equal, 1300 - 1300 / 50);
}

TEST_F(DescriptorScanTest, RefusesTheBestWhereAnotherIsNearlyAsGood) {
  add_others(200);
  const Descriptor d = any();
  add(near(d, 30), 100, 100);
  EXPECT_EQ(find(d), 200);
  add(near(d, 45), 300, 300);
  EXPECT_EQ(find(d), 200);
  add(near(d, 38), 300, 300);
  EXPECT_EQ(find(d), -1);
}

TEST_F(DescriptorScanTest, CornerAtTheSamePlaceIsNoRival) {
  const Descriptor d = any();
  add(near(d, 20), 100, 100);
  add(near(d, 20), 101, 102);
  EXPECT_GE(find(d), 0);
  add(near(d, 20), 108, 100);
  EXPECT_EQ(find(d), -1);
}

TEST_F(DescriptorScanTest, RefusesWhatDiffersTooMuch) {
  const Descriptor d = any();
  add(near(d, kMaxHamming + 1), 100, 100);
  EXPECT_EQ(find(d), -1);
}

TEST_F(DescriptorScanTest, FindsNothingInAnEmptyImage) {
  EXPECT_EQ(find(any()), -1);
}

TEST_F(DescriptorScanTest, KeepsToTheImageThatItWasGivenLast) {
  add_others(100);
  const Descriptor d = any();
  add(d, 10, 10);
  EXPECT_EQ(find(d), 100);
  set.features.resize(50);
  set.descriptors.resize(50);
  EXPECT_EQ(find(d), -1);
}

}  // namespace
}  // namespace farpoint::slam
