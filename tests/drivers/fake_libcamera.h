// libcamera with one camera in memory, for tests of the driver: requests go round as they do there, and what
// a test asks for goes wrong.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "drivers/camera_wait.h"
#include "drivers/libcamera_system.h"

namespace farpoint::test {

// What the camera shows next.
struct FakeShot {
  std::uint32_t sequence = 0;
  std::uint8_t grey = 100;
  std::optional<std::int64_t> stamp_us;  // nothing: now, by CLOCK_MONOTONIC
  drivers::LibcameraFrame::Status status = drivers::LibcameraFrame::Status::kOk;
  std::optional<std::vector<std::uint8_t>> bytes;  // nothing: a plain image
  std::int32_t exposure_us = -1;
  int gain = -1;
};

// What the tests and the driver share. It makes no heap call while it streams, so that a test can see whether
// the driver does.
struct FakeLibcamera {
  FakeLibcamera();

  bool plugged = true;
  bool busy = false;  // another program has it
  std::vector<drivers::CameraFormat> formats{drivers::CameraFormat::kGrey};
  int width_px = 64, height_px = 48;
  int stride_padding = 0;        // bytes
  int requests = 4;              // that it makes, whatever is asked for
  int queue_error = 0;           // of giving back, errno
  drivers::LibcameraStream has;  // controls
  drivers::ClockReadings now{10'000'000, 10'000'000, 1'700'000'000'000'000};

  // A request is filled and finished; false where none is queued, as when frames are lost.
  bool show(const FakeShot& shot);
  void unplug();  // it says so

  // Seen.
  drivers::CameraFormat configured = drivers::CameraFormat::kAuto;
  std::string device;
  int opened = 0, closed = 0, starts = 0;
  std::vector<drivers::LibcameraSetting> settings;  // that changed anything, in order
  std::vector<int> waits_ms;
  [[nodiscard]] int requests_queued() const { return static_cast<int>(queued.size()); }

  drivers::FinishedRequests* finished = nullptr;  // null: closed
  bool streaming = false;
  int row_stride = 0;
  std::vector<std::uint32_t> queued;
  std::vector<drivers::LibcameraFrame> frames;
  std::vector<std::vector<std::uint8_t>> memory;
};

class FakeLibcameraSystem final : public drivers::LibcameraSystem {
 public:
  explicit FakeLibcameraSystem(std::shared_ptr<FakeLibcamera> camera) : camera_(std::move(camera)) {}
  ~FakeLibcameraSystem() override { close(); }
  [[nodiscard]] int open(const char* name, drivers::FinishedRequests* finished, const char** what) override;
  void close() override;
  [[nodiscard]] int configure(drivers::CameraFormat format, int width_px, int height_px, int buffers,
                              drivers::LibcameraStream* stream, const char** what) override;
  [[nodiscard]] int start(const drivers::LibcameraSetting& setting, const char** what) override;
  void read(std::uint32_t request, drivers::LibcameraFrame* frame) override;
  [[nodiscard]] int give_back(std::uint32_t request, const drivers::LibcameraSetting& setting) override;

 private:
  void note(const drivers::LibcameraSetting& setting);
  std::shared_ptr<FakeLibcamera> camera_;
};

// Time passes as it is waited for.
class FakeCameraWait final : public drivers::CameraWait {
 public:
  explicit FakeCameraWait(std::shared_ptr<FakeLibcamera> camera) : camera_(std::move(camera)) {}
  void wait(int fd, int timeout_ms) override;
  [[nodiscard]] drivers::ClockReadings clocks() override { return camera_->now; }

 private:
  std::shared_ptr<FakeLibcamera> camera_;
};

}  // namespace farpoint::test
