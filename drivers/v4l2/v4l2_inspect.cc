// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/v4l2_inspect.h"

#include <fcntl.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>

#include "drivers/camera/camera_path.h"

namespace farpoint::drivers {
namespace {

// Its descriptors cannot write, and it has no thread for controls.
class ReadingSystem final : public V4l2System {
 public:
  int open(const char* path) override {
    const int fd = ::open(path, O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    return fd < 0 ? -errno : fd;
  }
  void close(int fd) override { ::close(fd); }
  int ioctl(int fd, unsigned long request, void* argument) override {
    return ::ioctl(fd, request, argument) < 0 ? -errno : 0;
  }
  void* map(int /*fd*/, std::size_t /*bytes*/, std::int64_t /*offset*/) override { return nullptr; }
  void unmap(void* /*memory*/, std::size_t /*bytes*/) override {}
  bool start_controls(ControlJob* /*job*/) override { return false; }
  bool finished_controls() override { return false; }
  void wait_for_controls() override {}
};

}  // namespace

V4l2Look inspect_v4l2(V4l2System* system, const CameraOptions& options, const std::string& root) {
  V4l2Look look;
  CameraPath place(options.device, root);
  const char* path = place.find();
  look.what = "there is no such camera";
  look.error = ENOENT;
  if (path == nullptr) return look;
  look.path = path;
  V4l2Node node;
  node.fd = system->open(path);
  look.what = "it cannot be opened";
  look.error = node.fd < 0 ? -node.fd : 0;
  if (node.fd < 0) return look;
  const char* what = "";
  int status = identify(system, &node, &what);
  look.driver = node.driver.data();
  if (status >= 0) status = find_format(system, node, options, &look.offered, &what);
  system->close(node.fd);
  look.error = status < 0 ? -status : 0;
  look.what = status < 0 ? what : "";
  return look;
}

V4l2Look inspect_v4l2(const CameraOptions& options) {
  ReadingSystem system;
  return inspect_v4l2(&system, options);
}

}  // namespace farpoint::drivers
