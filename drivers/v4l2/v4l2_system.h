// SPDX-License-Identifier: Apache-2.0
// The system calls of a V4L2 camera. Tests implement them in place of the kernel.
#pragma once

#include <cstddef>
#include <cstdint>

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

  // Control calls without waiting for the camera; see ControlWriter, whose thread may call ioctl() meanwhile.
  // close() waits for a running job.
  [[nodiscard]] virtual bool start_controls(ControlJob* job) = 0;
  [[nodiscard]] virtual bool finished_controls() = 0;
  virtual void wait_for_controls() = 0;
};

class LinuxV4l2System final : public V4l2System {
 public:
  [[nodiscard]] int open(const char* path) override;
  void close(int fd) override;
  [[nodiscard]] int ioctl(int fd, unsigned long request, void* argument) override;
  [[nodiscard]] void* map(int fd, std::size_t bytes, std::int64_t offset) override;
  void unmap(void* memory, std::size_t bytes) override;
  [[nodiscard]] bool start_controls(ControlJob* job) override { return writer_.start(job); }
  [[nodiscard]] bool finished_controls() override { return writer_.finished(); }
  void wait_for_controls() override { writer_.wait(); }

 private:
  ControlWriter writer_;
};

}  // namespace farpoint::drivers
