// SPDX-License-Identifier: Apache-2.0
// Half a second to two seconds without images, anywhere in a recording: the way back into the same map.
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

struct Recording {
  std::string name;
  std::string folder;  // below the data folder
  std::string import;  // `farpoint import`, {} stands for the data folder
  double apart_s;      // between gaps of one replay: time to be back, and to be judged
  double first_s;      // of the first gap: the map has settled
};

const Recording kKitti{"kitti03", "kitti", "kitti {}/kitti 03", 7.0, 4.0};
const Recording kEuroc{"euroc", "euroc/MH_01_part", "euroc {}/euroc/MH_01_part", 5.0, 3.0};

struct Sum {
  int places = 0, seen = 0, back = 0, poses = 0, wrong_poses = 0;
  double latest_back_s = 0.0;  // of those within a second

  void add(const GapOutcome& o) {
    ++places;
    poses += o.poses;
    wrong_poses += o.wrong_poses;
    if (!o.tracked_before || !o.seen_before()) return;
    ++seen;
    if (o.back_after_s < 0.0 || o.back_after_s > 1.0) return;
    ++back;
    latest_back_s = std::max(latest_back_s, o.back_after_s);
  }
  // For tests/RESULTS.md.
  void record() const {
    testing::Test::RecordProperty("places", places);
    testing::Test::RecordProperty("seen", seen);
    testing::Test::RecordProperty("back", back);
    record_number("latest_back_s", latest_back_s);
    testing::Test::RecordProperty("poses", poses);
    testing::Test::RecordProperty("wrong_poses", wrong_poses);
  }
};

class RecordedGaps : public testing::TestWithParam<Recording> {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(kData / GetParam().folder))
      GTEST_SKIP() << "no recording " << (kData / GetParam().folder);
    ASSERT_TRUE(import_recording(GetParam().import, log()));
  }
  std::string log() const { return work_.path("run.lcm"); }

  // `places` gaps up to `until_s`.
  Sum measure(int places, double until_s) const {
    const GapExperiment experiment(log(), until_s);
    Sum sum;
    for (const std::vector<Gap>& gaps :
         spread_gaps({GetParam().first_s, experiment.length_s() - kJudged_s, places, GetParam().apart_s})) {
      for (const GapOutcome& o : experiment.run(gaps)) {
        std::printf("%s\n", to_text(o).c_str());
        sum.add(o);
      }
    }
    std::printf(
        "%s: %d places, %d with a view seen before, back within a second at %d of them; %d poses, %d wrong\n",
        GetParam().name.c_str(), sum.places, sum.seen, sum.back, sum.poses, sum.wrong_poses);
    sum.record();
    return sum;
  }

  const Scratch work_;
};

TEST_P(RecordedGaps, EndInTheSameMap) {
  const Sum sum = measure(3, GetParam().first_s + 2.0 * GetParam().apart_s + kJudged_s);
  EXPECT_EQ(sum.places, 3);
  EXPECT_EQ(sum.seen, 3);
  EXPECT_EQ(sum.back, sum.seen);
  EXPECT_EQ(sum.wrong_poses, 0);
}

using RecordedGapsLong = RecordedGaps;

TEST_P(RecordedGapsLong, EndInTheSameMap) {
  const Sum sum = measure(20, std::numeric_limits<double>::infinity());
  EXPECT_EQ(sum.places, 20);
  EXPECT_GE(sum.seen, 15);
  EXPECT_GE(sum.back, 0.8 * sum.seen);
  EXPECT_EQ(sum.wrong_poses, 0);
}

const auto kName = [](const testing::TestParamInfo<Recording>& info) { return info.param.name; };
INSTANTIATE_TEST_SUITE_P(Recordings, RecordedGaps, testing::Values(kKitti, kEuroc), kName);
INSTANTIATE_TEST_SUITE_P(Recordings, RecordedGapsLong, testing::Values(kKitti, kEuroc), kName);

}  // namespace
}  // namespace farpoint::test
