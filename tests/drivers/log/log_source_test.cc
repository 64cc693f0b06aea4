// SPDX-License-Identifier: Apache-2.0
#include "drivers/log/log_source.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "ipc/channels.h"
#include "tests/ipc/scratch.h"

namespace farpoint::drivers {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kWidth_px = 16, kHeight_px = 8;

calibration_t make_calibration(int cameras) {
  calibration_t out{};
  out.ncameras = cameras;
  out.cameras.resize(static_cast<std::size_t>(cameras));
  for (auto& camera : out.cameras) {
    camera.model = "pinhole-radtan";
    camera.width = kWidth_px;
    camera.height = kHeight_px;
  }
  return out;
}

image_t make_image(std::int64_t utime, int camera = 0) {
  image_t out{};
  out.utime = utime;
  out.camera = camera;
  out.width = kWidth_px;
  out.height = kHeight_px;
  out.pixel_format = image_t::PIXEL_FORMAT_GREY;
  out.size = kWidth_px * kHeight_px;
  out.data.resize(static_cast<std::size_t>(out.size));
  for (std::size_t i = 0; i < out.data.size(); ++i)
    out.data[i] = static_cast<std::uint8_t>(utime + static_cast<std::int64_t>(i));
  return out;
}

imu_t make_imu(std::int64_t utime) {
  imu_t out{};
  out.utime = utime;
  out.acceleration[2] = 9.81;
  out.temperature = kNan;
  return out;
}

ground_truth_t make_truth(std::int64_t utime) {
  ground_truth_t out{};
  out.utime = utime;
  out.orientation[0] = 1;
  return out;
}

wheels_t make_wheels(std::int64_t utime) {
  wheels_t out{};
  out.utime = utime;
  out.speed = 3;
  out.speed_sigma = -1;
  out.yaw_rate = out.steering_angle = kNan;
  return out;
}

// A log made by `fill`, then read through the source.
class LogSourceTest : public testing::Test {
 protected:
  std::vector<LogItem> read(const std::function<void(ipc::LogWriter&)>& fill) {
    ipc::LogWriter writer(scratch_.path("a.lcm"));
    fill(writer);
    writer.close();
    return read_file(scratch_.path("a.lcm"));
  }
  std::vector<LogItem> read_file(const std::string& path) {
    LogSource source(path);
    std::vector<LogItem> out;
    LogItem item;
    while (source.next(&item)) {
      if (item.kind == LogItemKind::kImage) {
        ipc::GreyImage grey;
        if (source.decode(item, &grey) == ipc::ImageStatus::kOk) {
          EXPECT_EQ(grey.width_px, item.image->width);
          ++decoded_;
        }
      }
      out.push_back(item);  // its pointers do not hold any longer
    }
    counts_ = source.counts();
    damage_ = source.damage();
    return out;
  }
  static std::vector<std::int64_t> utimes(const std::vector<LogItem>& items) {
    std::vector<std::int64_t> out;
    for (const LogItem& item : items) out.push_back(item.utime);
    return out;
  }

