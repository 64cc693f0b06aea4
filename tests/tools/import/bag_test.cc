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
#include "tools/import/chunk.h"
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
  [[nodiscard]] std::vector<image_t> images_of(const Recording& recording,
                                               const std::string& channel = "CAMERA_0") const {
    write_recording(recording, root_ / "run.lcm");
    return test::messages_of<image_t>((root_ / "run.lcm").string(), channel);
  }
  // Imports it with other bytes at places by chance; returns how often that was read.
  [[nodiscard]] int read_damaged(const std::string& whole, const BagChoice& choice,
                                 std::mt19937* random) const {
    int read = 0;
    for (int round = 0; round < 150; ++round) {
      std::string damaged = whole;
      for (int i = 0; i < 3; ++i)
        damaged[(*random)() % (round % 2 == 0 ? 4000 : damaged.size())] = static_cast<char>((*random)());
      put(bag(), damaged);
      if (passes_or_says_one_line([&] { write_recording(read_bag(bag(), choice), root_ / "run.lcm"); }))
        ++read;
    }
    return read;
  }

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

// ---- compressed chunks ----

TEST_F(ImportBag, CompressedChunksAreReadAsPlainOnes) {
  for (const char* options : {"--compression bz2", "--compression lz4", "--compression bz2 --split",
                              "--compression lz4 --split", "--split"}) {
    write(options);
    const Recording r = read_bag(bag(), {});
    EXPECT_EQ(r.imu.size(), 10U) << options;
    EXPECT_TRUE(r.notices.empty()) << options;
    const std::vector<image_t> images = images_of(r);
    ASSERT_EQ(images.size(), 3U) << options;
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < images[i].data.size(); ++k)
        ASSERT_EQ(images[i].data[k], (k % 64 + k / 64 + i) % 256) << options << " " << i << " " << k;
  }
}

TEST_F(ImportBag, AChunkOfAnotherSizeThanItDeclaresIsRefused) {
  for (const std::string compression : {"bz2", "lz4"}) {
    for (const char* size : {"1", "1000", "20000"}) {
      write("--compression " + compression + " --size " + size);
      expect_all_in(complaint(), {"drive.bag: byte ", "a damaged chunk", std::string(size) + " bytes"});
    }
    // Before memory is taken.
    write("--compression " + compression + " --size 4294967295");
    expect_all_in(complaint(), {"a chunk of 4294967295 bytes, expected at most 128 MiB"});
  }
}

TEST_F(ImportBag, DamageInACompressedChunkNamesTheByteThere) {
  write("--compression bz2");
  const std::string whole = get(bag());
  put(bag(), whole.substr(0, whole.find("BZh") + 500));
  expect_all_in(complaint(), {"are left", "rosbag reindex"});
  std::string damaged = whole;
  damaged[whole.find("BZh") + 300] ^= 1;
  put(bag(), damaged);
  expect_all_in(complaint(), {"drive.bag: byte ", "a damaged chunk"});
  write("--compression lz4 --encoding bayer_rggb8");
  expect_all_in(complaint(), {"compressed chunk, its byte ", "bayer_rggb8"});
}

