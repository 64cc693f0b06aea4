// SPDX-License-Identifier: Apache-2.0
#include "daemon/check/checks.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "ipc/image_encoder.h"
#include "ipc/log.h"
#include "tests/daemon/synthetic_log.h"
#include "tests/ipc/scratch.h"
#include "tests/support/paths.h"

namespace farpoint::daemon {
namespace {

using test::Scratch;

// "verdict: sentence" of the only line about `what`.
std::string line_of(const Findings& findings, const std::string& what) {
  std::string found;
  for (const Finding& finding : findings.all()) {
    if (finding.what != what) continue;
    EXPECT_EQ(found, "") << "two lines about " << what;
    found = std::string(to_string(finding.verdict)) + ": " + finding.sentence;
  }
  return found;
}

void expect_line(const Findings& findings, const std::string& what, const std::string& verdict,
                 const std::string& part) {
  const std::string line = line_of(findings, what);
  EXPECT_TRUE(line.starts_with(verdict + ": ")) << what << ": " << line;
  EXPECT_NE(line.find(part), std::string::npos) << what << ": " << line;
}

// ---- calibration and cameras

struct Looked {
  Config config;
  Findings findings;
  std::optional<calibration_t> calibration;

  void look() {
    calibration = check_calibration(config, &findings);
    if (calibration) check_cameras(config, *calibration, "", &findings);
  }
};

std::string camera_file() {
  return test::source_dir() + "/config/cameras/tum-freiburg1.yaml";
}

TEST(CheckCamera, ACalibrationThatCannotBeUsedIsAnError) {
  Looked looked;
  looked.config.camera.calibration = "/nowhere/camera.yaml";
  looked.look();
  EXPECT_FALSE(looked.calibration);
  expect_line(looked.findings, "calibration", "error", "/nowhere/camera.yaml: cannot be opened");
  looked = {};
  looked.config.camera.calibration = camera_file();
  looked.config.image_mb = 1;
  looked.look();
  expect_line(looked.findings, "calibration", "error", "capacity.image_mb");
}

TEST(CheckCamera, AnAbsentCameraAndANameOfNoCameraAreErrors) {
  Looked looked;
  looked.config.camera.calibration = camera_file();
  looked.config.camera.device = "/dev/nosuchcamera";
  looked.look();
  expect_line(looked.findings, "calibration", "ok", "640 x 480, pinhole-radtan");
  expect_line(looked.findings, "camera", "error", "/dev/nosuchcamera: there is no such camera");
  looked.findings = {};
  looked.config.camera.device = "camera";
  looked.look();
  expect_line(looked.findings, "camera", "error", "'camera' names no camera");
  // A node that is no camera.
  looked.findings = {};
  looked.config.camera.device = "/dev/null";
  looked.look();
  expect_line(looked.findings, "camera", "error", "it is no V4L2 device");
}

TEST(CheckCamera, ALogAsACameraMustHoldImagesOfTheCalibrationsSize) {
  const Scratch scratch;
  test::write_synthetic_log(scratch.path("film.lcm"), {});
  Looked looked;
  looked.config.camera.driver = CameraDriverChoice::kFile;
  looked.config.camera.device = scratch.path("film.lcm");
  looked.config.camera.calibration = "log";
  looked.look();
  expect_line(looked.findings, "camera", "ok", "a log with images of");
  looked.findings = {};
  looked.config.camera.calibration = camera_file();
  looked.look();
  expect_line(looked.findings, "camera", "error", "expected 640 x 480 (the calibration)");
  looked.findings = {};
  looked.config.camera.device = scratch.path("none.lcm");
  looked.look();
  expect_line(looked.findings, "camera", "error", "none.lcm");
}

TEST(CheckCamera, ASocketOfAnotherProcessIsLookedFor) {
  const Scratch scratch;
  Looked looked;
  looked.config.camera.driver = CameraDriverChoice::kLcm;
  looked.config.camera.device = scratch.path("images");
  looked.config.camera.calibration = camera_file();
  looked.look();
  expect_line(looked.findings, "camera", "error", "No such file or directory");
  std::ofstream(scratch.path("images")) << "text";
  looked.findings = {};
  looked.look();
  expect_line(looked.findings, "camera", "error", "no socket");
}

// ---- masks

// A PNG file of 480x320 px, the synthetic camera's size, whose upper rows are masked.
void write_mask(const std::string& path, int masked_rows) {
  std::vector<std::uint8_t> pixels(std::size_t{480} * 320, 255);
  std::fill_n(pixels.begin(), 480 * masked_rows, std::uint8_t{0});
  const std::vector<std::uint8_t> png = ipc::encode_png({480, 320, pixels});
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(png.data()), static_cast<std::streamsize>(png.size()));
}

Findings masks_of(const CameraConfig& camera, const calibration_t& calibration) {
  Config config;
  config.camera = camera;
  Findings findings;
  check_masks(config, calibration, &findings);
  return findings;
}

TEST(CheckMask, EachMaskIsReadAndItsShareIsNamed) {
  const Scratch scratch;
  write_mask(scratch.path("bonnet.png"), 80);
  write_mask(scratch.path("other.png"), 32);
  calibration_t calibration = test::synthetic_calibration();
  CameraConfig camera;
  expect_line(masks_of(camera, calibration), "mask", "ok", "none (camera.mask)");
  EXPECT_EQ(line_of(masks_of(camera, calibration), "second mask"), "");
  camera.mask = scratch.path("bonnet.png");
  camera.second_mask = scratch.path("other.png");
  expect_line(masks_of(camera, calibration), "mask", "ok", "bonnet.png: 25.0 % of the image");
  expect_line(masks_of(camera, calibration), "second mask", "warning", "there is no camera 1");
  calibration.cameras.push_back(calibration.cameras[0]);
  expect_line(masks_of(camera, calibration), "second mask", "ok", "other.png: 10.0 % of the image");
}

TEST(CheckMask, AMaskThatTheStartRefusesIsAnError) {
  const Scratch scratch;
  CameraConfig camera;
  camera.mask = scratch.path("none.png");
  expect_line(masks_of(camera, test::synthetic_calibration()), "mask", "error", "camera.mask: ");
  write_mask(scratch.path("all.png"), 320);
  camera.mask = scratch.path("all.png");
  expect_line(masks_of(camera, test::synthetic_calibration()), "mask", "error", "masks 100.0 % of the image");
}

// ---- the log of a replay

struct CheckLog : testing::Test {
  Findings look(const Config& config = {}) {
    Findings findings;
    calibration = check_log(log, config, &findings);
    return findings;
  }

