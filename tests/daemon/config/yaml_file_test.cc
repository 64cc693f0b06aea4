// SPDX-License-Identifier: Apache-2.0
// Camera files and others: errors of one line, whatever they hold, and a limit of length.
#include "daemon/config/yaml_file.h"

#include <gtest/gtest.h>

#include <fstream>
#include <tuple>

#include "daemon/config/camera_file.h"
#include "daemon/config/config.h"
#include "daemon/config/errors.h"
#include "tests/daemon/run_daemon.h"
#include "tests/ipc/scratch.h"

namespace farpoint::daemon {
namespace {

std::string error_of_camera(const std::string& content) {
  try {
    (void)parse_camera_file(content, "camera.yaml");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(YamlFile, ALineBreakInsideAValueMakesAnErrorOfOneLine) {
  EXPECT_EQ(error_of_camera("model: \"a\\nb\\x1b[2J\"\n"),
            "camera.yaml:1: expected model 'pinhole-radtan' or 'kannala-brandt', found 'a\\nb\\x1b[2J'");
  EXPECT_EQ(error_of_camera("? \"x\\ny\"\n: 1\n").substr(0, 36), "camera.yaml:1: unknown key 'x\\ny', e");
  EXPECT_EQ(error_of_camera("model: [\n\"\n\n").find('\n'), std::string::npos);
}

TEST(YamlFile, ALineBreakInTheConfigurationToo) {
  Config config;
  ConfigOrigins origins;
  try {
    load_config_text("log:\n  level: \"a\\n<0>b\"\n", "f.yaml", &config, &origins);
    FAIL() << "accepted";
  } catch (const ConfigError& error) {
    EXPECT_STREQ(error.what(),
                 "f.yaml:2: log.level: 'a\\n<0>b', expected one of debug | info | warning | error");
  }
}

TEST(YamlFile, TheProgramsLastWordIsOneLineToo) {
  const test::Outcome outcome = test::run_daemon({"--replay", "no\nsuch\x1b[2J.lcm", "--lockstep"});
  EXPECT_EQ(outcome.status, 2);
  EXPECT_EQ(outcome.err_lines(), 1) << outcome.err;
  EXPECT_EQ(outcome.err.find('\x1b'), std::string::npos) << outcome.err;
}

TEST(YamlFile, AReplayOfAnotherRecordersFileNamesIt) {
  const test::Scratch scratch;
  for (const auto& [name, bytes, kind] :
       {std::tuple{"drive.mp4", std::string("\0\0\0\x20", 4) + "ftypisom", "an MP4 or MOV video"},
        std::tuple{"drive.bag", std::string("#ROSBAG V2.0\n"), "a ROS 1 bag"}}) {
    const std::string file = scratch.path(name);
    std::ofstream(file) << bytes;
    const test::Outcome outcome = test::run_daemon({"--replay", file, "--lockstep"});
    EXPECT_EQ(outcome.status, 2);
    EXPECT_EQ(outcome.err_lines(), 1) << outcome.err;
    EXPECT_NE(outcome.err.find(file + ": " + kind + ", expected an LCM log"), std::string::npos)
        << outcome.err;
  }
}

TEST(YamlFile, ALongFileIsRefusedBeforeItIsParsed) {
  const test::Scratch scratch;
  const std::string path = scratch.path("camera.yaml");
  std::ofstream(path) << "model: pinhole-radtan\n" << std::string(kMaxYamlBytes, '#') << "\n";
  for (const std::string& file : {path, std::string("/dev/zero")}) {
    try {
      (void)read_camera_file(file);
      FAIL() << "accepted";
    } catch (const InputError& error) {
      EXPECT_EQ(std::string(error.what()), file + ": longer than 1 MiB, expected a short YAML file");
    }
  }
  EXPECT_EQ(error_of_camera(std::string(kMaxYamlBytes + 1, ' ')),
            "camera.yaml: longer than 1 MiB, expected a short YAML file");
}

}  // namespace
}  // namespace farpoint::daemon
