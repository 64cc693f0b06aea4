// SPDX-License-Identifier: Apache-2.0
// ROS 1 bags, as write_bag.py writes them by the format's description: what is read, and what is said about
// damaged, hostile and unsuitable ones.
#include "tools/import/bag.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "tests/ipc/log_events.h"
#include "tests/support/paths.h"
#include "tests/tools/tool_support.h"
#include "tools/import/recording_log.h"
#include "tools/import/ros_message.h"

namespace farpoint::tools {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kStart = 1'600'000'000'000'000;

class ImportBag : public testing::Test {
 protected:
  [[nodiscard]] fs::path bag() const { return root_ / "drive.bag"; }
  void write(const std::string& options = "") const {
    const ProgramResult made =
        run_shell("/usr/bin/python3 '" + test::source_dir() + "/tests/tools/import/write_bag.py' '" +
                  bag().string() + "' " + options);
    ASSERT_EQ(made.status, 0) << made.err;
  }
  [[nodiscard]] std::string complaint(const BagChoice& choice = {}) const {
    return complaint_of([&] { (void)read_bag(bag(), choice); });
  }
  // The images of the log that the recording becomes.
  [[nodiscard]] std::vector<image_t> images_of(const Recording& recording) const {
    write_recording(recording, root_ / "run.lcm");
    return test::messages_of<image_t>((root_ / "run.lcm").string(), "CAMERA_0");
  }
  // Replaces bytes of the bag.
  void patch(const std::string& from, const std::string& to) const { replace_in(bag(), from, to); }

