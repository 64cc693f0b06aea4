// SPDX-License-Identifier: Apache-2.0
#include "daemon/config/mask_file.h"

#include <gtest/gtest.h>

#include <fstream>

#include "ipc/image_encoder.h"
#include "tests/daemon/run_daemon.h"
#include "tests/daemon/synthetic_log.h"
#include "tests/support/bonnet.h"

namespace farpoint::daemon {
namespace {

void put(const std::string& path, const std::vector<std::uint8_t>& bytes) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

// A PNG file whose upper rows, of `height`, are masked.
std::vector<std::uint8_t> png(int width, int height, int masked_rows) {
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(width * height), 255);
  std::fill_n(pixels.begin(), width * masked_rows, std::uint8_t{0});
  return ipc::encode_png({width, height, pixels});
}

class MaskFile : public testing::Test {
 protected:
  // What read_mask() says of these bytes for a camera of 64 x 48 pixels.
  std::string refusal_of(const std::vector<std::uint8_t>& bytes) {
    put(config_.mask, bytes);
    return refusal();
  }
  [[nodiscard]] std::string refusal() const {
    try {
      (void)read_mask(config_, 0, 64, 48);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  }
  [[nodiscard]] std::string expected(const std::string& what) const {
    return "configuration: camera.mask: " + config_.mask + ": " + what;
  }

  test::Scratch scratch_;
  CameraConfig config_ = [this] {
    CameraConfig config;
    config.mask = scratch_.path("mask.png");
    return config;
  }();
};

TEST_F(MaskFile, ZeroIsMasked) {
  put(config_.mask, png(64, 48, 12));
  const auto mask = read_mask(config_, 0, 64, 48);
  ASSERT_NE(mask, nullptr);
  EXPECT_NEAR(mask->share(), 0.25, 1e-12);
  EXPECT_TRUE(mask->touches({5, 11}, 0));
  EXPECT_FALSE(mask->touches({5, 12}, 0));
}

TEST_F(MaskFile, EachCameraHasItsOwnKey) {
  config_.second_mask = scratch_.path("second.png");
  put(config_.mask, png(64, 48, 12));
  put(config_.second_mask, png(32, 24, 12));
  EXPECT_NEAR(read_mask(config_, 1, 32, 24)->share(), 0.5, 1e-12);
  EXPECT_EQ(read_mask(config_, 2, 64, 48), nullptr);
  config_.mask = "none";
  EXPECT_EQ(read_mask(config_, 0, 64, 48), nullptr);
}

TEST_F(MaskFile, AnotherSizeThanTheCamerasIsRefused) {
  EXPECT_EQ(refusal_of(png(64, 47, 5)), expected("64 x 47 pixels, expected the camera's 64 x 48"));
}

TEST_F(MaskFile, OnlyPngOf8BitGreyIsTaken) {
  const std::string wanted = ", expected a PNG file of 8-bit grey";
  EXPECT_EQ(refusal(), expected("cannot be opened (No such file or directory)" + wanted));
  EXPECT_EQ(refusal_of({1, 2, 3}), expected("no image" + wanted));
  const std::vector<std::uint8_t> grey(64 * 48, 255);
  EXPECT_EQ(refusal_of(ipc::encode_jpeg({64, 48, grey}, 90)), expected("a JPEG file" + wanted));
  std::vector<std::uint8_t> other = png(64, 48, 5);
  other[25] = 2;
  EXPECT_EQ(refusal_of(other), expected("8-bit RGB" + wanted));
  other[24] = 1, other[25] = 3;
  EXPECT_EQ(refusal_of(other), expected("1-bit palette" + wanted));
  std::vector<std::uint8_t> cut = png(64, 48, 5);
  cut.resize(cut.size() / 2);
  EXPECT_NE(refusal_of(cut), "");
}

TEST_F(MaskFile, MoreThanNineTenthsAreRefused) {
  EXPECT_EQ(refusal_of(png(64, 48, 43)), "");
  EXPECT_EQ(refusal_of(png(64, 48, 44)), expected("masks 91.7 % of the image, expected at most 90 %"));
}

TEST(MaskedReplay, AMaskOfAnotherSizeStopsTheStartWithStatusTwoAndOneLine) {
  const test::Scratch scratch;
  test::write_synthetic_log(scratch.path("run.lcm"), {.frames = 3});
  put(scratch.path("mask.png"), png(64, 48, 5));
  const test::Outcome outcome = test::run_daemon({"--replay", scratch.path("run.lcm"), "--lockstep", "--set",
                                                  "camera.mask=" + scratch.path("mask.png")});
  EXPECT_EQ(outcome.status, 2);
  EXPECT_EQ(outcome.err, "farpointd: configuration: camera.mask: " + scratch.path("mask.png") +
                             ": 64 x 48 pixels, expected the camera's 480 x 320\n");
}

// The daemon's output, of images with and without a noisy bonnet below the mask.
TEST(MaskedReplay, NoOutputDependsOnMaskedPixels) {
  const test::Scratch scratch;
  test::write_synthetic_log(scratch.path("plain.lcm"), {});
  test::paint_bonnet(scratch.path("plain.lcm"), scratch.path("painted.lcm"), {.noise = 4});
  put(scratch.path("mask.png"), ipc::encode_png({480, 320, test::Bonnet(480, 320, {}).mask()}));
  const auto live_trajectory = [&](const std::string& log, const std::string& mask) {
    const test::Outcome outcome =
        test::run_daemon({"--replay", scratch.path(log + ".lcm"), "--lockstep", "--live-trajectory",
                          scratch.path("live.tum"), "--set", "camera.mask=" + mask});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return test::text_of(scratch.path("live.tum"));
  };
  const std::string mask = scratch.path("mask.png"), plain = live_trajectory("plain", mask);
  EXPECT_GT(std::count(plain.begin(), plain.end(), '\n'), 10);
  EXPECT_EQ(live_trajectory("painted", mask), plain);
  EXPECT_NE(live_trajectory("painted", "none"), plain);
}

}  // namespace
}  // namespace farpoint::daemon
