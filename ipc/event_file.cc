// SPDX-License-Identifier: Apache-2.0
#include "ipc/event_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "ipc/log.h"

namespace farpoint::ipc {
namespace {

using Header = std::array<std::uint8_t, LogReader::kHeaderBytes>;

void put_big_endian(std::uint64_t value, std::size_t at, std::size_t bytes, Header* header) {
  for (std::size_t i = bytes; i-- > 0; value >>= 8) header->at(at + i) = static_cast<std::uint8_t>(value);
}

std::uint64_t get_big_endian(const Header& header, std::size_t at, std::size_t bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < bytes; ++i) value = value << 8 | header.at(at + i);
  return value;
}

Header make_header(std::uint64_t number, std::int64_t timestamp_us, std::size_t channel_bytes,
                   std::size_t data_bytes) {
  Header header{};
  put_big_endian(LogReader::kSyncWord, 0, 4, &header);
  put_big_endian(number, 4, 8, &header);
  put_big_endian(static_cast<std::uint64_t>(timestamp_us), 12, 8, &header);
  put_big_endian(channel_bytes, 20, 4, &header);
  put_big_endian(data_bytes, 24, 4, &header);
  return header;
}

iovec part_of(const void* bytes, std::size_t count) {
  // writev() reads only.
  return {const_cast<void*>(bytes), count};  // NOLINT(cppcoreguidelines-pro-type-const-cast)
}

// Writes all parts. Returns errno, 0 for success.
int write_all(int fd, std::span<iovec> parts) {
  while (!parts.empty()) {
    const ssize_t written = writev(fd, parts.data(), static_cast<int>(parts.size()));
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    auto left = static_cast<std::size_t>(written);
    while (!parts.empty() && left >= parts.front().iov_len) {
      left -= parts.front().iov_len;
      parts = parts.subspan(1);
    }
    if (parts.empty()) return 0;
    parts.front().iov_base = static_cast<std::uint8_t*>(parts.front().iov_base) + left;
    parts.front().iov_len -= left;
  }
  return 0;
}

}  // namespace

EventFile::EventFile(const std::string& path)
    : fd_(open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666)) {
  if (fd_ < 0) throw std::runtime_error(std::strerror(errno));
  struct stat info {};
  is_regular_ = fstat(fd_, &info) == 0 && S_ISREG(info.st_mode);
  if (is_regular_) (void)flock(fd_, LOCK_EX | LOCK_NB);
}

std::uint64_t EventFile::event_bytes(std::string_view channel, std::span<const std::uint8_t> data) {
  return LogReader::kHeaderBytes + channel.size() + data.size();
}

int EventFile::append(std::string_view channel, std::int64_t timestamp_us,
                      std::span<const std::uint8_t> data) {
  if (fd_ < 0) return EBADF;
  if (error_ != 0) return error_;
  const Header header = make_header(events_, timestamp_us, channel.size(), data.size());
  std::array parts = {part_of(header.data(), header.size()), part_of(channel.data(), channel.size()),
                      part_of(data.data(), data.size())};
  if (const int error = write_all(fd_, parts); error != 0) {
    if (is_regular_)
      cut_off_rest();
    else
      error_ = error;
    return error;
  }
  ++events_;
  bytes_ += event_bytes(channel, data);
  return 0;
}

// What cannot be cut off is overwritten by the next event, or read as damage.
void EventFile::cut_off_rest() {
  const auto end = static_cast<off_t>(bytes_);
  (void)!ftruncate(fd_, end);
  (void)lseek(fd_, end, SEEK_SET);
}

int EventFile::sync() {
  if (fd_ < 0 || !is_regular_ || fsync(fd_) == 0) return 0;
  return errno;
}

void EventFile::close() {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
}

EventWalk::EventWalk(const std::string& path) : fd_(open(path.c_str(), O_RDONLY | O_CLOEXEC)) {
  struct stat info {};
  if (fd_ >= 0 && fstat(fd_, &info) == 0 && info.st_size > 0)
    file_bytes_ = static_cast<std::uint64_t>(info.st_size);
}

EventWalk::~EventWalk() {
  if (fd_ >= 0) close(fd_);
}

bool EventWalk::step(int events) {
  for (int i = 0; i < events; ++i)
    if (!pass_one()) return false;
  return true;
}

bool EventWalk::pass_one() {
  Header header{};
  if (fd_ < 0 || end_ + header.size() > file_bytes_) return false;
  if (pread(fd_, header.data(), header.size(), static_cast<off_t>(end_)) !=
      static_cast<ssize_t>(header.size()))
    return false;
  const std::uint64_t channel_bytes = get_big_endian(header, 20, 4),
                      data_bytes = get_big_endian(header, 24, 4);
  const bool is_header = get_big_endian(header, 0, 4) == LogReader::kSyncWord && channel_bytes > 0 &&
                         channel_bytes <= LogReader::kMaxChannelBytes &&
                         data_bytes <= LogReader::kMaxDataBytes;
  const std::uint64_t after = end_ + header.size() + channel_bytes + data_bytes;
  if (!is_header || after > file_bytes_) return false;
  last_us_ = static_cast<std::int64_t>(get_big_endian(header, 12, 8));
  if (events_ == 1) first_us_ = last_us_;
  end_ = after;
  ++events_;
  return true;
}

std::int64_t EventWalk::duration_us() const {
  return events_ > 1 ? std::max<std::int64_t>(last_us_ - first_us_, 0) : 0;
}

}  // namespace farpoint::ipc
