// SPDX-License-Identifier: Apache-2.0
// A simulated world through the programs, in both modes: three seeds of what tools/compare_modes does with
// five.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/ipc/scratch.h"
#include "tests/replay/recordings.h"

namespace farpoint::test {
namespace {

const std::string kFarpoint = (kBin / "farpoint").string();

// Both modes on one seed of the world, 20 s. Holds every seed's condition; returns whether virtual points
// also reach further.
bool virtual_points_reach_further(int seed) {
  const Scratch work;
  const std::string log = work.path("hover.lcm");
  EXPECT_EQ(run(fmt::format("{} simulate hover -o {} --seed {} --duration 20", kFarpoint, log, seed)), 0);
  std::string runs;
  for (const char* mode : {"baseline", "vmp"}) {
    const std::string out = work.path(std::string(mode) + ".lcm");
    EXPECT_EQ(run((kBin / "farpointd").string() + " --replay " + log + " --lockstep --output " + out +
                  " --set camera.use=one --set wheels.use=false --set landmarks.mode=" + mode),
              0);
    runs += " " + out;
  }
  const std::string evaluate = kFarpoint + " evaluate" + runs + " --truth " + log;
  EXPECT_EQ(run(evaluate + " --expect 'vmp.ate <= 1.03 baseline.ate' --expect 'vmp.final.share >= 0.98'"
                           " --expect 'baseline.final.share >= 0.98'"),
            0)
      << "seed " << seed;
  return run(evaluate + " --expect 'vmp.triangulation_depth_m.p90 >= baseline.triangulation_depth_m.p90'") ==
         0;
}

// A drone at 50 to 100 m: all it sees is far, and virtual points are what it is about. With four seeds, 20 s
// each, the error was 0.89 to 0.99 of the baseline's, and the depth that a tenth of the points exceed 0.95,
// 1.03, 1.08 and 1.04 times. One seed alone is within chance; two of three are asked for.
TEST(Worlds, VirtualPointsReachFurtherAndAreNoWorse) {
  int further = 0;
  for (const int seed : {1, 2, 3}) further += virtual_points_reach_further(seed) ? 1 : 0;
  EXPECT_GE(further, 2);
}

}  // namespace
}  // namespace farpoint::test