TEST(Chunks, AContentThatIsLongerThanDeclaredEnds) {
  const std::string packed = run_shell("head -c 300000 /dev/zero | lz4 -q -c").out;
  const std::string bz2 = run_shell("head -c 300000 /dev/zero | bzip2 -c").out;
  const std::string zstd = run_shell("head -c 300000 /dev/zero | zstd -q -c").out;
  for (const auto& [kind, bytes] :
       {std::pair{Compression::kLz4, packed}, {Compression::kBz2, bz2}, {Compression::kZstd, zstd}}) {
    EXPECT_EQ(decompress(kind, bytes, 300'000).value().view(), std::string(300'000, '\0'));
    for (const std::uint64_t size : {0, 1, 65'536, 299'999, 300'001, 1'000'000})
      EXPECT_EQ(decompress(kind, bytes, size).has_value(), size == 0)
          << static_cast<int>(kind) << " " << size;
    for (std::size_t cut = 0; cut < bytes.size(); cut += 3)
      EXPECT_FALSE(decompress(kind, bytes.substr(0, cut), 300'000).has_value()) << cut;
  }
}

// ---- topics ----

TEST_F(ImportBag, ATopicOfTwoTypesIsReadByItsType) {
  write("--two-types std_msgs/String");
  const std::vector<BagTopic> topics = list_bag(bag());
  ASSERT_EQ(topics.size(), 6U);
  EXPECT_EQ(topics[1].name, topics[2].name);
  EXPECT_EQ(topics[1].type, "sensor_msgs/Image");
  EXPECT_EQ(topics[1].messages, 3U);
  EXPECT_EQ(topics[2].type, "std_msgs/String");
  EXPECT_EQ(topics[2].messages, 1U);
  BagChoice choice;
  for (const char* name : {"", "/cam0/image_raw"}) {
    choice.image = name;
    const Recording r = read_bag(bag(), choice);
    EXPECT_EQ(r.images.size(), 3U);
    EXPECT_TRUE(r.notices.empty()) << "the text is no damaged image";
  }
  write("--two-types sensor_msgs/CompressedImage");
  choice.image = "/cam0/image_raw";
  expect_all_in(complaint(choice), {"--image /cam0/image_raw",
                                    "sensor_msgs/CompressedImage and sensor_msgs/Image", "of one type"});
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
  write("--compression zip");
  expect_all_in(complaint(), {"drive.bag: byte ", "unknown compression", "bz2 or lz4"});
  write("--encoding bayer_rggb8");
  expect_all_in(complaint(), {"encoding 'bayer_rggb8'", "mono8"});
  write("--no-info");
  expect_all_in(complaint(), {"no message on /cam0/camera_info", "--camera FILE"});
  put(bag(), "#ROSBAG V1.2\n");
  expect_all_in(complaint(), {"#ROSBAG V2.0"});
  put(bag(), "PK\x03\x04");
  expect_all_in(complaint(), {"a ZIP archive", "expected a ROS 1 or ROS 2 bag"});
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

TEST_F(ImportBag, AnUnknownDistortionModelIsNamedWithTheKnownOnes) {
  write("--model 'Kannala\\Brandt \"4\"'");
  expect_all_in(complaint(), {"drive.bag, /cam0/camera_info:3:", "found 'Kannala?Brandt ?4?'", "'plumb_bob'",
                              "'rational_polynomial'", "'equidistant'"});
}

// ---- two cameras, truth and wheels ----

class ImportBagPair : public ImportBag {
 protected:
  ImportBagPair() {
    choice_.image = "/cam0/image_raw";
    choice_.second_image = "/cam1/image_raw";
  }
  BagChoice choice_;
};

TEST_F(ImportBagPair, ImagesOfTwoCamerasAreNumberedAsPairs) {
  write("--stereo");
  Recording r = read_bag(bag(), choice_);
  ASSERT_EQ(r.images.size(), 6U);
  EXPECT_EQ(r.missing_images, 0U);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(r.images[i].camera, static_cast<int>(i % 2));
    EXPECT_EQ(r.images[i].sequence, static_cast<std::int64_t>(i / 2));
  }
  EXPECT_EQ(r.images[3].utime, kStart + 52'000) << "each image keeps its own time";
  const std::vector<image_t> right = images_of(r, "CAMERA_1");
  ASSERT_EQ(right.size(), 3U);
  EXPECT_EQ(right[1].data[64 * 5 + 7], 40 + 1 + 5 + 7);
  keep_part(1, 1, "drive.bag", &r);
  ASSERT_EQ(r.images.size(), 2U) << "a part is counted in pairs";
  EXPECT_EQ(r.images[1].camera, 1);
}

TEST_F(ImportBagPair, ImagesFarApartAreNoPair) {
  write("--stereo --late 5000000");
  EXPECT_EQ(read_bag(bag(), choice_).missing_images, 0U);
  write("--stereo --late 5001000");
  const Recording r = read_bag(bag(), choice_);
  EXPECT_EQ(r.missing_images, 6U);
  EXPECT_EQ(r.images.back().sequence, 5);
}

TEST_F(ImportBagPair, TheSecondCamerasPlaceFollowsFromTheRectification) {
  write("--stereo");
  const Recording r = read_bag(bag(), choice_);
  ASSERT_EQ(r.cameras.size(), 2U);
  // 0.12 m to the right, which is the body's -y, and turned: its x axis points down.
  EXPECT_TRUE(r.cameras[1].T_body_camera.t.isApprox(Eigen::Vector3d(0, -0.12, 0)));
  EXPECT_TRUE((r.cameras[1].T_body_camera.q * Eigen::Vector3d(1, 0, 0)).isApprox(Eigen::Vector3d(0, 0, -1)));
  EXPECT_TRUE(r.cameras[0].T_body_camera.t.isZero());
}

TEST_F(ImportBagPair, WithoutARelativePoseTheFilesAreAskedFor) {
  write("--stereo --no-baseline");
  expect_all_in(complaint(choice_), {"/cam1/camera_info has no rectification", "--second-camera"});
  const std::string lens =
      "model: pinhole-radtan\nwidth_px: 64\nheight_px: 48\nfx_px: 50\nfy_px: 51\ncx_px: 31\ncy_px: 23\n"
      "distortion: []\n";
  put(root_ / "left.yaml", lens);
  put(root_ / "right.yaml", lens + "mount: {y_m: -0.3}\n");
  choice_.camera_file = root_ / "left.yaml";
  expect_all_in(complaint(choice_), {"--camera and --second-camera", "or neither"});
  choice_.second_camera_file = root_ / "right.yaml";
  expect_all_in(complaint(choice_), {"left.yaml: no T_body_camera", "both"});
  put(root_ / "left.yaml", lens + "mount: {y_m: 0.1}\n");
  const Recording r = read_bag(bag(), choice_);
  EXPECT_EQ(r.cameras[0].T_body_camera.t.y(), 0.1);
  EXPECT_EQ(r.cameras[1].T_body_camera.t.y(), -0.3);
  choice_.second_image.clear();
  expect_all_in(complaint(choice_), {"--second-camera", "with --second-image"});
  choice_.second_image = choice_.image;
  expect_all_in(complaint(choice_), {"is the first camera's topic"});
}

TEST_F(ImportBagPair, TruthComesFromPosesTransformsAndPoints) {
  write("--stereo");
  BagChoice choice;
  choice.image = "/cam0/image_raw";
  for (const char* topic : {"/pose", "/transform", "/point"}) {
    choice.truth = topic;
    const Recording r = read_bag(bag(), choice);
    ASSERT_EQ(r.truth.size(), 3U) << topic;
    EXPECT_EQ(r.truth[2].utime, kStart + 102'000);
    EXPECT_EQ(r.truth[2].T_world_body.t, Eigen::Vector3d(3, 2, 3)) << topic;
    EXPECT_EQ(r.truth_has_orientation, std::string(topic) != "/point");
    if (r.truth_has_orientation) {
      EXPECT_EQ(r.truth[2].T_world_body.q.z(), 1.0) << "half a turn about z";
    }
    ASSERT_EQ(r.notices.size(), 1U);
    expect_all_in(r.notices[0], {topic, "is taken as the camera's place"});
  }
  choice.truth = "/odom";
  EXPECT_EQ(read_bag(bag(), choice).truth.at(1).T_world_body.t, Eigen::Vector3d(1, 2, 3));
  choice.truth = "/imu";
  expect_all_in(complaint(choice), {"--truth /imu: of type sensor_msgs/Imu", "/odom", "/transform"});
  choice.truth.clear();
  choice.wheels = "/twist";
  const Recording r = read_bag(bag(), choice);
  ASSERT_EQ(r.wheels.size(), 3U);
  EXPECT_EQ(r.wheels[1].speed_mps, 2.5);
  EXPECT_TRUE(r.truth.empty());
}

TEST_F(ImportBagPair, ATruthThatIsNoRotationIsDamage) {
  write("--stereo");
  std::string whole = get(bag());
  // The quaternion 0 0 1 0 of the first pose, behind its position.
  const std::string position = std::string("\0\0\0\0\0\0\0\x40\0\0\0\0\0\0\x08\x40", 16);
  const std::size_t at =
      whole.find(position + std::string(16, '\0'), whole.rfind("conn=", whole.find("map")));
  ASSERT_NE(at, std::string::npos);
  whole[at + 16 + 23] = '\x40';
  put(bag(), whole);
  choice_.truth = "/pose";
  const Recording r = read_bag(bag(), choice_);
  EXPECT_EQ(r.truth.size(), 2U);
  expect_all_in(r.notices.at(0), {"1 damaged messages"});
}

TEST_F(ImportBag, DamagedBytesNeverCrash) {
  std::mt19937 random(5);
  int read = 0;
  for (const char* options : {"--encoding rgb8", "--stereo --split --compression lz4"}) {
    write(options);
    const std::string whole = get(bag());
    BagChoice choice;
    choice.image = "/cam0/image_raw";
    if (std::string(options).starts_with("--stereo")) choice.second_image = "/cam1/image_raw";
    read += read_damaged(whole, choice, &random);
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
