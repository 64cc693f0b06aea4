// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/v4l2_system.h"

#include <fcntl.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>

namespace farpoint::drivers {

int LinuxV4l2System::open(const char* path) {
  const int fd = ::open(path, O_RDWR | O_NONBLOCK | O_CLOEXEC);
  return fd < 0 ? -errno : fd;
}

void LinuxV4l2System::close(int fd) {
  wait_for_controls();
  ::close(fd);
}

int LinuxV4l2System::ioctl(int fd, unsigned long request, void* argument) {
  int result = 0;
  do {
    result = ::ioctl(fd, request, argument);
  } while (result < 0 && errno == EINTR);
  return result < 0 ? -errno : result;
}

void* LinuxV4l2System::map(int fd, std::size_t bytes, std::int64_t offset) {
  void* memory = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd, offset);
  return memory == MAP_FAILED ? nullptr : memory;
}

void LinuxV4l2System::unmap(void* memory, std::size_t bytes) {
  munmap(memory, bytes);
}

}  // namespace farpoint::drivers
