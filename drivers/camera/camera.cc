// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/camera.h"

namespace farpoint::drivers {

const char* to_string(CameraFormat format) {
  switch (format) {
    case CameraFormat::kAuto:
      return "any format";
    case CameraFormat::kGrey:
      return "GREY";
    case CameraFormat::kNv12:
      return "NV12";
    case CameraFormat::kYuyv:
      return "YUYV";
    case CameraFormat::kRgb24:
      return "RGB24";
    case CameraFormat::kMjpeg:
      return "MJPEG";
  }
  return "?";
}

}  // namespace farpoint::drivers
