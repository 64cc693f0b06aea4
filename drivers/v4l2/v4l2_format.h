// Which of its formats a V4L2 camera is asked for.
#pragma once

#include <array>
#include <cstdint>

#include "drivers/camera/camera.h"
#include "drivers/v4l2/v4l2_system.h"

namespace farpoint::drivers {

// An open node that can stream images.
struct V4l2Node {
  int fd = -1;
  bool multiplanar = false;       // luma is then in the first plane
  std::array<char, 17> driver{};  // as it calls itself
  [[nodiscard]] std::uint32_t buffer_type() const;
};

struct AgreedFormat {
  CameraFormat format = CameraFormat::kAuto;
  int row_stride = 0;
  double rate_hz = 0;  // 0: unknown
};

// Checks what the node can do. 0, or negative errno with *what telling what failed.
[[nodiscard]] int identify(V4l2System* system, V4l2Node* node, const char** what);

// Sets format and rate: the size must be that of the options; of the formats that reach the rate (or else
// come nearest) the one that costs least to turn into grey. 0, or negative errno.
[[nodiscard]] int agree_on_format(V4l2System* system, const V4l2Node& node, const CameraOptions& options,
                                  AgreedFormat* agreed, const char** what);

}  // namespace farpoint::drivers
