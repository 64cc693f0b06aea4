// SPDX-License-Identifier: Apache-2.0
// KITTI 03 with threads of their own, through the programs: memory, accuracy at the camera's pace,
// repetition.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "ipc/channels.h"
#include "ipc/log.h"
#include "ipc/message.h"
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

// How many features each tracked frame was allowed, by the schedule of the run.
std::vector<int> features_asked(const std::string& log) {
  std::vector<int> asked;
  ipc::LogReader reader(log);
  ipc::LogEvent event;
  while (reader.next(&event)) {
    schedule_t m;
    if (event.channel == ipc::kScheduleChannel && ipc::decode(event.data, &m))
      asked.push_back(m.features_asked);
  }
  return asked;
}

// More images than any machine tracks: the newest win, each costs less, and the run can be repeated all the
// same.
TEST_F(RecordedThreadsOfPrograms, UnderOverloadFramesHaveFewerFeatures) {
  ASSERT_EQ(replay("--speed 200 --output " + out + " --live-trajectory " + work.path("live.tum")), 0);
  EXPECT_TRUE(dropped_frames());
  const std::vector<int> asked = features_asked(out);
  ASSERT_FALSE(asked.empty());
  EXPECT_EQ(asked.front(), 1500);
  EXPECT_EQ(*std::min_element(asked.begin(), asked.end()), 750);
  ASSERT_EQ(replay("--schedule recorded --schedule-log " + out + " --output " + work.path("again.lcm") +
                   " --live-trajectory " + work.path("live2.tum")),
            0);
  EXPECT_EQ(features_asked(work.path("again.lcm")), asked);
  EXPECT_EQ(run("cmp " + work.path("live.tum") + " " + work.path("live2.tum")), 0);
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
