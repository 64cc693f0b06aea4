// SPDX-License-Identifier: Apache-2.0
// The whole daemon by replay: what goes in wrong, what comes out, and that it comes out the same.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <numbers>
#include <set>
#include <sstream>

#include "ipc/candump.h"
#include "ipc/channels.h"
#include "ipc/log.h"
#include "slam/geometry/se3.h"
#include "tests/daemon/run_daemon.h"
#include "tests/daemon/synthetic_log.h"
#include "tests/ipc/dbc.h"
#include "tests/ipc/scratch.h"
#include "tests/support/paths.h"

namespace farpoint::daemon {
namespace {

namespace fs = std::filesystem;
using test::messages_of;
using test::Outcome;
using test::run_daemon;
using test::SyntheticLog;
using test::text_of;

// Says where two long texts differ instead of printing them.
void expect_same(const std::string& a, const std::string& b, const std::string& what) {
  const auto difference = std::mismatch(a.begin(), a.end(), b.begin(), b.end());
  EXPECT_TRUE(a == b) << what << " differs at byte " << difference.first - a.begin() << " of " << a.size()
                      << " and " << b.size();
}

// ---- what goes in wrong ----

TEST(ReplayInput, MissingLog) {
  const Outcome o = run_daemon({"--replay", "/nonexistent/run.lcm", "--lockstep"});
  EXPECT_EQ(o.status, 2);
  EXPECT_EQ(o.err_lines(), 1);
  EXPECT_NE(o.err.find("/nonexistent/run.lcm"), std::string::npos) << o.err;
  EXPECT_NE(o.err.find("No such file"), std::string::npos) << o.err;
}

TEST(ReplayInput, AFileThatIsNoLogAndAnEmptyOne) {
  const test::Scratch scratch;
  std::ofstream(scratch.path("a.lcm")) << std::string(5000, 'x');
  std::ofstream(scratch.path("b.lcm")) << "";
  for (const char* name : {"a.lcm", "b.lcm"}) {
    const Outcome o = run_daemon({"--replay", scratch.path(name), "--lockstep"});
    EXPECT_EQ(o.status, 2);
    EXPECT_EQ(o.err_lines(), 1);
    EXPECT_NE(o.err.find(std::string(name) + ": no LCM event, expected an LCM log"), std::string::npos)
        << o.err;
  }
}

TEST(ReplayInput, MissingCalibrationLeavesExistingOutputsAlone) {
  const test::Scratch scratch;
  SyntheticLog log;
  log.frames = 3;
  log.with_calibration = false;
  test::write_synthetic_log(scratch.path("run.lcm"), log);
  std::ofstream(scratch.path("out.lcm")) << "precious";
  const Outcome o = run_daemon({"--replay", scratch.path("run.lcm"), "--lockstep", "--output",
                                scratch.path("out.lcm"), "--trajectory", scratch.path("t.tum")});
  EXPECT_EQ(o.status, 2);
  EXPECT_EQ(o.err_lines(), 1);
  EXPECT_NE(o.err.find("run.lcm: no CALIBRATION message in 3 events, expected one before the images"),
            std::string::npos)
      << o.err;
  EXPECT_EQ(text_of(scratch.path("out.lcm")), "precious");
  EXPECT_EQ(scratch.files(), 2u);  // no temporary, no trajectory
}

TEST(ReplayInput, NoImagesOfTheTrackedCamera) {
  const test::Scratch scratch;
  SyntheticLog log;
  log.frames = 0;
  test::write_synthetic_log(scratch.path("none.lcm"), log);
  Outcome o = run_daemon({"--replay", scratch.path("none.lcm"), "--lockstep"});
  EXPECT_EQ(o.status, 2);
  EXPECT_NE(o.err.find("no usable image of CAMERA_0"), std::string::npos) << o.err;

  log.frames = 2;
  test::write_synthetic_log(scratch.path("two.lcm"), log);
  o = run_daemon({"--replay", scratch.path("two.lcm"), "--lockstep", "--set", "camera.index=1"});
  EXPECT_EQ(o.status, 2);
  EXPECT_NE(o.err.find("no usable image of CAMERA_1"), std::string::npos) << o.err;
  EXPECT_NE(o.err.find("other cameras 2"), std::string::npos) << o.err;
}

TEST(ReplayInput, CalibrationsThatMakeNoCamera) {
  const auto error_with = [](const std::function<void(camera_calibration_t&)>& spoil) {
    const test::Scratch scratch;
    calibration_t calibration = test::synthetic_calibration();
    spoil(calibration.cameras[0]);
    {
      ipc::LogWriter writer(scratch.path("run.lcm"));
      writer.write_message("CALIBRATION", 0, calibration);
      writer.write_message("CAMERA_0", 0, test::synthetic_image({}, 0));
      writer.close();
    }
    const Outcome o = run_daemon({"--replay", scratch.path("run.lcm"), "--lockstep"});
    EXPECT_EQ(o.status, 2) << o.err;
    EXPECT_EQ(o.err_lines(), 1) << o.err;
    return o.err;
  };
  EXPECT_NE(error_with([](auto& c) {
              c.model = "fisheye";
            }).find("CALIBRATION, camera 0: model 'fisheye', expected 'pinhole-radtan' or 'kannala-brandt'"),
            std::string::npos);
  EXPECT_NE(error_with([](auto& c) { c.fx = -400.0; }).find("CALIBRATION, camera 0: "), std::string::npos);
  EXPECT_NE(error_with([](auto& c) { c.cx = std::nan(""); }).find("CALIBRATION, camera 0: "),
            std::string::npos);
  EXPECT_NE(error_with([](auto& c) { c.orientation[0] = 2.0; }).find("no rigid motion"), std::string::npos);
  EXPECT_NE(error_with([](auto& c) { c.position[1] = std::nan(""); }).find("no rigid motion"),
            std::string::npos);
}

TEST(ReplayInput, ConfigurationMistakesStopTheStart) {
  const test::Scratch scratch;
  std::ofstream(scratch.path("f.yaml")) << "tracking:\n  min_inlier: 30\n";
  Outcome o = run_daemon({"--config", scratch.path("f.yaml"), "--replay", "run.lcm", "--lockstep"});
  EXPECT_EQ(o.status, 2);
  EXPECT_EQ(o.err, "farpointd: " + scratch.path("f.yaml") +
                       ":2: tracking.min_inlier: unknown key, did you mean 'tracking.min_inliers'?\n");
  o = run_daemon({"--set", "tracking.min_inliers=-1", "--replay", "run.lcm", "--lockstep"});
  EXPECT_EQ(o.status, 2);
  EXPECT_EQ(o.err_lines(), 1);
  o = run_daemon({"--config", "/nonexistent.yaml", "--replay", "run.lcm", "--lockstep"});
  EXPECT_EQ(o.status, 2);
  EXPECT_EQ(o.err_lines(), 1);
}

TEST(ReplayInput, OutputsThatCannotBeWrittenAreSaidBeforeTheRun) {
  const test::Scratch scratch;
  SyntheticLog log;
  log.frames = 1;
  test::write_synthetic_log(scratch.path("run.lcm"), log);
  for (const char* option : {"--output", "--trajectory", "--live-trajectory", "--can-log"}) {
    const Outcome o =
        run_daemon({"--replay", scratch.path("run.lcm"), "--lockstep", option, scratch.path("no/where")});
    EXPECT_EQ(o.status, 2) << option;
    EXPECT_EQ(o.err_lines(), 1) << o.err;
    EXPECT_NE(o.err.find("no/where"), std::string::npos) << o.err;
  }
}

TEST(ReplayInput, NetworkOrBusThatIsNotThereIsOnlyWarnedOf) {
  const test::Scratch scratch;
  SyntheticLog log;
  log.frames = 2;
  test::write_synthetic_log(scratch.path("run.lcm"), log);
  const Outcome o =
      run_daemon({"--replay", scratch.path("run.lcm"), "--lockstep", "--lcm-url", "nosuchprovider://",
                  "--can", "nosuchcan0", "--can-log", scratch.path("out.candump")});
  EXPECT_EQ(o.status, 0);
  EXPECT_NE(o.err.find("without the network"), std::string::npos) << o.err;
  EXPECT_NE(o.err.find("without the bus"), std::string::npos) << o.err;
  EXPECT_NE(text_of(scratch.path("out.candump")).find(" nosuchcan0 680#"), std::string::npos);
}

// ---- runs on a synthetic log, made once ----

class SyntheticRun : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    scratch_ = new test::Scratch;
    test::write_synthetic_log(log_path(), {});
  }
  static void TearDownTestSuite() {
    delete scratch_;
    scratch_ = nullptr;
  }
  static std::string path(const std::string& name) { return scratch_->path(name); }
  static std::string log_path() { return path("run.lcm"); }
  static test::Scratch* scratch_;
};
test::Scratch* SyntheticRun::scratch_ = nullptr;

