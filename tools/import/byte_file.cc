// SPDX-License-Identifier: Apache-2.0
#include "tools/import/byte_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "tools/common/errors.h"

namespace farpoint::tools {

ByteFile::ByteFile(std::filesystem::path path)
    : path_(std::move(path)), fd_(open(path_.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {
  if (fd_ < 0) throw InputError(path_.string() + ": cannot be opened (" + std::strerror(errno) + ")");
  struct stat info {};
  if (fstat(fd_, &info) != 0 || !S_ISREG(info.st_mode)) {
    close(fd_);
    throw InputError(path_.string() + ": is no file, expected a recording");
  }
  size_ = static_cast<std::uint64_t>(info.st_size);
}

ByteFile::~ByteFile() {
  close(fd_);
}

std::string ByteFile::read(std::uint64_t offset, std::uint64_t bytes) const {
  require(offset, bytes);
  std::string content(bytes, '\0');
  std::size_t done = 0;
  while (done < content.size()) {
    const ssize_t got =
        pread(fd_, content.data() + done, content.size() - done, static_cast<off_t>(offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) fail(offset, std::string("cannot be read (") + std::strerror(errno) + ")");
    if (got == 0) fail(offset, "the file became shorter");
    done += static_cast<std::size_t>(got);
  }
  return content;
}

std::uint32_t ByteFile::read_u32(std::uint64_t offset) const {
  const std::string bytes = read(offset, 4);
  std::uint32_t value = 0;
  for (std::size_t i = 4; i-- > 0;) value = value << 8 | static_cast<std::uint8_t>(bytes[i]);
  return value;
}

void ByteFile::require(std::uint64_t offset, std::uint64_t bytes) const {
  if (offset <= size_ && bytes <= size_ - offset) return;
  fail(offset, "cut off, expected " + std::to_string(bytes) + " bytes, the file has " +
                   std::to_string(size_ - std::min(offset, size_)));
}

void ByteFile::fail(std::uint64_t offset, const std::string& message) const {
  throw InputError(path_.string() + ": byte " + std::to_string(offset) + ": " + message);
}

}  // namespace farpoint::tools
