// Which device node a camera is, however it was named:
//   /dev/video0           a path
//   by-id:NAME            of /dev/v4l/by-id
//   usb:1-2.3             whatever camera is plugged into this USB port (lsusb -t, /sys/bus/usb/devices)
#pragma once

#include <array>
#include <string>

namespace farpoint::drivers {

// Finds the node without a heap call: a camera that was unplugged comes back under another number.
class CameraPath {
 public:
  // `root` stands before /dev and /sys; tests have their own.
  explicit CameraPath(std::string name, std::string root = "");

  // "" where `name` can be used, else what is wrong with it and what was expected.
  [[nodiscard]] static std::string check(const std::string& name);

  // The path to open; null where no such camera is there now. Valid until the next call.
  [[nodiscard]] const char* find();

 private:
  [[nodiscard]] bool is_at_port(int number);

  std::string root_, path_, port_;  // of path_ and port_ one is empty
  std::array<char, 512> buffer_{};
};

}  // namespace farpoint::drivers