// Everything in a log but FARPOINT_TIMING, event headers included.
std::string comparable(const std::string& log) {
  std::string bytes;
  ipc::LogReader reader(log);
  ipc::LogEvent event;
  while (reader.next(&event)) {
    if (event.channel == ipc::kTimingChannel) continue;
    bytes += std::to_string(event.number) + " " + std::to_string(event.timestamp_us) + " ";
    bytes += event.channel;
    bytes.append(reinterpret_cast<const char*>(event.data.data()), event.data.size());
  }
  EXPECT_EQ(reader.damage().places, 0u);
  return bytes;
}

TEST_F(SyntheticRun, WritesEverythingThatIsAskedFor) {
  const Outcome o = run_daemon({"--replay", log_path(), "--lockstep", "--output", path("out.lcm"),
                                "--trajectory", path("final.tum"), "--live-trajectory", path("live.tum"),
                                "--can-log", path("out.candump")});
  ASSERT_EQ(o.status, 0) << o.err;
  EXPECT_EQ(o.err, "");
  EXPECT_TRUE(o.out.starts_with("farpointd: done: 60 frames, ")) << o.out;
  EXPECT_NE(o.out.find("wrote " + path("out.lcm") + " " + path("final.tum")), std::string::npos) << o.out;

  const auto poses = messages_of<pose_t>(path("out.lcm"), "FARPOINT_POSE");
  const auto odometry = messages_of<odometry_t>(path("out.lcm"), "FARPOINT_ODOMETRY");
  ASSERT_EQ(poses.size(), 60u);
  ASSERT_EQ(odometry.size(), 60u);
  EXPECT_EQ(messages_of<map_from_odom_t>(path("out.lcm"), "FARPOINT_MAP_FROM_ODOM").size(), 60u);
  std::size_t valid = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    EXPECT_EQ(poses[i].utime, 1'000'000 + 100'000 * static_cast<std::int64_t>(i));
    EXPECT_EQ(odometry[i].utime, poses[i].utime);
    EXPECT_EQ(poses[i].valid != 0, poses[i].state == 3 || poses[i].state == 4);
    EXPECT_EQ(poses[i].scale_state, 0);
    if (!poses[i].valid) {
      EXPECT_EQ(poses[i].quality, -1);
    }
    valid += poses[i].valid ? 1 : 0;
  }
  EXPECT_GE(valid, 40u);  // the world is easy: an estimator that works tracks most of it

  // The live trajectory is what was published as valid, to the digit.
  std::istringstream live(text_of(path("live.tum")));
  std::string line;
  std::getline(live, line);
  for (const pose_t& pose : poses) {
    if (!pose.valid) continue;
    ASSERT_TRUE(std::getline(live, line));
    double t, x, y, z, qx, qy, qz, qw;
    std::istringstream(line) >> t >> x >> y >> z >> qx >> qy >> qz >> qw;
    EXPECT_NEAR(t, 1e-6 * static_cast<double>(pose.utime), 1e-7);
    EXPECT_NEAR(x, pose.position[0], 1e-9);
    EXPECT_NEAR(z, pose.position[2], 1e-9);
    EXPECT_NEAR(qw, pose.orientation[0], 1e-9);
  }
  EXPECT_FALSE(std::getline(live, line));

  const auto trajectory = messages_of<trajectory_t>(path("out.lcm"), "FARPOINT_TRAJECTORY");
  ASSERT_EQ(trajectory.size(), 1u);
  EXPECT_EQ(trajectory[0].frames, 60);
  const std::string final_text = text_of(path("final.tum"));
  EXPECT_EQ(std::count(final_text.begin(), final_text.end(), '\n') - 1,
            std::count_if(trajectory[0].poses.begin(), trajectory[0].poses.end(),
                          [&](const trajectory_pose_t& p) { return p.map_id == trajectory[0].map_id; }));
  const auto summary = messages_of<summary_t>(path("out.lcm"), "FARPOINT_SUMMARY");
  ASSERT_EQ(summary.size(), 1u);
  EXPECT_EQ(summary[0].frames, 60);
  EXPECT_EQ(static_cast<std::size_t>(summary[0].frames_valid), valid);
  EXPECT_GE(summary[0].nmaps, 1);
  EXPECT_GT(summary[0].maps[0].creation_depth_median, 0.0);

  const auto timing = messages_of<timing_t>(path("out.lcm"), "FARPOINT_TIMING");
  ASSERT_EQ(timing.size(), 60u);
  EXPECT_GT(timing[30].cpu_ms[timing_t::STAGE_FRAME], 0.0);
  EXPECT_GT(timing[30].wall_ms[timing_t::STAGE_DECODE], 0.0);
  EXPECT_GT(timing[30].peak_resident_bytes, 1'000'000);

  // 5 Hz of utime over 6 s, and one at each change of state.
  const auto status = messages_of<status_t>(path("out.lcm"), "FARPOINT_STATUS");
  EXPECT_GE(status.size(), 30u);
  EXPECT_LE(status.size(), 40u);
  EXPECT_EQ(status.back().configuration_hash, summary[0].configuration_hash);
  EXPECT_EQ(status.back().frames_received, status.back().frames_tracked);
  // 1 Hz, each with the next keyframe that is due: those are at most a second apart.
  const auto maps = messages_of<map_t>(path("out.lcm"), "FARPOINT_MAP");
  ASSERT_GE(maps.size(), 3u);
  EXPECT_LE(maps.size(), 6u);
  for (std::size_t i = 1; i < maps.size(); ++i) EXPECT_LE(maps[i].utime - maps[i - 1].utime, 2'000'000);
  EXPECT_LE(status.back().utime - maps.back().utime, 2'000'000);
}

