// SPDX-License-Identifier: Apache-2.0
// farpointd live with real threads, on a log as its camera and a bus that the test plays.
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <thread>

#include "ipc/message.h"
#include "tests/daemon/synthetic_log.h"
#include "tests/ipc/log_events.h"
#include "tests/live/live_program.h"

namespace farpoint::test {
namespace {

class FileCamera : public testing::Test {
 protected:
  FileCamera() {
    SyntheticLog log;
    log.period_us = 50'000;
    write_synthetic_log(program_.path("film.lcm"), log);
  }
  void start(const std::vector<std::string>& arguments = {}, const std::string& device = "film.lcm",
             const std::string& calibration = "log") {
    program_.start({"camera.driver=file", "camera.device=" + program_.path(device),
                    "camera.calibration=" + calibration, "camera.rate_hz=20"},
                   arguments);
  }
  [[nodiscard]] int valid_epochs() const {
    int valid = 0;
    for (const LiveProgram::Epoch& epoch : program_.epochs()) valid += epoch.pose_valid ? 1 : 0;
    return valid;
  }
  // Until it has tracked for a while.
  [[nodiscard]] bool tracks() {
    return program_.run_until([this] { return valid_epochs() >= 20; });
  }
  [[nodiscard]] int fed_between(double from_s, double to_s) const {
    int fed = 0;
    for (const double time_s : program_.fed_s()) fed += time_s > from_s && time_s < to_s ? 1 : 0;
    return fed;
  }
  static double now_s() {
    timespec t{};
    clock_gettime(CLOCK_MONOTONIC, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
  }

  LiveProgram program_;
};

TEST_F(FileCamera, TheBusTellsStartTrackingAndTheEnd) {
  start();
  ASSERT_TRUE(tracks()) << program_.said();
  EXPECT_EQ(program_.stop(SIGTERM), 0) << program_.said();
  const auto& epochs = program_.epochs();
  EXPECT_EQ(epochs.front().state, int{status_t::STATE_STARTING});
  EXPECT_EQ(epochs.back().state, int{status_t::STATE_STOPPED});
  EXPECT_FALSE(epochs.back().pose_valid);
  for (const LiveProgram::Epoch& epoch : epochs) {
    EXPECT_EQ(epoch.boot_counter, 1.0);
    if (epoch.pose_valid) {
      EXPECT_LE(epoch.age_s, 0.2501);
    }
  }
  EXPECT_NE(program_.said().find("stopped by signal 15"), std::string::npos);
}

TEST_F(FileCamera, AHeldTrackingThreadIsNotFedAndNoPoseIsValidMeanwhile) {
  start();
  ASSERT_TRUE(tracks()) << program_.said();
  program_.hold("fp-tracking");
  const double from_s = now_s();
  program_.run_for(2.0);
  const double to_s = now_s();
  program_.release();
  const std::size_t epochs = program_.epochs().size();
  EXPECT_TRUE(program_.run_until([&] { return program_.epochs().size() > epochs + 20; }));
  // Its limit, watchdog.tracking_s, is 0.5 s.
  EXPECT_EQ(fed_between(from_s + 0.9, to_s), 0);
  EXPECT_GE(fed_between(from_s - 2.0, from_s), 2);
  int meanwhile = 0;
  for (const LiveProgram::Epoch& epoch : program_.epochs()) {
    if (epoch.time_s < from_s + 0.4 || epoch.time_s > to_s) continue;
    ++meanwhile;
    EXPECT_FALSE(epoch.pose_valid);
  }
  EXPECT_GE(meanwhile, 20);
  EXPECT_EQ(program_.stop(SIGTERM), 0) << program_.said();
}

TEST_F(FileCamera, WhatAKilledRunRecordedIsFinishedAtTheNextStart) {
  start({"--record", program_.path("run.lcm")});
  ASSERT_TRUE(tracks()) << program_.said();
  EXPECT_EQ(program_.stop(SIGKILL), -SIGKILL);
  EXPECT_FALSE(std::filesystem::exists(program_.path("run.lcm")));
  start({"--record", program_.path("run.lcm")});
  const std::string recovered = program_.path("run-recovered-1.lcm");
  EXPECT_TRUE(program_.run_until([&] { return std::filesystem::exists(recovered); })) << program_.said();
  program_.run_for(0.5);
  EXPECT_EQ(program_.stop(SIGTERM), 0) << program_.said();
  EXPECT_GE(messages_of<image_t>(recovered, "CAMERA_0").size(), 10U);
  EXPECT_GE(messages_of<image_t>(program_.path("run.lcm"), "CAMERA_0").size(), 1U);
  EXPECT_NE(program_.said().find("recording of a run that was killed, kept as " + recovered),
            std::string::npos)
      << program_.said();
  // The boot counter shows the restart.
  EXPECT_EQ(program_.epochs().back().boot_counter, 2.0);
}

TEST_F(FileCamera, ARingOfRecordingsStaysBelowItsSize) {
  start({"--record", program_.path("run.lcm"), "--set", "record.max_size_mb=2"});
  // About 150 kB an image, so that each file holds one.
  EXPECT_TRUE(program_.run_until([this] { return std::filesystem::exists(program_.path("run-000030.lcm")); }))
      << program_.said();
  EXPECT_EQ(program_.stop(SIGTERM), 0) << program_.said();
  std::uintmax_t bytes = 0;
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(program_.path("."))) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with("run-")) continue;
    ++files;
    bytes += entry.file_size();
    EXPECT_EQ(messages_of<image_t>(entry.path().string(), "CAMERA_0").size(), 1U) << name;
    EXPECT_EQ(messages_of<calibration_t>(entry.path().string(), "CALIBRATION").size(), 1U) << name;
  }
  EXPECT_GE(files, 10);
  EXPECT_LE(bytes, 2'000'000U);
}

// A pipe blocks its reader's open until a writer comes.
TEST_F(FileCamera, ACameraThatHangsWhileItOpensIsNoHangOfTheDaemon) {
  ASSERT_EQ(mkfifo(program_.path("pipe").c_str(), 0600), 0);
  std::ofstream(program_.path("camera.yaml")) << "model: pinhole-radtan\nwidth_px: 480\nheight_px: 320\n"
                                                 "fx_px: 400\nfy_px: 400\ncx_px: 240\ncy_px: 160\n"
                                                 "distortion: []\nrate_hz: 20\n";
  start({}, "pipe", program_.path("camera.yaml"));
  ASSERT_TRUE(program_.run_until([this] { return !program_.epochs().empty(); })) << program_.said();
  const double from_s = now_s();
  program_.run_for(2.5);
  EXPECT_GE(fed_between(from_s, now_s()), 5) << program_.said();
  EXPECT_TRUE(program_.run_until([this] {
    return program_.said().find("opening or closing it has taken") != std::string::npos;
  })) << program_.said();
  EXPECT_EQ(program_.epochs().back().state, int{status_t::STATE_NO_CAMERA});
  (void)std::signal(SIGPIPE, SIG_IGN);  // the program is killed while it reads
  std::thread writer([this] {
    const std::vector<std::uint8_t> film = read_bytes(program_.path("film.lcm"));
    std::ofstream pipe(program_.path("pipe"), std::ios::binary);
    pipe.write(reinterpret_cast<const char*>(film.data()), static_cast<std::streamsize>(film.size()));
  });
  EXPECT_TRUE(program_.run_until([this] { return valid_epochs() >= 5; })) << program_.said();
  (void)program_.stop(SIGKILL);
  writer.join();
}

}  // namespace
}  // namespace farpoint::test
