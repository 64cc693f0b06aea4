// SPDX-License-Identifier: Apache-2.0
// Turns a driver's buffer into an image: follows its number, converts its time, copies its pixels to grey,
// and counts refused frames. A stamp of no clock is replaced by the time of arrival. So is each stamp of a
// stream whose stamps went backwards in kBackwards of the last 32 images. Capture thread; no heap call after
// the first image.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "drivers/camera/camera.h"
#include "drivers/camera/camera_time.h"

namespace farpoint::drivers {

// A filled buffer as the driver describes it.
struct RawFrame {
  std::span<const std::uint8_t> bytes;
  CameraFormat format = CameraFormat::kAuto;
  int row_stride = 0;
  bool damaged = false;        // marked by the driver
  std::uint32_t sequence = 0;  // restarts with each stream
  std::int64_t stamp_us = 0;   // of a clock that is detected
  // The moment that the stamp marks; empty: the stamp is the image's time already.
  std::optional<StampPoint> stamp_point;
  double exposure_us = -1.0;  // below 0: unknown
  float gain = -1.0F;         // the same
};

class FrameIntake {
 public:
  // Uses size, readout and time offset of the options.
  explicit FrameIntake(const CameraOptions& options) : options_(options) {}

  // Begins a new stream: the driver's numbers restart, the image's numbers continue.
  void start_stream() {
    last_driver_sequence_.reset();
    backwards_ = 0;
    distrusts_stamps_ = false;
  }
  // Returns false for a refused frame and counts the reason. `now` was read when the frame arrived.
  [[nodiscard]] bool take(const RawFrame& raw, const ClockReadings& now, ipc::GreyImage* image,
                          CameraFrame* frame);

  // This class keeps the counts of frames; its owner keeps opened, lost and stalled.
  CameraCounts counts;

 private:
  void count_sequence(std::uint32_t sequence);
  void judge_stamps(std::int64_t utime);
  [[nodiscard]] std::int64_t time_of(const RawFrame& raw, const ClockReadings& now);
  [[nodiscard]] bool to_grey(const RawFrame& raw, ipc::GreyImage* image);

  static constexpr int kBackwards = 3;

  CameraOptions options_;
  ipc::ImageDecoder decoder_;
  std::int64_t last_utime_ = -1, sequence_ = -1;
  std::optional<std::uint32_t> last_driver_sequence_;
  std::uint32_t backwards_ = 0;  // a bit for each of the last images, the newest lowest
  bool distrusts_stamps_ = false;
};

}  // namespace farpoint::drivers
