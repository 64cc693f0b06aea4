// SPDX-License-Identifier: Apache-2.0
// MCAP recordings of ROS 2, as write_mcap.py writes them by the format's description.
#include "tools/import/mcap.h"

#include <gtest/gtest.h>

#include <array>

#include "tests/ipc/log_events.h"
#include "tests/support/paths.h"
#include "tests/tools/tool_support.h"
#include "tools/import/bag.h"
#include "tools/import/recording_log.h"

namespace farpoint::tools {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kStart = 1'600'000'000'000'000;

class ImportMcap : public testing::Test {
 protected:
  [[nodiscard]] fs::path file() const { return root_ / "drive.mcap"; }
  void write(const std::string& options = "") const {
    const ProgramResult made =
        run_shell("/usr/bin/python3 '" + test::source_dir() + "/tests/tools/import/write_mcap.py' '" +
                  file().string() + "' " + options);
    ASSERT_EQ(made.status, 0) << made.err;
  }
  [[nodiscard]] std::string complaint() const {
    return complaint_of([&] { (void)read_bag(file(), {}); });
  }

  ScratchFolder root_;
};

TEST_F(ImportMcap, ReadsImagesCalibrationImuAndWheels) {
  for (const char* options : {"", "--chunks"}) {
    write(options);
    BagChoice choice;
    choice.wheels = "/odom";
    const Recording r = read_bag(file(), choice);
    EXPECT_EQ(r.cameras[0].parameters.fx_px, 50.0);
    EXPECT_EQ(r.cameras[0].parameters.cy_px, 23.0);
    EXPECT_EQ(r.cameras[0].parameters.fy_px, 51.0);
    EXPECT_EQ(r.cameras[0].parameters.cx_px, 31.0);
    EXPECT_EQ(r.cameras[0].parameters.distortion, (std::array<double, 5>{-0.1, 0.01, 0.002, -0.003, 0.0004}));
    ASSERT_EQ(r.images.size(), 3U);
    EXPECT_EQ(r.images[1].utime, kStart + 50'000);
    ASSERT_EQ(r.imu.size(), 10U);
    EXPECT_EQ(r.imu[3].angular_velocity_radps, Eigen::Vector3d(0.1, 0.2, 3.0));
    EXPECT_EQ(r.imu[3].acceleration_mps2, Eigen::Vector3d(0.0, 0.0, 9.81));
    ASSERT_EQ(r.wheels.size(), 4U);
    EXPECT_EQ(r.wheels[2].speed_mps, 3.5);
    EXPECT_EQ(r.wheels[2].yaw_rate_radps, 0.25);
  }
}

TEST_F(ImportMcap, PixelsAreThoseOfTheMessage) {
  for (const char* options : {"", "--chunks", "--compression lz4", "--compression zstd",
                              "--compression lz4 --split", "--compression zstd --split"}) {
    write(options);
    write_recording(read_bag(file(), {}), root_ / "run.lcm");
    std::size_t images = 0;
    for (const image_t& image : test::messages_of<image_t>((root_ / "run.lcm").string(), "CAMERA_0")) {
      ASSERT_EQ(image.size, 64 * 48);
      for (std::size_t i = 0; i < image.data.size(); ++i)
        ASSERT_EQ(image.data[i], (i % 64 + i / 64 + images) % 256) << options << " " << i;
      ++images;
    }
    EXPECT_EQ(images, 3U) << options;
  }
}

TEST_F(ImportMcap, AChunkOfAnotherSizeThanItDeclaresIsRefused) {
  for (const std::string compression : {"lz4", "zstd"}) {
    for (const char* size : {"1", "1000", "30000"}) {
      write("--compression " + compression + " --size " + size);
      expect_all_in(complaint(), {"drive.mcap: byte ", "a damaged chunk", std::string(size) + " bytes"});
    }
    write("--compression " + compression + " --size 1000000000000000000");
    expect_all_in(complaint(), {"a chunk of 1000000000000000000 bytes, expected at most 128 MiB"});
  }
}

TEST_F(ImportMcap, TopicsHaveTheNamesOfTheirTypesAndEncodings) {
  write();
  const std::vector<BagTopic> topics = list_bag(file());
  ASSERT_EQ(topics.size(), 5U);
  EXPECT_EQ(topics[1].type, "sensor_msgs/Image");
  EXPECT_EQ(topics[1].messages, 3U);
  EXPECT_EQ(topics[3].type, "json sensor_msgs/Image") << "which is no image for the importer";
}

TEST_F(ImportMcap, SaysWhatItCannotRead) {
  write("--compression brotli");
  expect_all_in(complaint(), {"drive.mcap: byte ", "unknown compression", "lz4 or zstd"});
  write("--open");
  expect_all_in(complaint(), {"cut off", "mcap recover"});
  write();
  const std::string whole = get(file());
  put(file(), whole.substr(0, whole.size() / 2));
  expect_all_in(complaint(), {"are left", "mcap recover"});
  // A record, and a chunk's records, longer than the file.
  std::string damaged = whole;
  damaged.replace(9, 8, "\xf0\xff\xff\xff\xff\xff\xff\x7f");
  put(file(), damaged);
  expect_all_in(complaint(), {"byte 8:", "are left"});
}

TEST_F(ImportMcap, DamagedBytesNeverCrash) {
  std::mt19937 random(6);
  int read = 0;
  for (const char* options : {"", "--chunks", "--compression zstd --split"}) {
    write(options);
    const std::string whole = get(file());
    for (int round = 0; round < 150; ++round) {
      std::string damaged = whole;
      for (int i = 0; i < 3; ++i)
        damaged[random() % (round % 2 == 0 ? 3000 : damaged.size())] = static_cast<char>(random());
      put(file(), damaged);
      if (passes_or_says_one_line([&] { write_recording(read_bag(file(), {}), root_ / "run.lcm"); })) ++read;
    }
  }
  EXPECT_GT(read, 20);
}

}  // namespace
}  // namespace farpoint::tools
