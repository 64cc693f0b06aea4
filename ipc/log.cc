// SPDX-License-Identifier: Apache-2.0
#include "ipc/log.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

#include "ipc/file_kind.h"

namespace farpoint::ipc {
namespace {

constexpr std::size_t kReadBytes = std::size_t{1} << 20;
constexpr std::size_t kSyncBytes = 4;

std::uint64_t big_endian(const std::uint8_t* bytes, int count) {
  std::uint64_t value = 0;
  for (int i = 0; i < count; ++i) value = value << 8 | bytes[i];
  return value;
}

bool is_sync(const std::uint8_t* bytes) {
  return big_endian(bytes, 4) == LogReader::kSyncWord;
}

bool is_printable(std::uint8_t c) {
  return c > 0x20 && c < 0x7f;
}

int open_log(const std::string& path) {
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) throw std::runtime_error("cannot read log " + path + ": " + std::strerror(errno));
  struct stat info {};
  if (fstat(fd, &info) == 0 && S_ISDIR(info.st_mode)) {
    close(fd);
    throw std::runtime_error("cannot read log " + path + ": is a folder, an LCM log was expected");
  }
  const std::string wrong = wrong_kind(fd, path, "an LCM log");
  if (!wrong.empty()) {
    close(fd);
    throw std::runtime_error(wrong);
  }
  return fd;
}

}  // namespace

struct LogReader::Header {
  std::int64_t number = 0, timestamp_us = 0;
  std::size_t channel_bytes = 0, data_bytes = 0;

  [[nodiscard]] std::size_t event_bytes() const { return kHeaderBytes + channel_bytes + data_bytes; }
};

LogReader::LogReader(const std::string& path, std::size_t most_data_bytes)
    : most_data_bytes_(most_data_bytes),
      fd_(path != "-" ? open_log(path) : STDIN_FILENO),
      owns_fd_(path != "-"),
      buffer_(2 * kReadBytes) {
  // A pipe holds 64 kB, less than an image: writer and reader would alternate. Where it is none, or the
  // system allows no more, it stays as it is.
  constexpr int kPipeBytes = 1 << 20;
  if (!owns_fd_) (void)fcntl(fd_, F_SETPIPE_SZ, kPipeBytes);
}

LogReader::~LogReader() {
  if (owns_fd_) close(fd_);
}

bool LogReader::available(std::size_t bytes) {
  while (end_ - begin_ < bytes && !at_end_) {
    if (begin_ > 0 && (begin_ == end_ || buffer_.size() - end_ < kReadBytes)) {
      std::copy(buffer_.begin() + static_cast<std::ptrdiff_t>(begin_),
                buffer_.begin() + static_cast<std::ptrdiff_t>(end_), buffer_.begin());
      end_ -= begin_;
      begin_ = 0;
    }
    if (buffer_.size() - end_ < kReadBytes) grow(bytes);
    const ssize_t got = read(fd_, buffer_.data() + end_, kReadBytes);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) damage_.read_error = std::strerror(errno);
    if (got <= 0) at_end_ = true;
    if (got > 0) end_ += static_cast<std::size_t>(got);
  }
  return end_ - begin_ >= bytes;
}

// Makes room for `bytes` from here on and one read. A half more each time, so that copies stay few, however
// never beyond what the largest event takes.
void LogReader::grow(std::size_t bytes) {
  const std::size_t needed = std::max(begin_ + bytes, end_) + kReadBytes;
  const std::size_t most = kHeaderBytes + kMaxChannelBytes + most_data_bytes_ + 2 * kReadBytes;
  const std::size_t wanted = std::max(needed, std::min(buffer_.size() + buffer_.size() / 2, most));
  buffer_.reserve(wanted);  // resize() alone would double it
  buffer_.resize(wanted);
}

// True where `ahead` bytes from here stands a header with lengths and a channel name that can be.
bool LogReader::read_header(std::size_t ahead, Header* header) {
  if (!available(ahead + kHeaderBytes) || !is_sync(here() + ahead)) return false;
  const std::uint8_t* field = here() + ahead;
  header->number = static_cast<std::int64_t>(big_endian(field + 4, 8));
  header->timestamp_us = static_cast<std::int64_t>(big_endian(field + 12, 8));
  header->channel_bytes = big_endian(field + 20, 4);
  header->data_bytes = big_endian(field + 24, 4);
  if (header->channel_bytes == 0 || header->channel_bytes > kMaxChannelBytes) return false;
  if (header->data_bytes > most_data_bytes_ || !available(ahead + kHeaderBytes + header->channel_bytes))
    return false;
  const std::uint8_t* name = here() + ahead + kHeaderBytes;
  return std::all_of(name, name + header->channel_bytes, is_printable);
}