TEST_F(SyntheticRun, EveryEventOfTheOutputHasAFramesTime) {
  ASSERT_EQ(run_daemon({"--replay", log_path(), "--lockstep", "--output", path("times.lcm")}).status, 0);
  ipc::LogReader reader(path("times.lcm"));
  ipc::LogEvent event;
  while (reader.next(&event)) {
    const std::int64_t since_start = event.timestamp_us - 1'000'000;
    EXPECT_TRUE(since_start >= 0 && since_start <= 5'900'000 && since_start % 100'000 == 0)
        << event.timestamp_us;
  }
}

TEST_F(SyntheticRun, StandardInputGivesTheSame) {
  ASSERT_EQ(run_daemon({"--replay", log_path(), "--lockstep", "--output", path("file.lcm")}).status, 0);
  const std::string command = test::binary_dir() +
                              "/bin/farpointd --replay - --lockstep --set log.level=warning --output " +
                              path("stdin.lcm") + " < " + log_path() + " > /dev/null 2>&1";
  ASSERT_EQ(std::system(command.c_str()), 0) << command;
  expect_same(comparable(path("stdin.lcm")), comparable(path("file.lcm")), "output log");
}

// The last image is not in the pipe yet when the signal comes. Pipe and reader hold 3 MB, the log is
// larger: the run is well under way then.
TEST_F(SyntheticRun, ASignalEndsItInOrder) {
  const std::size_t bytes = test::read_bytes(log_path()).size();
  ASSERT_GT(bytes, std::size_t{4'000'000});
  const std::string most = std::to_string(bytes - bytes / 61);
  const std::string fifo = path("stopped.fifo"), log = log_path();
  const std::string command =
      "mkfifo " + fifo + "; " + test::binary_dir() + "/bin/farpointd --replay - --lockstep --output " +
      path("stopped.lcm") + " --trajectory " + path("stopped.tum") + " < " + fifo + " > /dev/null 2> " +
      path("stopped.err") + " & { head -c " + most + " " + log + "; kill -TERM $!; tail -c +" + most + " " +
      log + " | tail -c +2; } > " + fifo + " 2> /dev/null; wait $!";
  const int status = std::system(command.c_str());
  ASSERT_TRUE(WIFEXITED(status)) << command;
  EXPECT_EQ(WEXITSTATUS(status), 1) << command;
  const std::string err = text_of(path("stopped.err"));
  EXPECT_NE(err.find("stopped by signal 15 before the end of the log"), std::string::npos) << err;
  const auto summary = messages_of<summary_t>(path("stopped.lcm"), "FARPOINT_SUMMARY");
  ASSERT_EQ(summary.size(), 1u);
  EXPECT_GE(summary[0].frames, 1);
  EXPECT_LT(summary[0].frames, 60);
  EXPECT_EQ(messages_of<pose_t>(path("stopped.lcm"), "FARPOINT_POSE").size(),
            static_cast<std::size_t>(summary[0].frames));
  EXPECT_FALSE(text_of(path("stopped.tum")).empty());
}

TEST_F(SyntheticRun, ACutOffLogIsReplayedUpToTheCutAndSaidToBe) {
  auto bytes = test::read_bytes(log_path());
  bytes.resize(bytes.size() * 6 / 10);
  test::write_bytes(path("cut.lcm"), bytes);
  const Outcome o = run_daemon({"--replay", path("cut.lcm"), "--lockstep", "--output", path("cut_out.lcm")});
  EXPECT_EQ(o.status, 2);
  EXPECT_EQ(o.err_lines(), 1) << o.err;
  EXPECT_NE(o.err.find("cut.lcm: cut off within its last event, expected a whole log"), std::string::npos)
      << o.err;
  EXPECT_EQ(messages_of<pose_t>(path("cut_out.lcm"), "FARPOINT_POSE").size(), 35u);
  EXPECT_EQ(messages_of<summary_t>(path("cut_out.lcm"), "FARPOINT_SUMMARY").at(0).log_damages, 1);

  bytes.resize(20);
  test::write_bytes(path("stump.lcm"), bytes);
  const Outcome stump = run_daemon({"--replay", path("stump.lcm"), "--lockstep"});
  EXPECT_EQ(stump.status, 2);
  EXPECT_EQ(stump.err_lines(), 1) << stump.err;
}

TEST_F(SyntheticRun, DamageInTheMiddleIsCountedAndReadPast) {
  auto bytes = test::read_bytes(log_path());
  const std::size_t event = bytes.size() / 61;
  for (std::size_t i = 0; i < 200; ++i) bytes[30 * event + i] ^= 0x5a;
  test::write_bytes(path("damaged.lcm"), bytes);
  const Outcome o =
      run_daemon({"--replay", path("damaged.lcm"), "--lockstep", "--output", path("damaged_out.lcm")});
  EXPECT_EQ(o.status, 0) << o.err;
  const auto frames = messages_of<pose_t>(path("damaged_out.lcm"), "FARPOINT_POSE").size();
  EXPECT_GE(frames, 57u);
  EXPECT_LE(frames, 60u);
  EXPECT_EQ(messages_of<pose_t>(path("damaged_out.lcm"), "FARPOINT_POSE").back().utime, 6'900'000);
}

TEST_F(SyntheticRun, WrongImagesAreDroppedAndCounted) {
  {
    ipc::LogWriter writer(path("odd.lcm"));
    writer.write_message("CALIBRATION", 0, test::synthetic_calibration());
    for (int i = 0; i < 10; ++i) {
      image_t image = test::synthetic_image({}, i);
      if (i == 3) image.utime -= 250'000;      // runs backwards
      if (i == 4) image.width = 481;           // not the calibration's
      if (i == 5) image.pixel_format = 12345;  // no format
      if (i == 6) image.camera = 3;            // not its channel's
      writer.write_message("CAMERA_0", 0, image);
      if (i == 7) {
        const std::vector<std::uint8_t> garbage(100, 7);
        writer.write("CAMERA_0", 0, garbage);
      }
    }
    writer.close();
  }
  const Outcome o = run_daemon({"--replay", path("odd.lcm"), "--lockstep", "--output", path("odd_out.lcm"),
                                "--set", "lcm.status_rate_hz=1000"});
  ASSERT_EQ(o.status, 0) << o.err;
  const status_t status = messages_of<status_t>(path("odd_out.lcm"), "FARPOINT_STATUS").back();
  EXPECT_EQ(status.frames_tracked, 6);
  EXPECT_EQ(status.times_backwards, 1);
  EXPECT_EQ(status.images_wrong_size, 1);
  EXPECT_EQ(status.images_undecodable, 1);
  EXPECT_EQ(status.images_unknown_camera, 1);
  EXPECT_EQ(status.messages_undecodable, 1);
  EXPECT_NE(o.out.find("refused: 1 images of wrong size"), std::string::npos) << o.out;
}

TEST(Replay, ACameraThatStandsStillIsDoneAndSaysSo) {
  const test::Scratch scratch;
  SyntheticLog log;
  log.frames = 20;
  log.step_m = 0.0;
  test::write_synthetic_log(scratch.path("run.lcm"), log);
  const Outcome o = run_daemon({"--replay", scratch.path("run.lcm"), "--lockstep", "--trajectory",
                                scratch.path("t.tum"), "--output", scratch.path("out.lcm")});
  EXPECT_EQ(o.status, 0);
  EXPECT_TRUE(o.out.starts_with("farpointd: done, never initialised: 20 frames, 0 tracked (0.0 %)")) << o.out;
  EXPECT_NE(text_of(scratch.path("t.tum")).find("no frame has a pose"), std::string::npos);
  for (const pose_t& pose : messages_of<pose_t>(scratch.path("out.lcm"), "FARPOINT_POSE"))
    EXPECT_EQ(pose.valid, 0);
  EXPECT_EQ(messages_of<trajectory_t>(scratch.path("out.lcm"), "FARPOINT_TRAJECTORY").at(0).nposes, 0);
}

// ---- the same again, under load ----

pid_t start_busy_loop() {
  const pid_t child = fork();
  if (child == 0) {
    for (std::uint64_t i = 0;; ++i) asm volatile("" : : "r"(i));
  }
  return child;
}

// Two processes of their own, the second while both cores are busy: every file must be the same, but
// FARPOINT_TIMING.
void expect_repeatable(const test::Scratch& scratch, const std::string& log) {
  const auto command = [&](const std::string& name) {
    return test::binary_dir() + "/bin/farpointd --replay " + log +
           " --lockstep --set scale.assumed=1 --output " + scratch.path(name + ".lcm") + " --trajectory " +
           scratch.path(name + ".final.tum") + " --live-trajectory " + scratch.path(name + ".live.tum") +
           " --can-log " + scratch.path(name + ".candump") + " > /dev/null 2>&1";
  };
  ASSERT_EQ(std::system(command("a").c_str()), 0) << command("a");
  const std::array<pid_t, 2> load{start_busy_loop(), start_busy_loop()};
  const int status = std::system(command("b").c_str());
  for (const pid_t child : load) {
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
  }
  ASSERT_EQ(status, 0);
  expect_same(text_of(scratch.path("a.final.tum")), text_of(scratch.path("b.final.tum")), "final.tum");
  expect_same(text_of(scratch.path("a.live.tum")), text_of(scratch.path("b.live.tum")), "live.tum");
  expect_same(text_of(scratch.path("a.candump")), text_of(scratch.path("b.candump")), "candump");
  expect_same(comparable(scratch.path("a.lcm")), comparable(scratch.path("b.lcm")), "output log");
  const auto poses = messages_of<pose_t>(scratch.path("a.lcm"), "FARPOINT_POSE");
  EXPECT_TRUE(std::any_of(poses.begin(), poses.end(), [](const pose_t& p) { return p.valid != 0; }));
}

TEST(Determinism, SyntheticLog) {
  const test::Scratch scratch;
  SyntheticLog log;
  log.frames = 40;
  test::write_synthetic_log(scratch.path("run.lcm"), log);
  expect_repeatable(scratch, scratch.path("run.lcm"));
}

const std::string kKitti03 = test::source_dir() + "/../shared/data/kitti/sequences/03";

TEST(Determinism, RecordedDrive) {
  const test::Scratch scratch;
  if (!fs::exists(kKitti03)) GTEST_SKIP() << "no recorded data in " << kKitti03;
  ASSERT_TRUE(test::write_kitti_log(kKitti03, 60, scratch.path("run.lcm")));
  expect_repeatable(scratch, scratch.path("run.lcm"));
}

// ---- the CAN log, through the DBC alone, against the live trajectory ----

using Epoch = std::map<std::string, double>;
std::map<std::int64_t, Epoch> decode_can_log(const std::string& path) {
  const auto dbc = test::read_dbc(test::source_dir() + "/config/farpoint.dbc");
  std::map<std::int64_t, Epoch> epochs;
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) {
    ipc::CandumpLine parsed;
    EXPECT_TRUE(ipc::parse_candump_line(line, &parsed)) << line;
    const test::DbcMessage& message = dbc.at(parsed.frame.id);
    for (const auto& [name, signal] : message.signals)
      epochs[parsed.utime][name] = signal.value(parsed.frame);
  }
  return epochs;
}

