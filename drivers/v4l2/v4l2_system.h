// SPDX-License-Identifier: Apache-2.0
// The system calls of a V4L2 camera. Tests implement them in place of the kernel.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/camera/control_writer.h"

namespace farpoint::drivers {

// Each method wraps the call of its name; errors are negative errno. No heap calls.
class V4l2System {
 public:
  virtual ~V4l2System() = default;
  [[nodiscard]] virtual int open(const char* path) = 0;
  virtual void close(int fd) = 0;
  // Repeats the call after a signal.
  [[nodiscard]] virtual int ioctl(int fd, unsigned long request, void* argument) = 0;
  // Returns null on failure.
  [[nodiscard]] virtual void* map(int fd, std::size_t bytes, std::int64_t offset) = 0;
  virtual void unmap(void* memory, std::size_t bytes) = 0;

  // VIDIOC_S_CTRL without waiting for the camera; see ControlWriter. close() waits for a running call.
  [[nodiscard]] virtual bool start_controls(int fd, std::span<const ControlValue> controls) = 0;
  [[nodiscard]] virtual std::span<const ControlValue> finished_controls() = 0;
  virtual void wait_for_controls() = 0;
};

class LinuxV4l2System final : public V4l2System {
 public:
  [[nodiscard]] int open(const char* path) override;
  void close(int fd) override;
  [[nodiscard]] int ioctl(int fd, unsigned long request, void* argument) override;
  [[nodiscard]] void* map(int fd, std::size_t bytes, std::int64_t offset) override;
  void unmap(void* memory, std::size_t bytes) override;
  [[nodiscard]] bool start_controls(int fd, std::span<const ControlValue> controls) override {
    return writer_.start(fd, controls);
  }
  [[nodiscard]] std::span<const ControlValue> finished_controls() override { return writer_.finished(); }
  void wait_for_controls() override { writer_.wait(); }

 private:
  ControlWriter writer_{[this](int fd, const ControlValue& control) { return set_control(fd, control); }};
  bool set_control(int fd, const ControlValue& control);
};

}  // namespace farpoint::drivers
