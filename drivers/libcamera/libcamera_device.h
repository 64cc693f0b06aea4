// SPDX-License-Identifier: Apache-2.0
// A camera by libcamera.
//
// libcamera's signals arrive on its own thread and only pass on the number of the finished request
// (finished_requests.h). The capture thread does the rest and waits for that number only. Frames are copied
// once, from buffers mapped at the start of the stream; the request is then queued again.
//
// Heap: this class makes no heap call after the first images of a stream. libcamera does, on the calling
// thread, when a request is queued: it rebuilds lists of controls and posts a message to its thread, under a
// mutex held for some instructions. Opening and starting a camera allocates and may take as long as libcamera
// needs to enumerate all devices.
#pragma once

#include <memory>
#include <string>

#include "drivers/camera/camera_device.h"
#include "drivers/libcamera/libcamera_exposure.h"
#include "drivers/libcamera/libcamera_system.h"

namespace farpoint::drivers {

class LibcameraDevice final : public CameraDevice {
 public:
  LibcameraDevice(const CameraOptions& options, std::unique_ptr<LibcameraSystem> system);
  ~LibcameraDevice() override;
  LibcameraDevice(const LibcameraDevice&) = delete;
  LibcameraDevice& operator=(const LibcameraDevice&) = delete;

  // Returns "" where options.device can name a camera of libcamera, else the error and the expected form.
  [[nodiscard]] static std::string check(const std::string& name);

  [[nodiscard]] CameraEvent open() override;
  void close() override;
  [[nodiscard]] int fd() const override { return finished_.fd(); }
  [[nodiscard]] int take(RawFrame* raw, const char** what) override;
  [[nodiscard]] int give_back(const char** what) override;
  void adapt_exposure(const ipc::GreyImage& image) override;
  void set_exposure(const ExposureOptions& options) override;

 private:
  [[nodiscard]] int set_up(const char** what);
  [[nodiscard]] int agree_on_format(const char** what);
  [[nodiscard]] RawFrame describe(const LibcameraFrame& finished) const;

  CameraOptions options_;
  std::unique_ptr<LibcameraSystem> system_;
  FinishedRequests finished_;
  LibcameraStream stream_;
  CameraFormat format_ = CameraFormat::kAuto;
  std::uint32_t taken_ = 0;  // the request
  LibcameraExposure exposure_;
  LibcameraSetting next_setting_;  // for the next request that is queued
};

}  // namespace farpoint::drivers
