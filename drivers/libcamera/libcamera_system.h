// What Farpoint needs of libcamera, in plain types: the border of a module of its own. libcamera pulls in
// libraries that farpointd would have to lock in memory whether it uses them or not, so that only the module
// links it, and only a configuration that asks for it loads the module (libcamera_loader.h). Tests stand in
// for it at the same border.
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

// What was agreed upon.
struct LibcameraStream {
  int row_stride = 0;
  int requests = 0;  // each has one buffer
  // Which controls the camera has.
  bool has_auto_exposure = false;  // that can be switched on and off
  bool has_exposure = false, has_gain = false, has_frame_duration = false;
  ExposureRange range;  // of what it has
};

// Controls to be set; those without a value stay as they are. Setting one that the camera has not is an
// error.
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
  std::uint32_t sequence = 0;           // of the driver: gaps are frames that never came
  std::int64_t stamp_us = 0;
  std::int32_t exposure_us = -1;  // as the camera reports it; -1: it does not
  int gain = -1;
};

// Errors are negative errno, with *what (static text) telling what failed. All calls are of one thread.
class LibcameraSystem {
 public:
  virtual ~LibcameraSystem() = default;
  // Looks for the camera anew and takes it: by libcamera's id, or as a number in the order of its list.
  // -ENOENT: it is not there. Until close(), libcamera's thread may write to `finished`.
  [[nodiscard]] virtual int open(const char* name, FinishedRequests* finished, const char** what) = 0;
  // Of whatever state: stops, gives everything back. Blocks until libcamera's threads have let go.
  virtual void close() = 0;
  // Just this format and size, or -ENOTSUP. Buffers are made and mapped.
  [[nodiscard]] virtual int configure(CameraFormat format, int width_px, int height_px, int buffers,
                                      LibcameraStream* stream, const char** what) = 0;
  // Queues all requests.
  [[nodiscard]] virtual int start(const LibcameraSetting& setting, const char** what) = 0;
  virtual void read(std::uint32_t request, LibcameraFrame* frame) = 0;
  // Queues a request that was finished, with what is to be set from it on.
  [[nodiscard]] virtual int give_back(std::uint32_t request, const LibcameraSetting& setting) = 0;
};

// What the module exports, by these names. A module of another build is refused by its number.
constexpr int kLibcameraInterface = 1;
using LibcameraInterfaceFunction = int (*)();
using MakeLibcameraFunction = LibcameraSystem* (*)();
constexpr const char* kLibcameraInterfaceName = "farpoint_libcamera_interface";
constexpr const char* kMakeLibcameraName = "farpoint_make_libcamera";

}  // namespace farpoint::drivers
