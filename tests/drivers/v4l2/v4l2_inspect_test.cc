// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/v4l2_inspect.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/drivers/v4l2/fake_v4l2.h"

namespace farpoint::drivers {
namespace {

class V4l2Inspect : public testing::Test {
 protected:
  V4l2Look look() {
    CameraOptions options;
    options.device = "/dev/null";  // a node that is there; the fake opens itself
    options.width_px = fake_.width_px;
    options.height_px = fake_.height_px;
    options.rate_hz = 30;
    const auto system = fake_.make_system();
    return inspect_v4l2(system.get(), options);
  }

  test::FakeV4l2 fake_;
};

TEST_F(V4l2Inspect, TheFormatThatAStartWouldTakeIsNamedAndNothingIsSet) {
  fake_.formats = {CameraFormat::kYuyv, CameraFormat::kMjpeg};
  fake_.fastest_hz = {{CameraFormat::kYuyv, 10}, {CameraFormat::kMjpeg, 60}};
  const V4l2Look found = look();
  EXPECT_EQ(found.error, 0) << found.what;
  EXPECT_EQ(found.path, "/dev/null");
  EXPECT_EQ(found.driver, "fake");
  EXPECT_EQ(found.offered.format, CameraFormat::kMjpeg);
  EXPECT_NEAR(found.offered.fastest_hz, 60.0, 0.01);
  EXPECT_EQ(fake_.set_rate_hz, 0.0);
  EXPECT_EQ(fake_.configured, CameraFormat::kAuto);
  EXPECT_EQ(fake_.mapped, 0);
}

TEST_F(V4l2Inspect, ACameraWithoutTheSizeAndANodeWithoutImagesAreRefused) {
  fake_.formats = {};
  EXPECT_EQ(look().error, ENOTSUP);
  fake_.capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
  EXPECT_NE(look().what.find("it cannot stream images"), std::string::npos);
}

TEST(V4l2InspectByTheKernel, AnAbsentCameraAndAFileThatIsNoneAreTold) {
  CameraOptions options;
  options.device = "/dev/nosuchcamera";
  EXPECT_EQ(inspect_v4l2(options).path, "");
  options.device = "/dev/null";
  EXPECT_EQ(inspect_v4l2(options).what, "it is no V4L2 device");
}

}  // namespace
}  // namespace farpoint::drivers