// True where another plausible header starts within [from, to) of here.
bool LogReader::header_within(std::size_t from, std::size_t to) {
  for (std::size_t at = from; at + kSyncBytes <= to; ++at) {
    const void* found = std::memchr(here() + at, LogReader::kSyncWord >> 24, to - at);
    if (found == nullptr) return false;
    at = static_cast<std::size_t>(static_cast<const std::uint8_t*>(found) - here());
    Header inner;
    if (at + kSyncBytes <= to && is_sync(here() + at) && read_header(at, &inner)) return true;
  }
  return false;
}

// True where a whole event stands here. Where nothing that is a log follows it, either its own lengths are
// damaged (then the next event's header lies within its data) or what follows is.
bool LogReader::whole_event_here(Header* header) {
  if (!read_header(0, header)) return false;
  const std::size_t bytes = header->event_bytes();
  if (!available(bytes)) return false;
  if (!available(bytes + 1)) return true;
  const bool has_next = available(bytes + kSyncBytes);
  if (has_next && is_sync(here() + bytes)) return true;
  return !header_within(kHeaderBytes, has_next ? bytes + kSyncBytes : bytes);
}

void LogReader::skip(std::size_t bytes) {
  begin_ += bytes;
  offset_ += bytes;
}

// Leaves this position for the next sync word (or the end) and counts the bytes in between.
void LogReader::skip_to_sync() {
  if (damage_.places == 0) damage_.first_offset = offset_;
  if (damage_.places == 0 || offset_ != damage_end_) ++damage_.places;
  const std::uint64_t start = offset_;
  skip(1);
  while (available(kSyncBytes) && !is_sync(here())) {
    const void* found = std::memchr(here() + 1, kSyncWord >> 24, end_ - begin_ - 1);
    skip(found == nullptr ? end_ - begin_ - (kSyncBytes - 1)
                          : static_cast<std::size_t>(static_cast<const std::uint8_t*>(found) - here()));
    if (found != nullptr && !available(kSyncBytes)) break;
  }
  if (end_ - begin_ < kSyncBytes) skip(end_ - begin_);  // too few bytes left for anything
  damage_.bytes += offset_ - start;
  damage_end_ = offset_;
}

bool LogReader::next(LogEvent* event) {
  skip(consumed_);
  consumed_ = 0;
  while (available(1)) {
    Header header;
    if (whole_event_here(&header)) {
      const std::uint8_t* name = here() + kHeaderBytes;
      event->number = header.number;
      event->timestamp_us = header.timestamp_us;
      event->offset = offset_;
      event->channel = {reinterpret_cast<const char*>(name), header.channel_bytes};
      event->data = {name + header.channel_bytes, header.data_bytes};
      consumed_ = header.event_bytes();
      ++events_;
      return true;
    }
    skip_to_sync();
  }
  damage_.cut_off = damage_.places > 0 && damage_end_ == offset_;
  return false;
}

LogWriter::LogWriter(const std::string& path) : path_(path) {
  try {
    file_.emplace(path_.writable());
  } catch (const std::runtime_error& error) {
    throw std::runtime_error("cannot write log " + path_.target() + ": " + error.what());
  }
}

bool LogWriter::write(std::string_view channel, std::int64_t timestamp_us,
                      std::span<const std::uint8_t> data) {
  if (!error_.empty() || !file_) return false;
  if (const int error = file_->append(channel, timestamp_us, data); error != 0) error_ = std::strerror(error);
  return error_.empty();
}

std::string LogWriter::keep_incomplete() {
  file_.reset();
  return path_.keep_as(".incomplete");
}

void LogWriter::close() {
  if (!file_) return;
  if (const int error = file_->sync(); error != 0 && error_.empty()) error_ = std::strerror(error);
  file_.reset();
  if (error_.empty()) return path_.commit();
  const std::string kept = path_.keep_as(".incomplete");
  throw std::runtime_error("cannot write log " + path_.target() + ": " + error_ +
                           (kept.empty() ? "" : "; what was written is kept as " + kept));
}

}  // namespace farpoint::ipc
