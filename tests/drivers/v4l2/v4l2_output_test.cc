// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/v4l2_output.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "tests/drivers/v4l2/fake_v4l2_output.h"

namespace farpoint::drivers {
namespace {

using test::FakeOutput;

constexpr OutputFormat kFormat{6, 4, 20.0};
constexpr std::size_t kPixels = 24;

std::vector<std::uint8_t> image(std::uint8_t number) {
  std::vector<std::uint8_t> pixels(kPixels);
  for (std::size_t i = 0; i < kPixels; ++i) pixels[i] = static_cast<std::uint8_t>(10 * number + i);
  return pixels;
}

std::string complaint(FakeOutput* device, const std::string& path = "/dev/video10") {
  try {
    const V4l2Output output(path, kFormat, device->make_system());
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(device->opened, device->closed);
    EXPECT_EQ(device->mapped, device->unmapped);
    EXPECT_EQ(device->streaming, 0);
    return error.what();
  }
  return "";
}

TEST(V4l2Output, ImagesArriveWithTheirTimes) {
  FakeOutput device;
  {
    V4l2Output output("/dev/video10", kFormat, device.make_system());
    EXPECT_NEAR(device.rate_hz, 20.0, 1e-3);
    for (std::uint8_t i = 0; i < 11; ++i) ASSERT_EQ(output.send(image(i), 7'999'990 + 50'000 * i), 0);
  }
  ASSERT_EQ(device.images.size(), 11U);
  for (std::uint8_t i = 0; i < 11; ++i) {
    EXPECT_EQ(device.images[i].bytes, image(i));
    EXPECT_EQ(device.images[i].stamp_us, 7'999'990 + 50'000 * i);
    EXPECT_EQ(device.images[i].flags, std::uint32_t{V4L2_BUF_FLAG_TIMESTAMP_COPY});
    EXPECT_EQ(device.images[i].index, i % 4U) << "the buffer that was with the device for longest";
  }
  EXPECT_EQ(device.closed, 1);
  EXPECT_EQ(device.mapped, device.unmapped);
  EXPECT_EQ(device.streaming, 0);
}

TEST(V4l2Output, RowsMayBePadded) {
  FakeOutput device;
  device.stride_padding = 2;
  V4l2Output output("/dev/video10", kFormat, device.make_system());
  ASSERT_EQ(output.send(image(3), 1), 0);
  ASSERT_EQ(device.images[0].bytes.size(), 32U);
  for (std::size_t row = 0; row < 4; ++row)
    for (std::size_t x = 0; x < 6; ++x) EXPECT_EQ(device.images[0].bytes[8 * row + x], image(3)[6 * row + x]);
}

TEST(V4l2Output, AnImageThatFindsNoBufferCanBeSentLater) {
  FakeOutput device;
  V4l2Output output("/dev/video10", kFormat, device.make_system());
  for (std::uint8_t i = 0; i < 4; ++i) ASSERT_EQ(output.send(image(i), i), 0);
  device.held = 1;
  EXPECT_EQ(output.send(image(4), 4), -EAGAIN);
  device.held = 0;
  EXPECT_EQ(output.send(image(4), 4), 0);
  EXPECT_EQ(device.images.size(), 5U);
  EXPECT_EQ(device.images[4].bytes, image(4));
}

TEST(V4l2Output, UnpluggedIsSaid) {
  FakeOutput device;
  device.unplugged_after = 2;
  V4l2Output output("/dev/video10", kFormat, device.make_system());
  EXPECT_EQ(output.send(image(0), 0), 0);
  EXPECT_EQ(output.send(image(1), 1), 0);
  EXPECT_EQ(output.send(image(2), 2), -ENODEV);
}

TEST(V4l2Output, WhatADeviceLacksIsNamed) {
  FakeOutput device;
  device.present = false;
  EXPECT_EQ(complaint(&device), "/dev/video10: cannot be opened (No such file or directory)");
  device = {};
  device.capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  EXPECT_NE(complaint(&device).find("/dev/video10: is no video output device"), std::string::npos);
  device = {};
  device.capabilities = V4L2_CAP_VIDEO_OUTPUT | V4L2_CAP_READWRITE;
  EXPECT_EQ(complaint(&device), "/dev/video10: is an output device that cannot stream");
  device = {};
  device.keeps_its_size = true;
  EXPECT_EQ(complaint(&device),
            "/dev/video10: gives 640x480 YUYV, expected 6x4 GREY (another program may hold it)");
  device = {};
  device.most_buffers = 1;
  EXPECT_EQ(complaint(&device), "/dev/video10: gives 1 buffers, expected 2 at least");
}

TEST(V4l2Output, BusyIsSaidWhereverItShows) {
  const std::string busy = "/dev/video10: is busy: another program uses it (Device or resource busy)";
  for (int FakeOutput::*where :
       {&FakeOutput::format_errno, &FakeOutput::buffers_errno, &FakeOutput::start_errno}) {
    FakeOutput device;
    device.*where = EBUSY;
    EXPECT_EQ(complaint(&device), busy);
  }
}

TEST(V4l2Output, AFileIsNoVideoDevice) {
  try {
    const V4l2Output output("/dev/null", kFormat, std::make_unique<LinuxV4l2System>());
    FAIL() << "expected a complaint";
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(std::string(error.what()), "/dev/null: is no video device (Inappropriate ioctl for device)");
  }
}

}  // namespace
}  // namespace farpoint::drivers
