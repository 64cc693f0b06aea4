// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/v4l2_stream.h"

#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <limits>

namespace farpoint::drivers {
namespace {

// A buffer's description with its planes in place.
struct Description {
  v4l2_buffer buffer{};
  std::array<v4l2_plane, VIDEO_MAX_PLANES> planes{};

  Description(const V4l2Node& node, std::uint32_t index) {
    buffer.type = node.buffer_type();
    buffer.memory = V4L2_MEMORY_MMAP;
    buffer.index = index;
    if (!node.multiplanar) return;
    buffer.m.planes = planes.data();
    buffer.length = VIDEO_MAX_PLANES;
  }
};

// A driver's stamp may hold anything: beyond the range it stays the largest or smallest there is.
std::int64_t micros(const timeval& stamp) {
  constexpr std::int64_t kMicros = 1'000'000,
                         kMost_s = std::numeric_limits<std::int64_t>::max() / kMicros - 1;
  const std::int64_t seconds = std::clamp<std::int64_t>(stamp.tv_sec, -kMost_s, kMost_s);
  return seconds * kMicros + std::clamp<std::int64_t>(stamp.tv_usec, -kMicros, kMicros);
}

}  // namespace

V4l2Stream::~V4l2Stream() {
  std::uint32_t type = node_.buffer_type();
  if (streaming_) (void)system_->ioctl(node_.fd, VIDIOC_STREAMOFF, &type);
  for (const Mapping& mapping : mappings_)
    if (mapping.memory != nullptr) system_->unmap(mapping.memory, mapping.bytes);
}

int V4l2Stream::start(int buffers, const char** what) {
  v4l2_requestbuffers request{};
  request.count = static_cast<std::uint32_t>(std::clamp(buffers, 2, kMaxBuffers));
  request.type = node_.buffer_type();
  request.memory = V4L2_MEMORY_MMAP;
  *what = "it has no buffers to give (another program may hold it)";
  int status = system_->ioctl(node_.fd, VIDIOC_REQBUFS, &request);
  if (status >= 0 && request.count < 2) status = -ENOMEM;
  *what = status < 0 ? *what : "its buffers cannot be mapped";
  const std::uint32_t count = std::min<std::uint32_t>(request.count, kMaxBuffers);
  for (std::uint32_t i = 0; status >= 0 && i < count; ++i) status = map(i);
  for (std::uint32_t i = 0; status >= 0 && i < count; ++i) status = queue(i);
  if (status < 0) return status;
  *what = "it cannot start to stream";
  std::uint32_t type = node_.buffer_type();
  status = system_->ioctl(node_.fd, VIDIOC_STREAMON, &type);
  streaming_ = status >= 0;
  return std::min(status, 0);
}

int V4l2Stream::map(std::uint32_t index) {
  Description d(node_, index);
  const int status = system_->ioctl(node_.fd, VIDIOC_QUERYBUF, &d.buffer);
  if (status < 0) return status;
  const std::size_t bytes = node_.multiplanar ? d.planes[0].length : d.buffer.length;
  const std::int64_t offset = node_.multiplanar ? d.planes[0].m.mem_offset : d.buffer.m.offset;
  mappings_.at(index) = {system_->map(node_.fd, bytes, offset), bytes};
  return mappings_.at(index).memory == nullptr ? -ENOMEM : 0;
}

int V4l2Stream::queue(std::uint32_t index) {
  Description d(node_, index);
  return system_->ioctl(node_.fd, VIDIOC_QBUF, &d.buffer);
}

int V4l2Stream::take(V4l2Buffer* buffer) {
  Description d(node_, 0);
  const int status = system_->ioctl(node_.fd, VIDIOC_DQBUF, &d.buffer);
  if (status < 0) return status;
  if (d.buffer.index >= mappings_.size() || mappings_.at(d.buffer.index).memory == nullptr) return -EIO;
  const Mapping& mapping = mappings_.at(d.buffer.index);
  const std::size_t begin =
      std::min<std::size_t>(node_.multiplanar ? d.planes[0].data_offset : 0, mapping.bytes);
  const std::size_t end =
      std::min<std::size_t>(node_.multiplanar ? d.planes[0].bytesused : d.buffer.bytesused, mapping.bytes);
  const auto* memory = static_cast<const std::uint8_t*>(mapping.memory);
  buffer->index = d.buffer.index;
  buffer->bytes = {memory + begin, std::max(end, begin) - begin};
  buffer->stamp_us = micros(d.buffer.timestamp);
  buffer->flags = d.buffer.flags;
  buffer->sequence = d.buffer.sequence;
  return 0;
}

int V4l2Stream::give_back(const V4l2Buffer& buffer) {
  return queue(buffer.index);
}

}  // namespace farpoint::drivers
