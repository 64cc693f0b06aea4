// SPDX-License-Identifier: Apache-2.0
// A V4L2 camera in memory, for tests of the driver: it answers the same requests with the same structures as
// the kernel does, and does wrong what a test asks for.
#pragma once

#include <linux/videodev2.h>

#include <cerrno>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "drivers/v4l2/v4l2_device.h"
#include "tests/drivers/camera/fake_camera.h"

namespace farpoint::test {

class FakeV4l2 final : public FakeCamera {
 public:
  FakeV4l2();
  [[nodiscard]] std::unique_ptr<drivers::CameraDevice> make_device(drivers::CameraOptions options) override;
  // The calls alone; opens /dev/null.
  [[nodiscard]] std::unique_ptr<drivers::V4l2System> make_system();
  void give_exposure_and_gain() override;
  [[nodiscard]] bool show(const FakeShot& shot) override;
  void unplug() override;  // reported by errors
  void fail_stream() override { stream_error_ = EIO; }
  [[nodiscard]] bool is_readable(int fd) const override;

  std::string driver = "fake";
  std::uint32_t capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  bool takes_other_size = false;                                // S_FMT changes what was asked for
  std::map<drivers::CameraFormat, double> fastest_hz;           // 30 where it does not say
  std::uint32_t flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;      // of each image
  std::optional<std::int64_t> stamp_s;                          // seconds of each stamp, whatever was shown
  std::map<std::uint32_t, std::pair<int, int>> control_ranges;  // that it has
  std::map<std::uint32_t, int> controls;                        // as set

  // Seen.
  double set_rate_hz = 0;
  int mapped = 0, unmapped = 0;

 private:
  class System;
  struct Image {
    Filled filled;
    std::uint32_t sequence = 0, flags = 0;
    std::int64_t stamp_us = 0;
  };

  int stream_error_ = 0;  // of the next DQBUF, errno
  v4l2_pix_format set_{};
  std::vector<Image> images_;  // to be taken
};

}  // namespace farpoint::test