  ScratchFolder root_;
};

TEST_F(ImportBag, ReadsImagesCalibrationImuAndWheels) {
  write();
  BagChoice choice;
  choice.wheels = "/odom";
  const Recording r = read_bag(bag(), choice);
  ASSERT_EQ(r.cameras.size(), 1U);
  EXPECT_EQ(r.cameras[0].parameters.fx_px, 50.0);
  EXPECT_EQ(r.cameras[0].parameters.cy_px, 23.0);
  EXPECT_EQ(r.cameras[0].parameters.fy_px, 51.0);
  EXPECT_EQ(r.cameras[0].parameters.cx_px, 31.0);
  EXPECT_EQ(r.cameras[0].parameters.distortion, (std::array<double, 5>{-0.1, 0.01, 0.002, -0.003, 0.0004}));
  EXPECT_NEAR(r.cameras[0].rate_hz, 20.0, 1e-6);
  ASSERT_EQ(r.images.size(), 3U);
  EXPECT_EQ(r.images[1].utime, kStart + 50'000) << "the header's time, not that of the reception";
  ASSERT_EQ(r.imu.size(), 10U);
  EXPECT_EQ(r.imu[3].utime, kStart + 30'000);
  EXPECT_EQ(r.imu[3].angular_velocity_radps, Eigen::Vector3d(0.1, 0.2, 3.0));
  EXPECT_EQ(r.imu[3].acceleration_mps2, Eigen::Vector3d(0.0, 0.0, 9.81));
  ASSERT_EQ(r.wheels.size(), 4U);
  EXPECT_EQ(r.wheels[2].utime, kStart + 60'000);
  EXPECT_EQ(r.wheels[2].speed_mps, 3.5);
  EXPECT_EQ(r.wheels[2].yaw_rate_radps, 0.25);
  EXPECT_TRUE(r.notices.empty());
}

TEST_F(ImportBag, PixelsAreThoseOfTheMessageRowByRow) {
  write();
  const std::vector<image_t> images = images_of(read_bag(bag(), {}));
  ASSERT_EQ(images.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) {
    ASSERT_EQ(images[i].pixel_format, image_t::PIXEL_FORMAT_GREY);
    ASSERT_EQ(images[i].size, 64 * 48);
    for (std::size_t y = 0; y < 48; ++y)
      for (std::size_t x = 0; x < 64; ++x) ASSERT_EQ(images[i].data[64 * y + x], (x + y + i) % 256);
  }
}

TEST_F(ImportBag, ColourBecomesLuma) {
  const std::vector<std::pair<std::string, double>> weights = {
      {"rgb8", 0.299}, {"bgr8", 0.114}, {"yuv422", 1.0}};
  for (const auto& [encoding, weight] : weights) {
    write("--encoding " + encoding);
    const std::vector<image_t> images = images_of(read_bag(bag(), {}));
    ASSERT_EQ(images.size(), 3U) << encoding;
    for (std::size_t x = 0; x < 64; ++x)
      EXPECT_NEAR(images[0].data[64 * 40 + x], weight * static_cast<double>(x + 40), 0.51) << encoding;
  }
}

TEST_F(ImportBag, CompressedImagesKeepTheirBytes) {
  const std::string jpeg = make_image(".jpg", 64, 48, 3);
  put(root_ / "a.jpg", jpeg);
  write("--jpeg '" + (root_ / "a.jpg").string() + "'");
  const Recording r = read_bag(bag(), {});
  EXPECT_EQ(r.cameras[0].parameters.fx_px, 50.0) << "camera_info stands beside image_raw";
  const std::vector<image_t> images = images_of(r);
  ASSERT_EQ(images.size(), 3U);
  EXPECT_EQ(images[2].pixel_format, image_t::PIXEL_FORMAT_MJPEG);
  EXPECT_EQ(std::string(images[2].data.begin(), images[2].data.end()), jpeg);
}

TEST_F(ImportBag, ABagWithoutIndexIsReadToo) {
  write("--unindexed");
  EXPECT_EQ(read_bag(bag(), {}).images.size(), 3U);
}

TEST_F(ImportBag, TopicsAreListedAndChosen) {
  write("--second-camera");
  const std::vector<BagTopic> topics = list_bag(bag());
  ASSERT_EQ(topics.size(), 6U);
  EXPECT_EQ(topics[1].name, "/cam0/image_raw");
  EXPECT_EQ(topics[1].type, "sensor_msgs/Image");
  EXPECT_EQ(topics[1].messages, 3U);
  expect_all_in(complaint(), {"drive.bag", "--image", "/cam0/image_raw, /cam1/image_raw"});
  BagChoice choice;
  choice.image = "/cam0/image_raw";
  choice.imu = "none";
  const Recording r = read_bag(bag(), choice);
  EXPECT_EQ(r.images.size(), 3U);
  EXPECT_TRUE(r.imu.empty());
  EXPECT_TRUE(r.wheels.empty()) << "odometry is taken only where it is asked for";
  choice.image = "/cam9";
  expect_all_in(complaint(choice), {"--image /cam9: no such topic", "/cam1/image_raw"});
  choice.image = "/imu";
  expect_all_in(complaint(choice), {"--image /imu: of type sensor_msgs/Imu"});
  choice.image = "/cam1/image_raw";
  expect_all_in(complaint(choice), {"no message on /cam1/camera_info", "--camera FILE"});
}

TEST_F(ImportBag, SaysWhatItCannotRead) {
  write("--compression lz4");
  expect_all_in(complaint(), {"drive.bag: byte ", "compressed by lz4", "rosbag decompress"});
  write("--compression zip");
  expect_all_in(complaint(), {"unknown compression"});
  write("--encoding bayer_rggb8");
  expect_all_in(complaint(), {"encoding 'bayer_rggb8'", "mono8"});
  write("--no-info");
  expect_all_in(complaint(), {"no message on /cam0/camera_info", "--camera FILE"});
  put(bag(), "#ROSBAG V1.2\n");
  expect_all_in(complaint(), {"#ROSBAG V2.0"});
  put(bag(), "PK\x03\x04");
  expect_all_in(complaint(), {"a ZIP archive", "a ROS 1 bag"});
  put(bag(), "");
  expect_all_in(complaint(), {"#ROSBAG V2.0"});
  fs::remove(bag());
  expect_all_in(complaint(), {"cannot be opened"});
}

TEST_F(ImportBag, LengthsBeyondTheFileAreRefusedBeforeMemoryIsTaken) {
  write();
  const std::string whole = get(bag());
  const std::size_t chunk = whole.find("compression=none");
  ASSERT_NE(chunk, std::string::npos);
  // The record's header, then a field of it, then the chunk's data: each longer than what is left.
  const std::size_t data_length = whole.find("size=", chunk) + 9;
  for (const std::size_t at : {std::size_t{13}, std::size_t{17}, data_length}) {
    std::string damaged = whole;
    damaged.replace(at, 4, "\xf0\xff\xff\xff");
    put(bag(), damaged);
    expect_all_in(complaint(), {"drive.bag: byte "});
  }
  // Pixels: a length beyond the message counts as damage.
  std::string damaged = whole;
  const std::size_t encoding = whole.find("mono8");
  damaged.replace(encoding + 5 + 1 + 4, 4, "\xf0\xff\xff\xff");
  put(bag(), damaged);
  const Recording r = read_bag(bag(), {});
  EXPECT_EQ(r.images.size(), 2U);
  ASSERT_EQ(r.notices.size(), 1U);
  expect_all_in(r.notices[0], {"1 damaged messages"});
}

TEST_F(ImportBag, ACutOffBagIsRefusedWhereverItEnds) {
  write();
  const std::string whole = get(bag());
  const std::size_t chunk = whole.find("compression=none");
  for (std::size_t size = 14; size < chunk + 200; size += 7) {
    put(bag(), whole.substr(0, size));
    (void)complaint();
  }
  // Behind the first image too: nothing of a cut chunk is taken for all there is.
  const std::size_t last = whole.rfind("chunk_pos=");
  ASSERT_NE(last, std::string::npos);
  for (std::size_t size = chunk + 200; size < chunk + 9000; size += 97) {
    put(bag(), whole.substr(0, size));
    expect_all_in(complaint(), {"byte ", "rosbag reindex"});
  }
}

// camera_info has the raw image's lens: with rectified pixels its distortion were applied twice.
TEST_F(ImportBag, RectifiedImagesNeedACameraFile) {
  write("--image-name /cam0/image_rect");
  expect_all_in(complaint(), {"/cam0/image_rect", "rectified", "/cam0/camera_info", "--camera FILE"});
}

TEST_F(ImportBag, DamagedBytesNeverCrash) {
  write("--encoding rgb8");
  const std::string whole = get(bag());
  std::mt19937 random(5);
  int read = 0;
  for (int round = 0; round < 150; ++round) {
    std::string damaged = whole;
    for (int i = 0; i < 3; ++i)
      damaged[random() % (round % 2 == 0 ? 4000 : damaged.size())] = static_cast<char>(random());
    put(bag(), damaged);
    try {
      write_recording(read_bag(bag(), {}), root_ / "run.lcm");
      ++read;
    } catch (const std::exception& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    }
  }
  EXPECT_GT(read, 20);
}

TEST_F(ImportBag, TheProgramListsAndImports) {
  write();
  const std::string file = "import bag '" + bag().string() + "'";
  const ProgramResult list = run_farpoint_program(file + " --list");
  EXPECT_EQ(list.status, 0);
  EXPECT_NE(list.out.find("sensor_msgs/Image                 /cam0/image_raw\n"), std::string::npos)
      << list.out;
  const ProgramResult done =
      run_farpoint_program(file + " --wheels /odom -o '" + (root_ / "run.lcm").string() + "'");
  EXPECT_EQ(done.status, 0) << done.err;
  EXPECT_NE(done.out.find("1 camera, 3 images (0 missing), 0.1 s, 10 IMU samples"), std::string::npos)
      << done.out;
  const ProgramResult refused = run_farpoint_program(file);
  EXPECT_EQ(refused.status, 2);
  EXPECT_NE(refused.err.find("--output"), std::string::npos);
}

// ---- CDR, as ROS 2 packs messages ----

TEST(RosFields, CdrAlignsAndCountsTheZeroOfTexts) {
  const std::vector<std::uint8_t> message = {
      0,    1, 0,    0,                                                // little-endian CDR
      7,    0, 0,    0,    0x40, 0x42, 0x0f, 0,                        // 7 s, 1000000 ns
      3,    0, 0,    0,    'a',  'b',  0,    0xee, 5, 0, 0,    0,      // "ab", a gap, 5
      0xee, 0, 0xee, 0xee, 0,    0,    0,    0,    0, 0, 0xf0, 0x3f};  // a gap, 1.0
  RosFields fields(message, RosPacking::kCdr);
  EXPECT_EQ(fields.header_utime(), 7'001'000);
  EXPECT_EQ(fields.u32(), 5U);
  EXPECT_EQ(fields.f64(), 1.0);
  EXPECT_TRUE(fields.ok());
  EXPECT_EQ(fields.u8(), 0);
  EXPECT_FALSE(fields.ok());
}

}  // namespace
}  // namespace farpoint::tools
