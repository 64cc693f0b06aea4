// SPDX-License-Identifier: Apache-2.0
// Half a second to three seconds without images: odometry keeps the motion, or the reset counter rises.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

#include "tests/ipc/scratch.h"
#include "tests/replay/gaps.h"
#include "tests/replay/recordings.h"
#include "tests/support/record.h"

namespace farpoint::test {
namespace {

struct Source {
  std::string name;
  std::string folder;   // below the data folder; empty: a simulated world
  std::string command;  // of `farpoint`, {} stands for the data folder
  double apart_s;       // between gaps of one replay
  double first_s;       // of the first gap: the map has settled
  int gaps;             // of the long form
};

const Source kKitti{"kitti03", "kitti", "import kitti {}/kitti 03", 8.0, 4.0, 18};
const Source kEuroc{"euroc", "euroc/MH_01_part", "import euroc {}/euroc/MH_01_part", 7.0, 3.0, 16};
const Source kTown{"town", "", "simulate town --seed 1 --duration 40", 8.0, 5.0, 16};
const std::vector<double> kLengths_s = {0.5, 1.0, 1.5, 2.0, 3.0}, kShort_s = {1.5};

struct Sum {
  int judged = 0, kept = 0, resets = 0;
  double worst_m = 0.0;  // of those without a reset

  void add(const OdometryOverGap& o) {
    if (!o.judged) return;
    ++judged;
    kept += o.kept() ? 1 : 0;
    resets += o.reset ? 1 : 0;
    if (!o.reset) worst_m = std::max(worst_m, o.error_m);
  }
  // For tests/RESULTS.md.
  void record() const {
    testing::Test::RecordProperty("judged", judged);
    testing::Test::RecordProperty("kept", kept);
    testing::Test::RecordProperty("resets", resets);
    record_number("worst_m", worst_m);
  }
};

class RecordedOdometryGaps : public testing::TestWithParam<Source> {
 protected:
  void SetUp() override {
    if (!GetParam().folder.empty() && !std::filesystem::exists(kData / GetParam().folder))
      GTEST_SKIP() << "no recording " << (kData / GetParam().folder);
    ASSERT_EQ(run((kBin / "farpoint").string() + " " + with_data(GetParam().command) + " -o " + log()), 0);
  }
  [[nodiscard]] std::string log() const { return work_.path("run.lcm"); }

  [[nodiscard]] Sum measure(int gaps, const std::vector<double>& lengths_s, double until_s) const {
    const GapExperiment experiment(log(), until_s);
    // Time to be back after the last one.
    const double last_s = experiment.length_s() - lengths_s.back() - kJudged_s;
    Sum sum;
    for (const std::vector<Gap>& of_replay :
         spread_gaps({GetParam().first_s, last_s, gaps, GetParam().apart_s, lengths_s}))
      for (const GapOutcome& o : experiment.run(of_replay)) {
        std::printf("%s %s\n", GetParam().name.c_str(), odometry_to_text(o).c_str());
        sum.add(o.odometry);
      }
    std::printf("%s: %d of %d gaps kept, the counter rose at %d, worst error without that %.3f m\n",
                GetParam().name.c_str(), sum.kept, sum.judged, sum.resets, sum.worst_m);
    testing::Test::RecordProperty("gaps", gaps);
    sum.record();
    return sum;
  }

  const Scratch work_;
};

TEST_P(RecordedOdometryGaps, MotionIsKeptOrTheCounterRises) {
  const Sum sum = measure(2, kShort_s, GetParam().first_s + 12.0);
  EXPECT_EQ(sum.judged, 2);
  EXPECT_EQ(sum.kept, sum.judged);
}

// Houses of the simulated town look alike. At these two gaps a pose among other houses has 30 and 42 inliers.
TEST(OdometryGapsInTown, AnotherStreetIsNotTakenForTheOldOne) {
  const Scratch work;
  ASSERT_EQ(
      run((kBin / "farpoint").string() + " simulate town --seed 1 --duration 30 -o " + work.path("run.lcm")),
      0);
  const GapExperiment experiment(work.path("run.lcm"), 30.0);
  const std::vector<std::vector<Gap>> replays = {{{GapKind::kMissing, 16.56, 2.0}},
                                                 {{GapKind::kBlack, 22.34, 3.0}}};
  for (const std::vector<Gap>& gaps : replays)
    for (const GapOutcome& o : experiment.run(gaps)) {
      EXPECT_TRUE(o.odometry.judged);
      EXPECT_TRUE(o.odometry.kept()) << odometry_to_text(o);
    }
}

using RecordedOdometryGapsLong = RecordedOdometryGaps;

TEST_P(RecordedOdometryGapsLong, MotionIsKeptOrTheCounterRises) {
  const Sum sum = measure(GetParam().gaps, kLengths_s, std::numeric_limits<double>::infinity());
  EXPECT_EQ(sum.judged, GetParam().gaps);
  EXPECT_EQ(sum.kept, sum.judged);
  // A counter that rises at every gap keeps nothing.
  EXPECT_LE(sum.resets, sum.judged / 2);
}

const auto kName = [](const testing::TestParamInfo<Source>& info) { return info.param.name; };
INSTANTIATE_TEST_SUITE_P(Recordings, RecordedOdometryGaps, testing::Values(kKitti, kEuroc), kName);
INSTANTIATE_TEST_SUITE_P(Recordings, RecordedOdometryGapsLong, testing::Values(kKitti, kEuroc, kTown), kName);

}  // namespace
}  // namespace farpoint::test
