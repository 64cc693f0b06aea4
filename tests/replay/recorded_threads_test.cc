// KITTI 03 with threads of their own, through the programs: memory, accuracy at the camera's pace,
// repetition.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <vector>

#include "tests/replay/recordings.h"

namespace farpoint::test {
namespace {

const std::string kConditions =
    " --expect 'out.final.ate_rmse_m <= 0.95' --expect 'out.final.share >= 0.98' --expect 'out.live.share >= "
    "0.97'"
    " --expect 'out.peak_resident_mb <= 200' --expect 'out.resets == 1'";

class RecordedThreadsOfPrograms : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(kData / "kitti")) GTEST_SKIP() << "no recording " << (kData / "kitti");
    ASSERT_EQ(run(farpoint + with_data(" import kitti {}/kitti 03 -o ") + log), 0);
  }
  // farpointd's status; its last line goes to `said`.
  [[nodiscard]] int replay(const std::string& arguments) {
    return run((kBin / "farpointd").string() + " --replay " + log + " " + arguments + " > " + said);
  }
  [[nodiscard]] int evaluate(const std::string& conditions) {
    return run(farpoint + " evaluate " + out + " --truth " + log + conditions);
  }
  [[nodiscard]] bool dropped_frames() { return run("grep dropped " + said) == 0; }

  WorkFolder work{"recorded_threads"};
  std::string farpoint = (kBin / "farpoint").string();
  std::string log = work.file("recording.lcm"), out = work.file("out.lcm"), said = work.file("said.txt");
};

// Mapping on a loaded machine may be behind at this pace: the poses are another test's matter.
TEST_F(RecordedThreadsOfPrograms, StayWithinTheirMemory) {
  ASSERT_EQ(replay("--speed 2 --output " + out), 0);
  EXPECT_EQ(evaluate(" --expect 'out.peak_resident_mb <= 200'"), 0);
}

// The long form: at the camera's pace, on an idle machine and with every core loaded at normal priority.
class RecordedThreadsLong : public RecordedThreadsOfPrograms {};

TEST_F(RecordedThreadsLong, FiveRunsHoldTheAccuracy) {
  for (int i = 0; i < 5; ++i) {
    ASSERT_EQ(replay("--speed 1 --output " + out), 0);
    EXPECT_FALSE(dropped_frames()) << "run " << i;
    EXPECT_EQ(evaluate(kConditions), 0) << "run " << i;
  }
}

TEST_F(RecordedThreadsLong, ALoadedCoreChangesNothing) {
  const std::string load = "timeout 400 sh -c 'while :; do :; done' & load=$!; ";
  for (int i = 0; i < 5; ++i) {
    const std::string command = load + (kBin / "farpointd").string() + " --replay " + log +
                                " --speed 1 --output " + out + " > " + said +
                                "; status=$?; kill $load; exit $status";
    ASSERT_EQ(run(command), 0);
    EXPECT_FALSE(dropped_frames()) << "run " << i;
    EXPECT_EQ(evaluate(kConditions), 0) << "run " << i;
  }
}

TEST_F(RecordedThreadsLong, ARecordedScheduleRepeatsTheRun) {
  const std::string files =
      " --trajectory " + work.file("final.tum") + " --live-trajectory " + work.file("live.tum");
  const std::string again =
      " --trajectory " + work.file("final2.tum") + " --live-trajectory " + work.file("live2.tum");
  ASSERT_EQ(replay("--speed 1 --output " + out + files), 0);
  ASSERT_EQ(
      replay("--schedule recorded --schedule-log " + out + " --output " + work.file("again.lcm") + again), 0);
  EXPECT_EQ(run("cmp " + work.file("final.tum") + " " + work.file("final2.tum")), 0);
  EXPECT_EQ(run("cmp " + work.file("live.tum") + " " + work.file("live2.tum")), 0);
}

}  // namespace
}  // namespace farpoint::test
