// SPDX-License-Identifier: Apache-2.0
// The part of libcamera that Farpoint uses, in plain types: the interface of the module. Only the module
// links libcamera, since its libraries would be locked in farpointd's memory unused; only camera.driver
// libcamera loads the module (libcamera_loader.h). Tests implement the same interface.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "drivers/camera/auto_exposure.h"
#include "drivers/camera/camera.h"
#include "drivers/libcamera/finished_requests.h"

namespace farpoint::drivers {

// Gains are in hundredths: 100 is libcamera's 1.0.
constexpr double kLibcameraGainUnit = 0.01;

// The negotiated stream.
struct LibcameraStream {
  int row_stride = 0;
  int requests = 0;  // each has one buffer
  // Controls that the camera has.
  bool has_auto_exposure = false;  // that can be switched on and off
  bool has_exposure = false, has_gain = false, has_frame_duration = false;
  ExposureRange range;  // of what it has
};

// Controls to set; empty ones stay unchanged. Setting a control that the camera lacks is an error.
struct LibcameraSetting {
  std::optional<bool> auto_exposure;
  std::optional<std::int32_t> exposure_us;
  std::optional<int> gain;
  std::optional<std::int64_t> frame_duration_us;
};

// A finished request. The bytes are valid until it is queued again.
struct LibcameraFrame {
  enum class Status : std::uint8_t { kOk, kDamaged, kCancelled } status = Status::kOk;
  std::span<const std::uint8_t> bytes;  // of the plane that holds luma, or everything
  std::uint32_t sequence = 0;           // of the driver; a gap is a lost frame
  std::int64_t stamp_us = 0;
  std::int32_t exposure_us = -1;  // as the camera reports it; -1: not reported
  int gain = -1;
};

// Errors are negative errno; *what (static text) names the failed step. One thread makes all calls.
class LibcameraSystem {
 public:
  virtual ~LibcameraSystem() = default;
  // Searches the camera, by libcamera's id or by its number in libcamera's list, and acquires it. -ENOENT: no
  // such camera. Until close(), libcamera's thread may write to `finished`.
  [[nodiscard]] virtual int open(const char* name, FinishedRequests* finished, const char** what) = 0;
  // Allowed in every state. Stops and releases everything; blocks until libcamera's threads have finished.
  virtual void close() = 0;
  // Requires this format and size, else -ENOTSUP. Allocates and maps the buffers.
  [[nodiscard]] virtual int configure(CameraFormat format, int width_px, int height_px, int buffers,
                                      LibcameraStream* stream, const char** what) = 0;
  // Queues all requests.
  [[nodiscard]] virtual int start(const LibcameraSetting& setting, const char** what) = 0;
  virtual void read(std::uint32_t request, LibcameraFrame* frame) = 0;
  // Queues a finished request again, with the controls to set from it on.
  [[nodiscard]] virtual int give_back(std::uint32_t request, const LibcameraSetting& setting) = 0;
};

// Names that the module exports. The interface number refuses a module of another build.
constexpr int kLibcameraInterface = 1;
using LibcameraInterfaceFunction = int (*)();
using MakeLibcameraFunction = LibcameraSystem* (*)();
constexpr const char* kLibcameraInterfaceName = "farpoint_libcamera_interface";
constexpr const char* kMakeLibcameraName = "farpoint_make_libcamera";

}  // namespace farpoint::drivers
