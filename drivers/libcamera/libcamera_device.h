// A camera by libcamera.
//
// libcamera's signals arrive on a thread of its own and only pass on the number of the finished request
// (finished_requests.h); all else is the capture thread's, whose one wait is for that. Frames are copied
// once, out of buffers that were mapped when the stream began, and the request is queued again at once.
//
// Heap: while it streams this makes no heap call after the first images. libcamera itself does, on the
// calling thread, when a request is queued again: it empties and fills lists of controls, and sends its own
// thread a message, under a mutex of its own that is held for some instructions. Finding and starting a
// camera allocates, and may take as long as libcamera needs to look through all devices.
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

  // "" where options.device can name a camera of libcamera's, else what is wrong and what was expected.
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