std::map<std::int64_t, slam::SE3> read_live(const std::string& live) {
  std::map<std::int64_t, slam::SE3> poses;
  std::ifstream in(live);
  std::string line;
  std::getline(in, line);  // header
  while (std::getline(in, line)) {
    long long seconds, micros;
    char dot;
    slam::SE3 T;
    std::istringstream(line) >> seconds >> dot >> micros >> T.t.x() >> T.t.y() >> T.t.z() >> T.q.x() >>
        T.q.y() >> T.q.z() >> T.q.w();
    poses[seconds * 1'000'000 + micros] = T;
  }
  return poses;
}

// Each valid epoch is the live pose of its image, carried on by the velocity for its age.
void expect_can_equals_live(const std::string& can_log, const std::string& live) {
  auto epochs = decode_can_log(can_log);
  const auto poses = read_live(live);
  EXPECT_GE(poses.size(), 40U);
  constexpr double kDegree = std::numbers::pi / 180.0;
  std::set<std::int64_t> used;
  for (auto& [utime, e] : epochs) {
    if (e["PoseValid"] == 0.0) {
      EXPECT_TRUE(std::isnan(e["PositionX"]) && std::isnan(e["Heading"])) << utime;
      continue;
    }
    const auto image = utime - std::llround(1e6 * e["Age"]);
    const auto found = std::min_element(poses.begin(), poses.end(), [&](const auto& a, const auto& b) {
      return std::abs(a.first - image) < std::abs(b.first - image);
    });
    ASSERT_LE(std::abs(found->first - image), 100) << utime;  // a step of the age
    used.insert(found->first);
    const slam::SE3& T = found->second;
    const Eigen::Vector3d turn = e["Age"] * kDegree * Eigen::Vector3d(0, 0, e["YawRate"]);
    const Eigen::Vector3d way = e["Age"] * Eigen::Vector3d(e["VelocityX"], e["VelocityY"], e["VelocityZ"]);
    const Eigen::Vector3d p(e["PositionX"], e["PositionY"], e["PositionZ"]);
    EXPECT_LE((p - T.t - T.q * slam::so3_exp(0.5 * turn) * way).cwiseAbs().maxCoeff(), 0.012) << utime;
    const Eigen::Quaterniond q = Eigen::AngleAxisd(e["Heading"] * kDegree, Eigen::Vector3d::UnitZ()) *
                                 Eigen::AngleAxisd(e["Pitch"] * kDegree, Eigen::Vector3d::UnitY()) *
                                 Eigen::AngleAxisd(e["Roll"] * kDegree, Eigen::Vector3d::UnitX());
    // The rates about the other two axes are not on the bus.
    if (e["Age"] == 0.0) {
      EXPECT_LE(slam::so3_log(T.q.conjugate() * q).norm() / kDegree, 0.01) << utime;
    }
  }
  EXPECT_EQ(used.size(), poses.size());
  EXPECT_EQ(epochs.rbegin()->second["State"], static_cast<double>(status_t::STATE_STOPPED));
}

