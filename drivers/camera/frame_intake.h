// What becomes of a driver's buffer, whichever driver filled it: its number is followed, its time mapped, its
// pixels copied to grey, and what cannot be used is counted. No heap call after the first image.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "drivers/camera/camera.h"
#include "drivers/camera/camera_time.h"

namespace farpoint::drivers {

// A filled buffer in the driver's own terms.
struct RawFrame {
  std::span<const std::uint8_t> bytes;
  CameraFormat format = CameraFormat::kAuto;
  int row_stride = 0;
  bool damaged = false;        // as the driver says
  std::uint32_t sequence = 0;  // starts anew with each stream
  std::int64_t stamp_us = 0;   // by a clock that is to be found out
  // What the stamp stands for; nothing: it is the image's time already.
  std::optional<StampPoint> stamp_point;
  double exposure_us = -1.0;  // below 0: unknown
  float gain = -1.0F;         // the same
};

class FrameIntake {
 public:
  // Takes size, readout and time offset from the options.
  explicit FrameIntake(const CameraOptions& options) : options_(options) {}

  // A new stream: the driver's numbers start anew, ours go on.
  void start_stream() { last_driver_sequence_.reset(); }
  // False where the frame cannot be used; why is counted. `now` was read when the frame came.
  [[nodiscard]] bool take(const RawFrame& raw, const ClockReadings& now, ipc::GreyImage* image,
                          CameraFrame* frame);

  // Those that concern frames are kept here, those of coming and going by whoever owns this.
  CameraCounts counts;

 private:
  void count_sequence(std::uint32_t sequence);
  [[nodiscard]] std::int64_t time_of(const RawFrame& raw, const ClockReadings& now);
  [[nodiscard]] bool to_grey(const RawFrame& raw, ipc::GreyImage* image);

  CameraOptions options_;
  ipc::ImageDecoder decoder_;
  std::int64_t last_utime_ = -1, sequence_ = -1;
  std::optional<std::uint32_t> last_driver_sequence_;
};

}  // namespace farpoint::drivers
