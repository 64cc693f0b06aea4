// SPDX-License-Identifier: Apache-2.0
// Finds the device node of a camera by one of three names:
//   /dev/video0           a path
//   by-id:NAME            of /dev/v4l/by-id
//   usb:1-2.3             the camera in this USB port (lsusb -t, /sys/bus/usb/devices)
#pragma once

#include <array>
#include <string>

namespace farpoint::drivers {

// Finds the node without a heap call. A replugged camera may get another number, so the search is repeated.
class CameraPath {
 public:
  // `root` is put before /dev and /sys, for tests.
  explicit CameraPath(std::string name, std::string root = "");

  // Returns "" for a usable name, else the error and the expected forms.
  [[nodiscard]] static std::string check(const std::string& name);

  // Returns the path to open, null without such a camera. Valid until the next call.
  [[nodiscard]] const char* find();

 private:
  [[nodiscard]] bool is_at_port(int number);

  std::string root_, path_, port_;  // of path_ and port_ one is empty
  std::array<char, 512> buffer_{};
};

}  // namespace farpoint::drivers