TEST_F(SyntheticRun, CanLogGivesTheLiveTrajectoryBack) {
  ASSERT_EQ(run_daemon({"--replay", log_path(), "--lockstep", "--set", "scale.assumed=1.7", "--set",
                        "can.frame=map", "--live-trajectory", path("can_live.tum"), "--can-log",
                        path("can.candump")})
                .status,
            0);
  expect_can_equals_live(path("can.candump"), path("can_live.tum"));
}

TEST_F(SyntheticRun, WithoutAnAssumedScaleTheCanLogHasNoPositionOrVelocity) {
  ASSERT_EQ(run_daemon({"--replay", log_path(), "--lockstep", "--can-log", path("no_scale.candump")}).status,
            0);
  auto epochs = decode_can_log(path("no_scale.candump"));
  ASSERT_GT(epochs.size(), 60u);
  const std::int64_t stopped = epochs.rbegin()->first;
  int with_heading = 0;
  for (auto& [utime, e] : epochs) {
    for (const char* name : {"PositionX", "PositionY", "PositionZ", "VelocityX", "VelocityY", "VelocityZ"}) {
      EXPECT_TRUE(std::isnan(e[name])) << name << " at " << utime;
    }
    EXPECT_EQ(e["ScaleState"], 0.0);
    if (utime != stopped && e.contains("ScaleSource")) {
      EXPECT_EQ(e["ScaleSource"], 0.0);
    }
    with_heading += std::isnan(e["Heading"]) ? 0 : 1;
  }
  EXPECT_GE(with_heading, 40);
}

}  // namespace
}  // namespace farpoint::daemon
