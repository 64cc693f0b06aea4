// SPDX-License-Identifier: Apache-2.0
#include "drivers/lcm/socket_camera.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "ipc/channels.h"
#include "ipc/log.h"

namespace farpoint::drivers {
namespace {

// An image in any format of image_t, with padded rows and room for the message's other members.
std::size_t largest_event(const CameraOptions& options) {
  constexpr std::size_t kBytesAPixel = 3, kOther = std::size_t{64} << 10;
  const auto pixels =
      static_cast<std::size_t>(options.width_px) * static_cast<std::size_t>(options.height_px);
  return kBytesAPixel * pixels + kOther;
}

std::size_t big_endian(const std::uint8_t* bytes) {
  std::size_t value = 0;
  for (int i = 0; i < 4; ++i) value = value << 8 | bytes[i];
  return value;
}

}  // namespace

SocketCamera::SocketCamera(const CameraOptions& options)
    : options_(options),
      channel_(ipc::kCameraChannelPrefix + std::to_string(options.index)),
      buffer_(largest_event(options)),
      decoder_(std::int64_t{options.width_px} * options.height_px) {}

std::string SocketCamera::check(const std::string& name) {
  const std::string expected =
      ", expected the path of a Unix socket (an LCM URL is none: UDP multicast loses images)";
  if (!name.starts_with("/")) return "'" + name + "' names no local socket" + expected;
  if (name.size() >= sizeof(sockaddr_un::sun_path)) return "'" + name + "' is too long" + expected;
  return "";
}

// --- coming and going

CameraEvent SocketCamera::open() {
  using Kind = CameraEvent::Kind;
  fd_ = socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd_ < 0) return {Kind::kRefused, "no socket can be made", errno};
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  options_.device.copy(address.sun_path, sizeof(address.sun_path) - 1);
  if (connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    return {errno == EACCES ? Kind::kRefused : Kind::kAbsent, "no process offers images at its socket",
            errno};
  expect(Part::kHeader, ipc::LogReader::kHeaderBytes);
  return {Kind::kStreaming, "", 0, CameraFormat::kGrey, 0.0, true};
}

void SocketCamera::close() {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
}

// --- frames

void SocketCamera::expect(Part part, std::size_t bytes) {
  part_ = part;
  wanted_ = bytes;
  received_ = 0;
}

int SocketCamera::take(RawFrame* raw, const char** what) {
  constexpr int kMostEvents = 64;  // of other channels, in one turn
  for (int parts = 0; parts < 2 * kMostEvents; ++parts) {
    if (const int status = receive(what); status < 0) return status;
    if (part_ == Part::kHeader) {
      if (const int status = take_header(what); status < 0) return status;
      continue;
    }
    const bool image = part_ == Part::kBody && is_image();
    if (image) describe(raw);
    expect(Part::kHeader, ipc::LogReader::kHeaderBytes);
    if (image) return 0;
  }
  return -EAGAIN;
}

// Receives until the part is complete. Returns 0 then, -EAGAIN where more has to come.
int SocketCamera::receive(const char** what) {
  while (received_ < wanted_) {
    // What is skipped is written over and over.
    const std::size_t at = part_ == Part::kSkipped ? 0 : received_;
    const std::size_t room = std::min(wanted_ - received_, buffer_.size() - at);
    const ssize_t got = recv(fd_, buffer_.data() + at, room, MSG_DONTWAIT);
    if (got > 0) {
      received_ += static_cast<std::size_t>(got);
      continue;
    }
    *what = "the process that offers its images has closed the socket";
    if (got == 0) return -EPIPE;
    if (errno == EINTR) continue;
    if (errno == EAGAIN || errno == EWOULDBLOCK) return -EAGAIN;
    *what = "its socket cannot be read";
    return -errno;
  }
  return 0;
}

int SocketCamera::take_header(const char** what) {
  const std::uint8_t* header = buffer_.data();
  channel_bytes_ = big_endian(header + 20);
  const std::size_t data_bytes = big_endian(header + 24);
  *what = "what comes from its socket is no event of an LCM log";
  if (big_endian(header) != ipc::LogReader::kSyncWord || channel_bytes_ == 0 ||
      channel_bytes_ > ipc::LogReader::kMaxChannelBytes || data_bytes > ipc::LogReader::kMaxDataBytes)
    return -EPROTO;
  const std::size_t bytes = channel_bytes_ + data_bytes;
  expect(bytes <= buffer_.size() ? Part::kBody : Part::kSkipped, bytes);
  return 0;
}

bool SocketCamera::is_image() const {
  return std::string_view(reinterpret_cast<const char*>(buffer_.data()), channel_bytes_) == channel_;
}

void SocketCamera::describe(RawFrame* raw) {
  *raw = {};
  raw->format = CameraFormat::kGrey;
  const bool readable =
      ipc::decode(std::span(buffer_).subspan(channel_bytes_, wanted_ - channel_bytes_), &message_);
  if (!readable) return;
  raw->sequence = static_cast<std::uint32_t>(message_.sequence);
  raw->stamp_us = message_.utime;
  raw->exposure_us = message_.exposure_us;
  raw->gain = message_.gain;
  if (message_.width != options_.width_px || message_.height != options_.height_px) return;
  if (decoder_.decode(message_, &image_) != ipc::ImageStatus::kOk) return;
  raw->bytes = image_.pixels;
  raw->row_stride = image_.width_px;
}

}  // namespace farpoint::drivers
