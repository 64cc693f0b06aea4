// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/camera_path.h"

#include <fcntl.h>
#include <unistd.h>

#include <climits>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string_view>

namespace farpoint::drivers {
namespace {

constexpr std::string_view kById = "by-id:", kUsb = "usb:";
constexpr int kMaxNodes = 64;  // nodes that are looked at; the kernel's own limit is 256 of all kinds

// One camera has several nodes; the one that gives images is its first (index 0).
bool is_first_of_its_camera(const char* root, int number) {
  std::array<char, 512> path;
  std::snprintf(path.data(), path.size(), "%s/sys/class/video4linux/video%d/index", root, number);
  const int fd = open(path.data(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return false;
  char digit = 0;
  const bool read_one = read(fd, &digit, 1) == 1;
  close(fd);
  return read_one && digit == '0';
}

}  // namespace

CameraPath::CameraPath(std::string name, std::string root) : root_(std::move(root)) {
  if (name.starts_with(kUsb)) {
    port_ = name.substr(kUsb.size());
  } else {
    path_ = root_ + (name.starts_with(kById) ? "/dev/v4l/by-id/" + name.substr(kById.size()) : name);
  }
}

std::string CameraPath::check(const std::string& name) {
  const std::string expected =
      ", expected a path like /dev/video0, by-id:NAME (of /dev/v4l/by-id) or usb:PORT like usb:1-2.3";
  if (name.starts_with("/") && name.size() > 1) return "";
  if (name.starts_with(kById) && name.size() > kById.size() && name.find('/') == std::string::npos) return "";
  if (name.starts_with(kUsb)) {
    const std::string port = name.substr(kUsb.size());
    const std::size_t dash = port.find('-');
    const bool digits = port.find_first_not_of("0123456789.-") == std::string::npos;
    if (digits && dash != std::string::npos && dash > 0 && dash + 1 < port.size()) return "";
  }
  return "'" + name + "' names no camera" + expected;
}

const char* CameraPath::find() {
  if (port_.empty()) return access(path_.c_str(), F_OK) == 0 ? path_.c_str() : nullptr;
  for (int number = 0; number < kMaxNodes; ++number) {
    if (!is_at_port(number)) continue;
    std::snprintf(buffer_.data(), buffer_.size(), "%s/dev/video%d", root_.c_str(), number);
    return buffer_.data();
  }
  return nullptr;
}

// The node's folder in sysfs lies below that of the USB interface, PORT:CONFIGURATION.INTERFACE.
bool CameraPath::is_at_port(int number) {
  std::array<char, PATH_MAX> real;
  std::snprintf(buffer_.data(), buffer_.size(), "%s/sys/class/video4linux/video%d", root_.c_str(), number);
  if (realpath(buffer_.data(), real.data()) == nullptr) return false;
  const std::string_view place(real.data());
  for (std::size_t at = place.find(port_); at != std::string_view::npos; at = place.find(port_, at + 1)) {
    const std::size_t end = at + port_.size();
    if (at > 0 && place[at - 1] == '/' && end < place.size() && place[end] == ':')
      return is_first_of_its_camera(root_.c_str(), number);
  }
  return false;
}

}  // namespace farpoint::drivers
