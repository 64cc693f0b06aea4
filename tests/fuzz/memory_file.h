// SPDX-License-Identifier: Apache-2.0
// A file in memory with a path, for functions that take a path.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <string>

#include "tests/fuzz/targets.h"

namespace farpoint::fuzz {

class MemoryFile {
 public:
  explicit MemoryFile(ByteView content) : fd_(memfd_create("fuzz", MFD_CLOEXEC)) {
    require(fd_ >= 0, "memfd_create");
    std::size_t written = 0;
    while (written < content.size()) {
      const ssize_t bytes = write(fd_, content.data() + written, content.size() - written);
      require(bytes > 0, "write to memory");
      written += static_cast<std::size_t>(bytes);
    }
  }
  ~MemoryFile() { close(fd_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  [[nodiscard]] std::string path() const { return "/proc/self/fd/" + std::to_string(fd_); }

 private:
  int fd_;
};

}  // namespace farpoint::fuzz