  test::Scratch scratch_;
  LogSourceCounts counts_;
  ipc::LogDamage damage_;
  int decoded_ = 0;
};

using Times = std::vector<std::int64_t>;

TEST_F(LogSourceTest, GivesEverythingInTheOrderOfTheFileButImagesHeldBack) {
  const auto items = read([](ipc::LogWriter& log) {
    log.write_message("CALIBRATION", 900, make_calibration(2));
    log.write_message("IMU", 901, make_imu(5));
    log.write_message("CAMERA_0", 902, make_image(10));
    log.write_message("GROUND_TRUTH", 903, make_truth(3));
    log.write_message("CAMERA_1", 904, make_image(10, 1));
    log.write_message("OTHER", 905, make_imu(6));
    log.write_message("WHEELS", 906, make_wheels(0));
  });
  // The message's time, not the event's. The first image of a camera waits for a second one, here for the
  // end.
  EXPECT_EQ(utimes(items), (Times{0, 5, 3, 0, 10, 10}));
  ASSERT_EQ(items.size(), 6U);
  EXPECT_EQ(items[0].kind, LogItemKind::kCalibration);
  EXPECT_EQ(items[1].kind, LogItemKind::kImu);
  EXPECT_EQ(items[2].kind, LogItemKind::kGroundTruth);
  EXPECT_EQ(items[3].kind, LogItemKind::kWheels);
  EXPECT_EQ(items[4].kind, LogItemKind::kImage);
  EXPECT_EQ(items[4].camera, 0);
  EXPECT_EQ(items[5].kind, LogItemKind::kImage);
  EXPECT_EQ(items[5].camera, 1);
  EXPECT_EQ(decoded_, 2);
  EXPECT_EQ(counts_.others, 1U);
  EXPECT_EQ(counts_.times_backwards, 0U);
}

TEST_F(LogSourceTest, HandsOutTheMessageItself) {
  {
    ipc::LogWriter writer(scratch_.path("a.lcm"));
    writer.write_message("CAMERA_0", 0, make_image(77));
    writer.close();
  }
  LogSource source(scratch_.path("a.lcm"));
  LogItem item;
  ASSERT_TRUE(source.next(&item));
  ipc::GreyImage grey;
  ASSERT_EQ(source.decode(item, &grey), ipc::ImageStatus::kOk);
  EXPECT_EQ(grey.pixels, make_image(77).data);
  EXPECT_EQ(item.imu, nullptr);
}

TEST_F(LogSourceTest, TimesThatRunBackwardsAreDroppedPerStream) {
  const auto items = read([](ipc::LogWriter& log) {
    for (const std::int64_t utime : {0, 100, 100, 50, 200})
      log.write_message("CAMERA_0", 0, make_image(utime));
    log.write_message("IMU", 0, make_imu(-5));
    log.write_message("IMU", 0, make_imu(-6));
    log.write_message("CAMERA_1", 0, make_image(10, 1));
  });
  EXPECT_EQ(utimes(items), (Times{0, 100, 200, -5, 10}));
  EXPECT_EQ(counts_.times_backwards, 3U);
}

TEST_F(LogSourceTest, OneDamagedTimeDoesNotMakeTheRestLookOld) {
  const auto items = read([](ipc::LogWriter& log) {
    for (const std::int64_t utime :
         {std::int64_t{0}, std::int64_t{100}, std::int64_t{1} << 60, std::int64_t{200}, std::int64_t{300},
          std::numeric_limits<std::int64_t>::max(), std::numeric_limits<std::int64_t>::min(),
          std::int64_t{400}}) {
      log.write_message("CAMERA_0", 0, make_image(utime));
    }
  });
  EXPECT_EQ(utimes(items), (Times{0, 100, 200, 300, 400}));
  EXPECT_EQ(counts_.times_backwards, 3U);
}

TEST_F(LogSourceTest, APauseCostsNoFrame) {
  const auto items = read([](ipc::LogWriter& log) {
    for (const std::int64_t utime : {0, 100, 60'000'000, 60'000'100, 60'000'200}) {
      log.write_message("CAMERA_0", 0, make_image(utime));
    }
  });
  EXPECT_EQ(utimes(items), (Times{0, 100, 60'000'000, 60'000'100, 60'000'200}));
  EXPECT_EQ(counts_.times_backwards, 0U);
}

TEST_F(LogSourceTest, AnyDamagedTimeCostsItsOwnFrameOnly) {
  constexpr int kFrames = 12;
  constexpr std::int64_t kStart_us = 1'700'000'000'000'000, kPeriod_us = 100'000;
  Times all;
  for (int i = 0; i < kFrames; ++i) all.push_back(kStart_us + i * kPeriod_us);
  for (int damaged = 0; damaged < kFrames; ++damaged) {
    // Up to bit 60: a sign that turns is the test above.
    for (int bit = 0; bit < 60; ++bit) {
      const std::int64_t wrong = all[static_cast<std::size_t>(damaged)] ^ (std::int64_t{1} << bit);
      // Where the second time is damaged downwards, two images do not tell which of them is right.
      if (damaged == 1 && wrong < all[0]) continue;
      auto given = utimes(read([&](ipc::LogWriter& log) {
        for (int i = 0; i < kFrames; ++i)
          log.write_message("CAMERA_0", 0,
                            make_image(i == damaged ? wrong : all[static_cast<std::size_t>(i)]));
      }));
      EXPECT_TRUE(std::is_sorted(given.begin(), given.end()));
      EXPECT_EQ(given.size() + counts_.times_backwards, std::size_t{kFrames});
      Times intact = all;
      intact.erase(intact.begin() + damaged);
      std::erase(given, wrong);
      EXPECT_EQ(given, intact) << "frame " << damaged << ", bit " << bit;
    }
  }
}

TEST_F(LogSourceTest, ImagesHeldBackKeepTheirPixels) {
  ipc::LogWriter writer(scratch_.path("a.lcm"));
  for (const std::int64_t utime : {0, 100, 1000, 1100, 5000}) {
    writer.write_message("CAMERA_0", 0, make_image(utime));
    writer.write_message("CAMERA_1", 0, make_image(utime + 1, 1));
  }
  writer.close();
  LogSource source(scratch_.path("a.lcm"));
  LogItem item;
  int images = 0;
  for (; source.next(&item); ++images) {
    ASSERT_EQ(item.kind, LogItemKind::kImage);
    EXPECT_EQ(item.image->utime, item.utime);
    EXPECT_EQ(item.image->camera, item.camera);
    EXPECT_EQ(item.image->data, make_image(item.utime).data);
  }
  EXPECT_EQ(images, 10);
}

TEST_F(LogSourceTest, ImagesTheCalibrationDoesNotKnowAreDropped) {
  const auto items = read([](ipc::LogWriter& log) {
    log.write_message("CALIBRATION", 0, make_calibration(1));
    log.write_message("CAMERA_1", 0, make_image(1, 1));  // no such camera
    log.write_message("CAMERA_0", 0, make_image(2, 1));  // channel and message disagree
    log.write_message("CAMERA_99", 0, make_image(3, 99));
    log.write_message("CAMERA_x", 0, make_image(4));  // another channel
    log.write_message("CAMERA_", 0, make_image(4));
    image_t wide = make_image(5);
    wide.width = kWidth_px + 1;
    log.write_message("CAMERA_0", 0, wide);
    image_t short_of_bytes = make_image(6);
    short_of_bytes.size = 10;
    short_of_bytes.data.resize(10);
    log.write_message("CAMERA_0", 0, short_of_bytes);  // found out when decoded
    image_t unknown = make_image(7);
    unknown.pixel_format = 1;
    log.write_message("CAMERA_0", 0, unknown);
    log.write_message("CAMERA_0", 0, make_image(8));
  });
  EXPECT_EQ(utimes(items), (Times{0, 6, 7, 8}));
  EXPECT_EQ(decoded_, 1);
  EXPECT_EQ(counts_.images_unknown_camera, 3U);
  EXPECT_EQ(counts_.images_wrong_size, 2U);
  EXPECT_EQ(counts_.images_undecodable, 1U);
  EXPECT_EQ(counts_.others, 2U);
}

TEST_F(LogSourceTest, ImagesBeyondTheLimitAreDropped) {
  constexpr std::int64_t kPixels = kWidth_px * kHeight_px;
  {
    ipc::LogWriter log(scratch_.path("a.lcm"));
    log.write_message("CAMERA_0", 0, make_image(1));
    image_t padded = make_image(2);
    padded.data.resize(100'000);
    padded.size = 100'000;
    log.write_message("CAMERA_0", 0, padded);
    log.write_message("CAMERA_0", 0, make_image(3));
    log.close();
  }
  for (const bool fits : {true, false}) {
    LogSource source(scratch_.path("a.lcm"), fits ? kPixels : kPixels - 1);
    LogItem item;
    ipc::GreyImage grey;
    std::uint64_t images = 0;
    for (; source.next(&item); ++images)
      EXPECT_EQ(source.decode(item, &grey), fits ? ipc::ImageStatus::kOk : ipc::ImageStatus::kTooLarge);
    EXPECT_EQ(images, 2U);
    EXPECT_EQ(source.counts().images_wrong_size, 1U) << "the message is longer than any such image";
    EXPECT_EQ(source.counts().images_undecodable, fits ? 0U : 2U);
  }
}

TEST_F(LogSourceTest, ImagesOfOtherCamerasComeWithoutTheirData) {
  {
    ipc::LogWriter log(scratch_.path("a.lcm"));
    log.write_message("CALIBRATION", 0, make_calibration(2));
    for (std::int64_t utime = 100; utime < 1000; utime += 100) {
      log.write_message("CAMERA_0", 0, make_image(utime, 0));
      log.write_message("CAMERA_1", 0, make_image(utime + 7, 1));
    }
    log.close();
  }
  LogSource all(scratch_.path("a.lcm")), first(scratch_.path("a.lcm"), ipc::kMaxImagePixels, 0);
  LogItem of_all, of_first;
  ipc::GreyImage grey;
  int images = 0;
  while (all.next(&of_all)) {
    ASSERT_TRUE(first.next(&of_first));
    EXPECT_EQ(of_all.kind, of_first.kind);
    EXPECT_EQ(of_all.utime, of_first.utime);
    if (of_all.kind != LogItemKind::kImage) continue;
    ++images;
    ASSERT_EQ(of_all.camera, of_first.camera);
    EXPECT_EQ(of_first.image->utime, of_first.utime);
    if (of_first.camera == 0) {
      ASSERT_EQ(first.decode(of_first, &grey), ipc::ImageStatus::kOk);
      EXPECT_EQ(grey.pixels, make_image(of_first.utime).data);
    } else {
      EXPECT_TRUE(of_first.image->data.empty());
    }
  }
  EXPECT_FALSE(first.next(&of_first));
  EXPECT_EQ(images, 18);
}

TEST_F(LogSourceTest, InvalidNumbersAreDropped) {
  const auto items = read([](ipc::LogWriter& log) {
    imu_t imu = make_imu(1);
    imu.angular_velocity[1] = kNan;
    log.write_message("IMU", 0, imu);
    imu = make_imu(2);
    imu.acceleration[0] = -kInfinity;
    log.write_message("IMU", 0, imu);
    imu = make_imu(3);
    imu.acceleration[0] = 1e7;
    log.write_message("IMU", 0, imu);
    log.write_message("IMU", 0, make_imu(1));  // the refused ones left no time behind
    ground_truth_t truth = make_truth(1);
    truth.position[0] = kNan;
    log.write_message("GROUND_TRUTH", 0, truth);
    truth = make_truth(2);
    truth.has_orientation = 1;
    truth.orientation[0] = 0;
    log.write_message("GROUND_TRUTH", 0, truth);
    truth.has_orientation = 0;
    log.write_message("GROUND_TRUTH", 0, truth);
    wheels_t wheels = make_wheels(1);
    wheels.speed = kInfinity;
    log.write_message("WHEELS", 0, wheels);
    wheels.speed = kNan;  // unknown
    log.write_message("WHEELS", 0, wheels);
  });
  EXPECT_EQ(utimes(items), (Times{1, 2, 1}));
  EXPECT_EQ(counts_.imu_invalid, 3U);
  EXPECT_EQ(counts_.ground_truths_invalid, 2U);
  EXPECT_EQ(counts_.wheels_invalid, 1U);
}

TEST_F(LogSourceTest, DamagedMessagesAreDroppedAndTheCalibrationStays) {
  const auto items = read([](ipc::LogWriter& log) {
    log.write_message("CALIBRATION", 0, make_calibration(1));
    const std::vector<std::uint8_t> junk(50, 0xff);
    for (const char* channel : {"CALIBRATION", "CAMERA_0", "IMU", "WHEELS", "GROUND_TRUTH"})
      log.write(channel, 0, junk);
    log.write_message("CAMERA_0", 0, make_image(1));
  });
  EXPECT_EQ(utimes(items), (Times{0, 1}));
  EXPECT_EQ(counts_.messages_undecodable, 5U);
  EXPECT_EQ(decoded_, 1);
}

// Random damage to a whole log: no crash, and what is given out is in order and within its log.
TEST_F(LogSourceTest, SurvivesFlippedBitsAnywhere) {
  ipc::LogWriter writer(scratch_.path("a.lcm"));
  writer.write_message("CALIBRATION", 0, make_calibration(2));
  for (int i = 0; i < 30; ++i) {
    writer.write_message("CAMERA_0", i, make_image(50'000 * i));
    writer.write_message("CAMERA_1", i, make_image(50'000 * i, 1));
    writer.write_message("IMU", i, make_imu(50'000 * i));
  }
  writer.close();
  const auto intact = test::read_bytes(scratch_.path("a.lcm"));
  std::mt19937_64 rng(3);
  for (int round = 0; round < 300; ++round) {
    auto damaged = intact;
    for (int i = 0; i < 5; ++i) {
      auto& byte = damaged[rng() % damaged.size()];
      byte = static_cast<std::uint8_t>(byte ^ (1U << (rng() % 8)));
    }
    if (round % 3 == 0) damaged.resize(rng() % damaged.size());
    test::write_bytes(scratch_.path("b.lcm"), damaged);
    const auto items = read_file(scratch_.path("b.lcm"));
    std::int64_t last = std::numeric_limits<std::int64_t>::min();
    for (const LogItem& item : items) {
      if (item.kind != LogItemKind::kImage || item.camera != 0) continue;
      EXPECT_GT(item.utime, last);
      last = item.utime;
    }
    if (round % 3 != 0) {
      EXPECT_GE(items.size(), 50U) << "five flipped bits cost too much";
    }
  }
}

}  // namespace
}  // namespace farpoint::drivers
