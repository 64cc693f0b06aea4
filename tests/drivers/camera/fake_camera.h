// SPDX-License-Identifier: Apache-2.0
// A camera in memory, whichever driver is to drive it: what tests ask of all of them.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "drivers/camera/camera_device.h"
#include "drivers/camera/camera_wait.h"

namespace farpoint::test {

// What the camera shows next.
struct FakeShot {
  std::uint32_t sequence = 0;
  std::uint8_t grey = 100;
  std::optional<std::int64_t> stamp_us{};  // nothing: now, by CLOCK_MONOTONIC
  bool damaged = false;
  std::optional<std::vector<std::uint8_t>> bytes{};  // nothing: a plain image
};

// It makes no heap call while it streams, so that a test can see whether the driver does.
class FakeCamera {
 public:
  FakeCamera();
  virtual ~FakeCamera() = default;
  FakeCamera(const FakeCamera&) = delete;
  FakeCamera& operator=(const FakeCamera&) = delete;

  // The driver's device for this camera, which must outlive it. Opens it by the name that it has.
  [[nodiscard]] virtual std::unique_ptr<drivers::CameraDevice> make_device(
      drivers::CameraOptions options) = 0;

  // It can set its exposure, from 100 us to 50 ms, and its gain.
  virtual void give_exposure_and_gain() = 0;
  // False where the driver has no buffer queued, as when frames are lost.
  [[nodiscard]] virtual bool show(const FakeShot& shot) = 0;
  virtual void unplug() = 0;
  // The stream ends with EIO; the camera is still there.
  virtual void fail_stream() = 0;
  // Whether who waits for fd is woken.
  [[nodiscard]] virtual bool is_readable(int fd) const = 0;
  void pass(std::int64_t us);

  bool plugged = true;
  std::function<void()> on_open, on_close;  // while the device opens and closes
  std::vector<drivers::CameraFormat> formats{drivers::CameraFormat::kGrey};
  int width_px = 64, height_px = 48;
  int stride_padding = 0;   // bytes
  int give_back_error = 0;  // errno
  drivers::ClockReadings now{10'000'000, 10'000'000, 1'700'000'000'000'000};

  // Seen.
  drivers::CameraFormat configured = drivers::CameraFormat::kAuto;
  int opened = 0, closed = 0, streams = 0;
  std::vector<int> waits_ms;
  [[nodiscard]] int buffers_queued() const { return static_cast<int>(queued_.size()); }
  // As set last.
  std::optional<double> exposure_us;
  std::optional<int> gain;
  std::optional<bool> is_automatic;  // exposure
  int gain_min = 0, gain_max = 0;

 protected:
  struct Filled {
    std::uint32_t buffer = 0;
    std::size_t bytes = 0;
  };
  // The buffer that was queued first; nothing: none is queued.
  [[nodiscard]] std::optional<Filled> fill(const FakeShot& shot);

  std::vector<std::uint32_t> queued_;
  std::vector<std::vector<std::uint8_t>> memory_;  // of each buffer
};

// Time passes as it is waited for.
class FakeCameraWait final : public drivers::CameraWait {
 public:
  explicit FakeCameraWait(FakeCamera* camera) : camera_(camera) {}
  void wait(int fd, int timeout_ms) override;
  [[nodiscard]] drivers::ClockReadings clocks() override { return camera_->now; }

 private:
  FakeCamera* camera_;
};

}  // namespace farpoint::test
