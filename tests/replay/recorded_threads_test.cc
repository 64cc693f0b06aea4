// KITTI 03 with threads of their own, through the programs: memory, accuracy at the camera's pace,
// repetition.
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "tests/ipc/scratch.h"
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
    ASSERT_TRUE(import_recording("kitti {}/kitti 03", log));
  }
  // farpointd's status; its last line goes to `said`. The others are shell commands around it.
  [[nodiscard]] int replay(const std::string& arguments, const std::string& before = "",
                           const std::string& afterwards = "") {
    return run(before + (kBin / "farpointd").string() + " --replay " + log + " " + arguments + " > " + said +
               "; status=$?; " + afterwards + "exit $status");
  }
  [[nodiscard]] int evaluate(const std::string& conditions) {
    return run(farpoint + " evaluate " + out + " --truth " + log + conditions);
  }
  [[nodiscard]] bool dropped_frames() { return run("grep dropped " + said) == 0; }

  Scratch work;
  std::string farpoint = (kBin / "farpoint").string();
  std::string log = work.path("recording.lcm"), out = work.path("out.lcm"), said = work.path("said.txt");
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
    ASSERT_EQ(replay("--speed 1 --output " + out, load, "kill $load; "), 0);
    EXPECT_FALSE(dropped_frames()) << "run " << i;
    EXPECT_EQ(evaluate(kConditions), 0) << "run " << i;
  }
}

TEST_F(RecordedThreadsLong, ARecordedScheduleRepeatsTheRun) {
  const std::string files =
      " --trajectory " + work.path("final.tum") + " --live-trajectory " + work.path("live.tum");
  const std::string again =
      " --trajectory " + work.path("final2.tum") + " --live-trajectory " + work.path("live2.tum");
  ASSERT_EQ(replay("--speed 1 --output " + out + files), 0);
  ASSERT_EQ(
      replay("--schedule recorded --schedule-log " + out + " --output " + work.path("again.lcm") + again), 0);
  EXPECT_EQ(run("cmp " + work.path("final.tum") + " " + work.path("final2.tum")), 0);
  EXPECT_EQ(run("cmp " + work.path("live.tum") + " " + work.path("live2.tum")), 0);
}

}  // namespace
}  // namespace farpoint::test
