// SPDX-License-Identifier: Apache-2.0
// A simulated world through the programs, in both modes: one seed of what tools/compare_modes does with five.
#include <gtest/gtest.h>

#include <string>

#include "tests/ipc/scratch.h"
#include "tests/replay/recordings.h"

namespace farpoint::test {
namespace {

// A drone at 50 to 100 m: all it sees is far, and virtual points are what it is about. With five seeds, 40 s
// each, the error was 0.77 to 0.97 of the baseline's.
TEST(Worlds, VirtualPointsReachFurtherAndAreNoWorse) {
  const Scratch work;
  const std::string farpoint = (kBin / "farpoint").string(), log = work.path("hover.lcm");
  ASSERT_EQ(run(farpoint + " simulate hover -o " + log + " --seed 1 --duration 20"), 0);
  std::string runs;
  for (const char* mode : {"baseline", "vmp"}) {
    const std::string out = work.path(std::string(mode) + ".lcm");
    ASSERT_EQ(run((kBin / "farpointd").string() + " --replay " + log + " --lockstep --output " + out +
                  " --set landmarks.mode=" + mode),
              0);
    runs += " " + out;
  }
  EXPECT_EQ(run(farpoint + " evaluate" + runs + " --truth " + log +
                " --expect 'vmp.ate <= 1.03 baseline.ate' --expect 'vmp.triangulation_depth_m.p90 >= "
                "baseline.triangulation_depth_m.p90'"
                " --expect 'vmp.final.share >= 0.98' --expect 'baseline.final.share >= 0.98'"),
            0);
}

}  // namespace
}  // namespace farpoint::test
