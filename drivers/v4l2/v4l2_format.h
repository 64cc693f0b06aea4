// SPDX-License-Identifier: Apache-2.0
// Negotiates the format of a V4L2 camera.
#pragma once

#include <array>
#include <cstdint>

#include "drivers/camera/camera.h"
#include "drivers/v4l2/v4l2_system.h"

namespace farpoint::drivers {

// An open node that streams images.
struct V4l2Node {
  int fd = -1;
  bool multiplanar = false;       // luma is then in the first plane
  std::array<char, 17> driver{};  // its name for itself
  [[nodiscard]] std::uint32_t buffer_type() const;
};

struct AgreedFormat {
  CameraFormat format = CameraFormat::kAuto;
  int row_stride = 0;
  double rate_hz = 0;  // 0: unknown
};

// Checks the node's capabilities. Returns 0, or negative errno; *what names the failed step.
[[nodiscard]] int identify(V4l2System* system, V4l2Node* node, const char** what);

// A format that the driver's lists have.
struct OfferedFormat {
  CameraFormat format = CameraFormat::kAuto;
  double fastest_hz = 0;  // at the options' size; 0: unknown

  // True where the driver's lists allow the rate, and where they hold none.
  [[nodiscard]] bool reaches(double rate_hz) const;
};

// The format that agree_on_format() tries first. Sets nothing. Returns and *what as there.
[[nodiscard]] int find_format(V4l2System* system, const V4l2Node& node, const CameraOptions& options,
                              OfferedFormat* offered, const char** what);

// Sets format and rate. The size must be that of the options. Of the formats that reach the rate, or come
// nearest, the one cheapest to convert to grey wins. Returns 0 or negative errno.
[[nodiscard]] int agree_on_format(V4l2System* system, const V4l2Node& node, const CameraOptions& options,
                                  AgreedFormat* agreed, const char** what);

}  // namespace farpoint::drivers
