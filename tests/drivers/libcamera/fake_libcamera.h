// SPDX-License-Identifier: Apache-2.0
// libcamera with one camera in memory, for tests of the driver: requests go round as they do there, and what
// a test asks for goes wrong.
#pragma once

#include "drivers/libcamera/libcamera_device.h"
#include "tests/drivers/camera/fake_camera.h"

namespace farpoint::test {

class FakeLibcamera final : public FakeCamera {
 public:
  FakeLibcamera();
  [[nodiscard]] std::unique_ptr<drivers::CameraDevice> make_device(drivers::CameraOptions options) override;
  void give_exposure_and_gain() override;
  [[nodiscard]] bool show(const FakeShot& shot) override;
  void unplug() override;  // reported by its signal
  void fail_stream() override;
  [[nodiscard]] bool is_readable(int fd) const override;

  bool busy = false;             // another program has it
  int requests = 4;              // that it makes, whatever is asked for
  drivers::LibcameraStream has;  // controls
  // Of each image; -1: it does not report it.
  std::int32_t reported_exposure_us = -1;
  int reported_gain = -1;

  // Seen.
  std::vector<drivers::LibcameraSetting> settings;  // that changed anything, in order
  drivers::FinishedRequests* finished = nullptr;    // null: closed

 private:
  class System;
  void note(const drivers::LibcameraSetting& setting);

  bool streaming_ = false;
  std::vector<drivers::LibcameraFrame> frames_;
};

}  // namespace farpoint::test
