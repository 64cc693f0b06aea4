// SPDX-License-Identifier: Apache-2.0
// A live camera: one interface for all drivers. The capture thread makes all calls except construction,
// destruction, set_exposure() and opening_since_us(). It waits in next() only; next() makes no heap call
// after the first images and writes no log. A listener receives what an operator needs.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "ipc/image_codec.h"

namespace farpoint::drivers {

enum class CameraFormat : std::uint8_t { kAuto, kGrey, kNv12, kYuyv, kRgb24, kMjpeg };
[[nodiscard]] const char* to_string(CameraFormat format);

// Who sets the exposure. kCamera: the camera's automatic. kAuto: AutoExposure, within limits.
enum class ExposureMode : std::uint8_t { kCamera, kAuto, kManual };

struct ExposureOptions {
  ExposureMode mode = ExposureMode::kAuto;
  double manual_us = 5000;
  int manual_gain = 0;  // the camera's own steps
  // kAuto: exposure is preferred up to short_us, then gain up to its share, then exposure up to max_us.
  double short_us = 4000, max_us = 15000;
  double max_gain_share = 1.0;  // of the camera's range
  double target_grey = 110;     // mean of the image
};

// The moment of a frame that the driver's time stamp marks.
enum class StampPoint : std::uint8_t {
  kAuto,             // as the driver says; uvcvideo: start of readout, which it calls start of exposure
  kStartOfExposure,  // of the first row
  kStartOfReadout,   // exposure of the first row has ended
  kEndOfFrame,       // the last row has come
};

struct CameraOptions {
  std::string device = "/dev/video0";  // see camera_path.h
  int index = 0;                       // of the calibration's cameras: N of CAMERA_N
  int width_px = 0, height_px = 0;     // of the calibration; the camera must deliver this size
  double rate_hz = 0;                  // 0: the camera's own
  CameraFormat format = CameraFormat::kAuto;
  int buffers = 4;
  StampPoint stamp_point = StampPoint::kAuto;
  double readout_s = 0;             // from the first row to the last; 0: global shutter or unknown
  std::int64_t time_offset_us = 0;  // added to every image's time
  double stall_s = 1.0;             // without a frame for this time the stream is restarted
  ExposureOptions exposure;
};

// Data of one image.
struct CameraFrame {
  std::int64_t utime = 0;         // mid-exposure of the middle row, CLOCK_MONOTONIC, microseconds
  std::int64_t sequence = 0;      // a gap is a lost frame
  std::int32_t exposure_us = -1;  // -1 unknown
  float gain = -1.0F;             // the camera's own steps; -1 unknown
};

struct CameraCounts {
  std::int64_t frames = 0;           // given out
  std::int64_t missing = 0;          // gaps in the driver's numbers
  std::int64_t flagged = 0;          // marked as damaged by the driver
  std::int64_t undecodable = 0;      // too short, or no JPEG
  std::int64_t times_backwards = 0;  // a time not after the one before it
  std::int64_t times_unknown = 0;    // of no known clock, or of a stream whose stamps
                                     // run backwards; the time of arrival stands in
  std::int64_t opened = 0, lost = 0, stalled = 0;
};

struct CameraEvent {
  enum class Kind : std::uint8_t { kStreaming, kAbsent, kRefused, kLost, kStalled } kind{};
  const char* what = "";  // static text: what failed, or what was expected
  int error = 0;          // errno, 0 for none
  // kStreaming: the negotiated format.
  CameraFormat format = CameraFormat::kAuto;
  double rate_hz = 0;  // 0 unknown
  bool exposure_known = false;
};

class Camera {
 public:
  virtual ~Camera() = default;
  // Waits at most timeout_ms for an image. Returns false without one: the camera is absent (it is searched
  // again here), or the frame was refused and counted.
  [[nodiscard]] virtual bool next(int timeout_ms, ipc::GreyImage* image, CameraFrame* frame) = 0;
  [[nodiscard]] virtual bool is_streaming() const = 0;
  [[nodiscard]] virtual const CameraCounts& counts() const = 0;
  // Callable from any thread. CLOCK_MONOTONIC, microseconds, when the running open or close of the device
  // began, which may block for seconds; kNotOpening while none runs.
  [[nodiscard]] virtual std::int64_t opening_since_us() const { return kNotOpening; }
  static constexpr std::int64_t kNotOpening = -1;
  // Sets the listener, before the first next(). The capture thread calls it; it must not block.
  virtual void on_event(std::function<void(const CameraEvent&)> listener) = 0;
  // Callable from any thread at any time; takes effect with the next image.
  virtual void set_exposure(const ExposureOptions& options) = 0;
};

}  // namespace farpoint::drivers
