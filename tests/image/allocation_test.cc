// SPDX-License-Identifier: Apache-2.0
// build(), extract() and align() allocate nothing once a first frame has passed.
#include <gtest/gtest.h>

#include <vector>

#include "slam/image/extractor.h"
#include "slam/image/feature_grid.h"
#include "slam/image/pyramid.h"
#include "tests/image/test_images.h"
#include "tests/ipc/allocations.h"

namespace farpoint::slam {
namespace {

TEST(Allocation, TheCounterCounts) {
  if (!test::counts_allocations()) GTEST_SKIP() << "a sanitizer owns the heap";
  const auto before = test::allocations();
  auto* p = new std::vector<int>(100);
  EXPECT_EQ(test::allocations() - before, 2U);
  delete p;
}

TEST(Allocation, NoneAfterTheFirstFrame) {
  if (!test::counts_allocations()) GTEST_SKIP() << "a sanitizer owns the heap";
  // From a poor image to a rich one: capacities must not depend on what came before.
  const testing::OwnedImage poor = testing::rectangles(500, 300, 20, 1),
                            rich = testing::random_image(500, 300, 2);
  Pyramid pyramid(500, 300, {});
  Extractor extractor(500, 300, {}, {.features = 2000});
  FeatureGrid grid(500, 300, 32, 2000);
  FeatureSet set;
  pyramid.build(poor.view());
  extractor.extract(pyramid, {}, &set);
  const PyramidImage frame(&pyramid);

  const auto before = test::allocations();
  pyramid.build(rich.view());
  extractor.extract(pyramid, {}, &set);
  grid.build(set.features);
  int found = 0, aligned = 0;
  grid.visit_near(set.features, 100, 100, 50, 0, 7, [&](std::size_t) { ++found; });
  for (std::size_t i = 0; i < set.features.size(); ++i) {
    Patch patch;
    if (!frame.extract_patch(set, i, &patch)) continue;
    aligned +=
        frame.align(patch, Eigen::Matrix2f::Identity(), {set.features[i].u_px, set.features[i].v_px}, 3).ok;
  }
  EXPECT_EQ(test::allocations() - before, 0U);
  EXPECT_EQ(set.features.size(), 2000U);
  EXPECT_GT(found, 0);
  EXPECT_GT(aligned, 500);
}

}  // namespace
}  // namespace farpoint::slam
