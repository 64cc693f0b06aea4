// SPDX-License-Identifier: Apache-2.0
// Recordings on disks that are full, after a kill, and as a ring.
#include "daemon/input/recording.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <set>
#include <thread>

#include "tests/daemon/synthetic_log.h"
#include "tests/ipc/log_events.h"
#include "tests/ipc/scratch.h"
#include "tests/support/file_size_limit.h"

namespace farpoint::daemon {
namespace {

constexpr const char* kChannel = "CAMERA_0";
using Bytes = std::vector<std::uint8_t>;

class RecordingTest : public testing::Test {
 protected:
  [[nodiscard]] std::unique_ptr<Recording> begin() const {
    return std::make_unique<Recording>(path_, limits_, test::synthetic_calibration());
  }
  // Images of 10 kB, `period_us` apart. Returns how many were stored.
  int write(Recording* recording, int images, std::int64_t period_us = 50'000) {
    int stored = 0;
    for (int i = 0; i < images; ++i)
      stored += recording->write(kChannel, utime_ += period_us, Bytes(10'000, 7)) ? 1 : 0;
    return stored;
  }
  static void tidy(Recording* recording) {
    while (recording->tidy()) continue;
  }
  // Names in the folder.
  [[nodiscard]] std::set<std::string> names() const {
    std::set<std::string> found;
    for (const auto& entry : std::filesystem::directory_iterator(scratch_.path(".")))
      found.insert(entry.path().filename().string());
    return found;
  }
  // Images of a log that begins with its calibration and has no damage.
  static int images_of(const std::string& path) {
    ipc::LogReader reader(path);
    ipc::LogEvent event;
    int images = 0;
    for (int i = 0; reader.next(&event); ++i) {
      EXPECT_EQ(event.channel == ipc::kCalibrationChannel, i == 0) << path;
      images += event.channel == kChannel ? 1 : 0;
    }
    EXPECT_EQ(reader.damage().places, 0U) << path;
    return images;
  }
  // A process that records N images and is killed.
  void be_killed_after(int images) {
    const pid_t child = fork();
    if (child == 0) {
      const auto recording = begin();
      write(recording.get(), images);
      raise(SIGKILL);
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status));
  }
  [[nodiscard]] std::string only_part() const {
    for (const std::string& name : names())
      if (name.find(".part") != std::string::npos) return scratch_.path(name);
    return {};
  }

  const test::Scratch scratch_;
  const std::string path_ = scratch_.path("run.lcm");
  RecordConfig limits_;
  std::int64_t utime_ = 1'000'000;
};

TEST_F(RecordingTest, AFullDiskKeepsWhatWasWrittenAndTheRecordingGoesOnOnceThereIsRoom) {
  auto recording = begin();
  {
    const test::FileSizeLimit full(100'000);
    EXPECT_EQ(write(recording.get(), 20), 9);
    EXPECT_EQ(recording->problem(), "File too large");
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(600));
  EXPECT_EQ(write(recording.get(), 5), 5);
  EXPECT_EQ(recording->close(), "File too large");
  EXPECT_EQ(names(), std::set<std::string>{"run.lcm"});
  EXPECT_EQ(images_of(path_), 14);
  EXPECT_EQ(recording->files(), std::vector{path_});
}

TEST_F(RecordingTest, ARecordingThatIsNotClosedIsKeptToo) {
  write(begin().get(), 3);
  EXPECT_EQ(images_of(path_), 3);
}

TEST_F(RecordingTest, WhatAKilledRunLeftIsCutAfterItsLastWholeEventAndKept) {
  be_killed_after(7);
  const std::string part = only_part();
  ASSERT_FALSE(part.empty());
  std::ofstream(part, std::ios::app | std::ios::binary) << "\xED\xA1\xDA\x01 half an event";
  auto recording = begin();
  tidy(recording.get());
  EXPECT_EQ(images_of(scratch_.path("run-recovered-1.lcm")), 7);
  write(recording.get(), 2);
  EXPECT_EQ(recording->close(), "");
  EXPECT_EQ(images_of(path_), 2);
  EXPECT_EQ(names(), (std::set<std::string>{"run-recovered-1.lcm", "run.lcm"}));
}

TEST_F(RecordingTest, NothingIsOverwrittenByWhatKilledRunsLeft) {
  std::ofstream(path_) << "an older recording";
  std::ofstream(scratch_.path("run-recovered-1.lcm")) << "another";
  std::ofstream(scratch_.path("other.lcm.part99999999")) << "of another name";
  be_killed_after(4);
  be_killed_after(5);
  // The second killed run did not live long enough to finish what the first left.
  auto recording = begin();
  tidy(recording.get());
  EXPECT_EQ(test::read_bytes(path_).size(), 18U);  // until close()
  EXPECT_EQ(test::read_bytes(scratch_.path("run-recovered-1.lcm")).size(), 7U);
  EXPECT_EQ(images_of(scratch_.path("run-recovered-2.lcm")) + images_of(scratch_.path("run-recovered-3.lcm")),
            9);
  EXPECT_TRUE(names().contains("other.lcm.part99999999"));
}

TEST_F(RecordingTest, APartThatAnotherProcessWritesIsLeftAlone) {
  const pid_t other = fork();
  if (other == 0) {
    const auto recording = begin();
    write(recording.get(), 3);
    for (;;) pause();
  }
  const auto size = [this] {
    std::error_code error;
    const std::string part = only_part();
    return part.empty() ? 0 : std::filesystem::file_size(part, error);
  };
  for (int i = 0; i < 5000 && size() < 30'000; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  const std::string part = only_part();
  auto recording = begin();
  tidy(recording.get());
  EXPECT_TRUE(std::filesystem::exists(part));
  EXPECT_EQ(names().size(), 2U);
  kill(other, SIGKILL);
  waitpid(other, nullptr, 0);
}

// In a container each start may have the same number.
TEST_F(RecordingTest, APartOfAKilledRunWithTheSameProcessNumberIsKeptToo) {
  be_killed_after(6);
  std::filesystem::rename(only_part(), path_ + ".part" + std::to_string(getpid()));
  auto recording = begin();
  tidy(recording.get());
  EXPECT_EQ(images_of(scratch_.path("run-recovered-1.lcm")), 6);
}

TEST_F(RecordingTest, ARingOfASizeKeepsTheNewestInNumberedFilesThatReplayByThemselves) {
  limits_.max_size_mb = 1;
  auto recording = begin();
  EXPECT_EQ(write(recording.get(), 500), 500);
  EXPECT_EQ(recording->close(), "");
  std::uint64_t bytes = 0;
  int images = 0;
  for (const std::string& file : recording->files()) {
    bytes += std::filesystem::file_size(file);
    EXPECT_LE(std::filesystem::file_size(file), 100'000U);
    images += images_of(file);
  }
  EXPECT_EQ(recording->files().size(), names().size());
  EXPECT_LE(bytes, 1'000'000U);
  EXPECT_GE(images, 80);
  // The newest is there.
  const auto newest = recording->files().back();
  EXPECT_EQ(newest, scratch_.path("run-000056.lcm"));
  ipc::LogReader reader(newest);
  ipc::LogEvent event;
  std::int64_t last = 0;
  while (reader.next(&event)) last = event.timestamp_us;
  EXPECT_EQ(last, utime_);
}

TEST_F(RecordingTest, ARingGoesOnAfterARestartAndRemovesTheOldestOfItsOwnNameOnly) {
  limits_.max_size_mb = 1;
  for (const char* name :
       {"run.lcm", "running-000001.lcm", "run-1.lcm", "run-000001.txt", "run-000001.lcm.bak"})
    std::ofstream(scratch_.path(name)) << "not of the ring";
  write(begin().get(), 60);  // seven files
  ASSERT_TRUE(names().contains("run-000001.lcm"));
  be_killed_after(12);
  auto recording = begin();
  tidy(recording.get());
  EXPECT_EQ(images_of(scratch_.path("run-000009.lcm")), 3);  // of the killed run, under its own number
  write(recording.get(), 40);
  EXPECT_FALSE(names().contains("run-000001.lcm"));
  EXPECT_EQ(images_of(scratch_.path("run-000010.lcm")), 9);
  for (const char* name :
       {"run.lcm", "running-000001.lcm", "run-1.lcm", "run-000001.txt", "run-000001.lcm.bak"})
    EXPECT_TRUE(names().contains(name)) << name;
}

TEST_F(RecordingTest, ARingOfMinutesCountsWhatEarlierRunsLeft) {
  limits_.max_minutes = 1.0;
  write(begin().get(), 50, 1'000'000);  // 50 s in files of 6 s
  const auto before = names();
  auto recording = begin();
  tidy(recording.get());
  write(recording.get(), 30, 1'000'000);
  EXPECT_EQ(recording->close(), "");
  double seconds = 0;
  for (const std::string& name : names()) {
    ipc::EventWalk walk(scratch_.path(name));
    while (walk.step(1000)) continue;
    seconds += 1e-6 * static_cast<double>(walk.duration_us());
  }
  EXPECT_LE(seconds, 60.0);
  EXPECT_GE(seconds, 48.0);
  EXPECT_FALSE(names().contains(*before.begin()));
}

TEST_F(RecordingTest, ARunWithoutAnImageLeavesNoFileInTheRing) {
  limits_.max_size_mb = 1;
  EXPECT_EQ(begin()->close(), "");
  EXPECT_TRUE(names().empty());
}

TEST_F(RecordingTest, AShareOfTheDiskStaysFree) {
  limits_.max_size_mb = 1;  // files of 0.1 MB
  limits_.min_free_share = 0.1;
  auto recording = begin();
  double free_share = 0.5;
  recording->take_free_share_from([&] { return free_share; });
  EXPECT_EQ(write(recording.get(), 40), 40);
  const std::size_t files = names().size();
  free_share = 0.05;
  EXPECT_EQ(write(recording.get(), 2), 2);
  EXPECT_EQ(names().size(), files - 2);
  EXPECT_EQ(write(recording.get(), 50), static_cast<int>(files) - 3);  // none is left to remove
  EXPECT_EQ(recording->problem(), "less of the disk is free than record.min_free_share");
  EXPECT_EQ(names().size(), 1U);
}

// On a disk of 1 MB, in a mount namespace of its own.
TEST_F(RecordingTest, OnAFullDiskARingGivesUpItsOldestFilesAndStoresEveryImage) {
  constexpr int kNoMount = 77;
  limits_.max_size_mb = 2;
  const pid_t child = fork();
  if (child == 0) {
    if (unshare(CLONE_NEWNS) != 0 || mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
        mount("none", scratch_.path(".").c_str(), "tmpfs", 0, "size=1m") != 0)
      _exit(kNoMount);
    const auto recording = begin();
    _exit(write(recording.get(), 250) == 250 && recording->files().size() < 6 ? 0 : 1);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  if (WIFEXITED(status) && WEXITSTATUS(status) == kNoMount) GTEST_SKIP() << "no privilege to mount";
  EXPECT_EQ(status, 0);
}

TEST_F(RecordingTest, AFolderThatIsMissingIsSaidAtOnce) {
  EXPECT_THROW(Recording(scratch_.path("absent/run.lcm"), {}, test::synthetic_calibration()),
               std::runtime_error);
  limits_.max_size_mb = 5;
  EXPECT_THROW(Recording(scratch_.path("absent/run.lcm"), limits_, test::synthetic_calibration()),
               std::runtime_error);
}

}  // namespace
}  // namespace farpoint::daemon