  const Scratch scratch;
  const std::string log = scratch.path("run.lcm");
  std::optional<calibration_t> calibration;
};

TEST_F(CheckLog, ItsImagesAndCalibrationAreDescribed) {
  test::write_synthetic_log(log, {});
  const Findings findings = look();
  EXPECT_TRUE(calibration);
  expect_line(findings, "calibration", "ok", "480 x 320, pinhole-radtan");
  expect_line(findings, "log", "ok", "60 images in 5.9 s (10 Hz)");
}

TEST_F(CheckLog, ALogThatNoReplayTakesIsAnError) {
  expect_line(look(), "calibration", "error", "run.lcm");
  test::write_synthetic_log(log, {.with_calibration = false});
  expect_line(look(), "calibration", "error", "CALIBRATION");
  test::write_synthetic_log(log, {});
  Config config;
  config.camera.index = 1;
  expect_line(look(config), "calibration", "error", "camera");
  config = {};
  config.image_mb = 1;
  expect_line(look(config), "calibration", "error", "capacity.image_mb");
  EXPECT_FALSE(calibration);
  {
    ipc::LogWriter writer(log);
    writer.write_message("CALIBRATION", 0, test::synthetic_calibration());
    writer.close();
  }
  expect_line(look(), "log", "error", "no image on CAMERA_0");
}

TEST_F(CheckLog, WhatAReplayLeavesOutIsAWarning) {
  test::write_synthetic_log(log, {});
  std::filesystem::resize_file(log, std::filesystem::file_size(log) - 100);
  expect_line(look(), "log", "warning", "cut off within its last event");
  {
    ipc::LogWriter writer(log);
    writer.write_message("CALIBRATION", 0, test::synthetic_calibration());
    for (const int number : {0, 1, 1, 2})
      writer.write_message("CAMERA_0", number, test::synthetic_image({}, number));
    writer.close();
  }
  expect_line(look(), "log", "warning", "3 images in 0.2 s (10 Hz); 1 messages are not used");
}

// ---- bus and network

std::string judged(const std::optional<drivers::LinkInfo>& link, bool fd = false) {
  CanConfig config;
  config.fd = fd;
  Findings findings;
  judge_link("can0", link, can_layout(config), &findings);
  return line_of(findings, "CAN");
}

drivers::LinkInfo good_link() {
  drivers::LinkInfo link;
  link.txqueuelen = 64;
  link.queue = "pfifo_fast";
  link.kind = "can";
  link.is_can = link.is_up = true;
  link.mtu = 16;
  link.bitrate = 500'000;
  return link;
}

TEST(CheckBus, ABusThatCarriesTheFramesIsDescribed) {
  EXPECT_EQ(judged(good_link()), "ok: can0: up, 500000 bit/s, queue pfifo_fast for 64 frames");
  drivers::LinkInfo link = good_link();
  link.kind = "vcan";
  link.bitrate = 0;
  EXPECT_EQ(judged(link),
            "ok: can0: up, a bus of kind vcan without a bit rate, queue pfifo_fast for 64 frames");
}

TEST(CheckBus, WhatKeepsFramesFromTheBusIsAnErrorWithItsRemedy) {
  EXPECT_NE(judged({}).find("error: can0: no such interface"), std::string::npos);
  drivers::LinkInfo link = good_link();
  link.is_can = false;
  EXPECT_NE(judged(link).find("error: can0: no CAN interface"), std::string::npos);
  link = good_link();
  link.bitrate = 0;
  EXPECT_NE(judged(link).find("error: can0: no bit rate is set, expected the bus's own (ip link set can0"),
            std::string::npos);
  link = good_link();
  link.is_up = false;
  EXPECT_NE(judged(link).find("error: can0: down, expected up (ip link set can0 up)"), std::string::npos);
  EXPECT_NE(judged(good_link(), true).find("error: can0: no CAN FD"), std::string::npos);
  link = good_link();
  link.mtu = 72;
  EXPECT_EQ(judged(link, true).substr(0, 3), "ok:");
}

TEST(CheckBus, AQueueThatDropsFramesIsAWarning) {
  drivers::LinkInfo link = good_link();
  link.txqueuelen = 2;
  EXPECT_NE(judged(link).find("warning: can0: its transmit queue holds 2 frames"), std::string::npos);
  link.queue = "fq_codel";
  EXPECT_NE(judged(link).find("warning: can0: its queue discipline is fq_codel"), std::string::npos);
}

TEST(CheckBus, WheelSpeedsNeedTheirSignalsAndABus) {
  const std::string dbc = test::source_dir() + "/config/vehicles/car/car.dbc";
  Config config;
  config.can.wheels_dbc = dbc;
  config.can.wheel_signals = "WHEEL_SPEEDS.FRONT_LEFT";
  Findings findings;
  check_bus({}, config, &findings);
  expect_line(findings, "wheel speeds", "warning", "no bus is in use");
  expect_line(findings, "CAN", "ok", "off");
  config.can.wheel_signals = "WHEEL_SPEEDS.NO_SUCH";
  findings = {};
  check_bus({}, config, &findings);
  expect_line(findings, "wheel speeds", "error", "NO_SUCH");
}

TEST(CheckBus, AUrlThatLcmCannotUseIsAnErrorAndNoneIsOff) {
  Config config;
  config.lcm.url = "http://nowhere";
  Findings findings;
  check_network({}, config, &findings);
  expect_line(findings, "LCM", "error", "http://nowhere");
  config.lcm.enabled = false;
  findings = {};
  check_network({}, config, &findings);
  expect_line(findings, "LCM", "ok", "off");
}

// ---- privileges and clocks

Findings privileges_of(RealtimeConfig config, const Privileges& privileges) {
  Findings findings;
  check_privileges(config, privileges, {{0, 1024}, {1, 1024}}, "/nosuchroot", &findings);
  return findings;
}

TEST(CheckPrivileges, WhatTheProfileAsksForIsHeldAgainstTheLimits) {
  RealtimeConfig vehicle;
  vehicle.profile = RealtimeProfile::kVehicle;
  const Privileges none, all{99, Privileges::kUnlimited, true};
  expect_line(privileges_of({}, none), "real-time priority", "ok", "none is asked for");
  expect_line(privileges_of(vehicle, none), "real-time priority", "warning",
              "may use 0 at most, expected 50");
  expect_line(privileges_of(vehicle, {49, 0, false}), "real-time priority", "warning", "may use 49 at most");
  expect_line(privileges_of(vehicle, {50, 0, false}), "real-time priority", "ok", "50");
  expect_line(privileges_of(vehicle, {50, 8'000'000, false}), "locked memory", "warning", "may lock 8 MB");
  expect_line(privileges_of(vehicle, all), "locked memory", "ok", "without a limit");
}

TEST(CheckPrivileges, ARefusalIsAnErrorWhereTheStartWouldEndByIt) {
  RealtimeConfig config;
  config.profile = RealtimeProfile::kVehicle;
  config.require = true;
  config.cpu_latency_us = 50;
  config.mapping.core = 7;
  const Findings findings = privileges_of(config, {});
  for (const char* what : {"real-time priority", "locked memory", "cores", "processor sleep"})
    expect_line(findings, what, "error", "(realtime.require is set)");
  expect_line(findings, "cores", "error", "core 7");
  config.require = false;
  EXPECT_EQ(privileges_of(config, {}).worst(), Verdict::kWarning);
}

TEST(CheckPrivileges, AGovernorThatSavesPowerIsNamed) {
  const Scratch scratch;
  const std::string folder = scratch.path("sys/devices/system/cpu/cpu0/cpufreq");
  std::filesystem::create_directories(folder);
  std::ofstream(folder + "/scaling_governor") << "powersave\n";
  Findings findings;
  RealtimeConfig config;
  config.require = true;
  check_privileges(config, {99, Privileges::kUnlimited, true}, {{0, 1024}}, scratch.path(""), &findings);
  expect_line(findings, "processor frequency", "error", "powersave");
}

TEST(CheckClocks, AClockThatIsNotSetOrCoarseIsAWarning) {
  Findings findings;
  check_clocks({false, 4'000'000, "jiffies"}, &findings);
  expect_line(findings, "clock of images", "warning", "jiffies, steps of 4000000 ns");
  expect_line(findings, "system clock", "warning", "not synchronised");
  findings = {};
  check_clocks({true, 1, "tsc"}, &findings);
  EXPECT_EQ(findings.worst(), Verdict::kOk);
}

// ---- folders

TEST(CheckFolders, ARecordingNeedsAFolderAndRoom) {
  const Scratch scratch;
  Config config;
  config.control.socket = "none";
  Options options;
  options.record = scratch.path("missing/run.lcm");
  Findings findings;
  check_folders(options, config, {}, &findings);
  expect_line(findings, "recording", "error", "No such file or directory");
  options.record = scratch.path("run.lcm");
  findings = {};
  check_folders(options, config, {}, &findings);
  expect_line(findings, "recording", "ok", "MB free");
  EXPECT_FALSE(std::filesystem::exists(options.record));
  // A limit that no disk has, and a camera that fills any disk within a minute.
  config.record.max_size_mb = 2'000'000'000;
  findings = {};
  check_folders(options, config, {}, &findings);
  expect_line(findings, "recording", "warning", "record.max_size_mb");
  config.record.max_size_mb = 0;
  calibration_t calibration{};
  calibration.cameras.resize(1);
  calibration.cameras[0].width = calibration.cameras[0].height = 2'000'000'000;
  findings = {};
  check_folders(options, config, calibration, &findings);
  expect_line(findings, "recording", "warning", "expected a minute at least");
}

TEST(CheckFolders, StateLogAndCommandsAreHeldAgainstTheirFolders) {
  const Scratch scratch;
  Config config;
  config.state.folder = scratch.path("missing");
  config.log.file = scratch.path("missing/farpointd.log");
  config.control.socket = scratch.path("missing/control");
  Findings findings;
  check_folders({}, config, {}, &findings);
  expect_line(findings, "state", "warning", "missing");
  expect_line(findings, "log file", "error", "missing");
  expect_line(findings, "commands", "warning", "missing");
  config.state.folder = scratch.path("");
  config.log.file = scratch.path("farpointd.log");
  config.control.socket = scratch.path("control");
  findings = {};
  check_folders({}, config, {}, &findings);
  EXPECT_EQ(findings.worst(), Verdict::kOk) << findings.text();
}

}  // namespace
}  // namespace farpoint::daemon
