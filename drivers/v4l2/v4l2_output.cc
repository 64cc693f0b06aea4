// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/v4l2_output.h"

#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace farpoint::drivers {
namespace {

constexpr std::uint32_t kType = V4L2_BUF_TYPE_VIDEO_OUTPUT;

v4l2_buffer description() {
  v4l2_buffer buffer{};
  buffer.type = kType;
  buffer.memory = V4L2_MEMORY_MMAP;
  return buffer;
}

std::string name_of(std::uint32_t code) {
  std::string name;
  for (int i = 0; i < 4; ++i) name += static_cast<char>(code >> (8 * i) & 0x7F);
  return name;
}

}  // namespace

V4l2Output::V4l2Output(std::string device, const OutputFormat& format, std::unique_ptr<V4l2System> system)
    : device_(std::move(device)),
      format_(format),
      system_(std::move(system)),
      fd_(system_->open(device_.c_str())) {
  if (fd_ < 0) fail("cannot be opened", fd_);
  try {
    set_up();
  } catch (...) {
    close();
    throw;
  }
}

V4l2Output::~V4l2Output() {
  close();
}

void V4l2Output::close() {
  std::uint32_t type = kType;
  if (streaming_) (void)system_->ioctl(fd_, VIDIOC_STREAMOFF, &type);
  streaming_ = false;
  for (Mapping& mapping : mappings_) {
    if (mapping.memory != nullptr) system_->unmap(mapping.memory, mapping.bytes);
    mapping = {};
  }
  if (fd_ >= 0) system_->close(fd_);
  fd_ = -1;
}

void V4l2Output::fail(const std::string& why, int status) const {
  throw std::runtime_error(device_ + ": " + why +
                           (status < 0 ? std::string(" (") + std::strerror(-status) + ")" : ""));
}

// --- negotiation

void V4l2Output::set_up() {
  require_output();
  agree_on_format();
  map_buffers();
  start();
}

void V4l2Output::require_output() {
  v4l2_capability capability{};
  if (const int status = system_->ioctl(fd_, VIDIOC_QUERYCAP, &capability); status < 0)
    fail("is no video device", status);
  const bool of_node = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0;
  const std::uint32_t can = of_node ? capability.device_caps : capability.capabilities;
  // v4l2loopback with exclusive_caps=1 reports it only without a writer.
  if ((can & V4L2_CAP_VIDEO_OUTPUT) == 0)
    fail("is no video output device, expected one of v4l2loopback that no other program writes to");
  if ((can & V4L2_CAP_STREAMING) == 0) fail("is an output device that cannot stream");
}

void V4l2Output::agree_on_format() {
  const auto width = static_cast<std::uint32_t>(format_.width_px),
             height = static_cast<std::uint32_t>(format_.height_px);
  v4l2_format format{};
  format.type = kType;
  // What the device has beside the size (colours, for one) stays.
  if (const int status = system_->ioctl(fd_, VIDIOC_G_FMT, &format); status < 0)
    fail("does not tell its format", status);
  v4l2_pix_format& pix = format.fmt.pix;
  pix.width = pix.bytesperline = width;
  pix.height = height;
  pix.sizeimage = width * height;
  pix.pixelformat = V4L2_PIX_FMT_GREY;
  pix.field = V4L2_FIELD_NONE;
  const std::string wanted = std::to_string(width) + "x" + std::to_string(height) + " GREY";
  if (const int status = system_->ioctl(fd_, VIDIOC_S_FMT, &format); status < 0)
    fail(status == -EBUSY ? "is busy: another program uses it" : "does not take " + wanted, status);
  // Some drivers answer S_FMT with what was asked for, and keep what they had.
  if (const int status = system_->ioctl(fd_, VIDIOC_G_FMT, &format); status < 0)
    fail("does not tell its format", status);
  if (pix.width != width || pix.height != height || pix.pixelformat != V4L2_PIX_FMT_GREY)
    fail("gives " + std::to_string(pix.width) + "x" + std::to_string(pix.height) + " " +
         name_of(pix.pixelformat) + ", expected " + wanted + " (another program may hold it)");
  row_stride_ = std::max(pix.bytesperline, width);
  image_bytes_ = row_stride_ * height;
  if (pix.sizeimage < image_bytes_)
    fail("gives " + std::to_string(pix.sizeimage) + " bytes an image, expected " +
         std::to_string(image_bytes_));
  v4l2_streamparm rate{};
  rate.type = kType;
  rate.parm.output.timeperframe = {1000, static_cast<std::uint32_t>(std::lround(1000.0 * format_.rate_hz))};
  // For those who ask the device; the images' own times do not follow from it.
  if (format_.rate_hz > 0.0) (void)system_->ioctl(fd_, VIDIOC_S_PARM, &rate);
}

void V4l2Output::map_buffers() {
  v4l2_requestbuffers request{};
  request.count = kBuffers;
  request.type = kType;
  request.memory = V4L2_MEMORY_MMAP;
  if (const int status = system_->ioctl(fd_, VIDIOC_REQBUFS, &request); status < 0)
    fail(status == -EBUSY ? "is busy: another program uses it" : "gives no buffers", status);
  if (request.count < 2) fail("gives " + std::to_string(request.count) + " buffers, expected 2 at least");
  buffers_ = free_ = std::min<std::size_t>(request.count, kBuffers);
  for (std::size_t i = 0; i < buffers_; ++i) {
    v4l2_buffer buffer = description();
    buffer.index = static_cast<std::uint32_t>(i);
    if (const int status = system_->ioctl(fd_, VIDIOC_QUERYBUF, &buffer); status < 0)
      fail("does not describe its buffers", status);
    if (buffer.length < image_bytes_)
      fail("gives buffers of " + std::to_string(buffer.length) + " bytes, expected " +
           std::to_string(image_bytes_));
    mappings_.at(i) = {system_->map(fd_, buffer.length, buffer.m.offset), buffer.length};
    if (mappings_.at(i).memory == nullptr) fail("has buffers that cannot be mapped");
  }
}

void V4l2Output::start() {
  std::uint32_t type = kType;
  const int status = system_->ioctl(fd_, VIDIOC_STREAMON, &type);
  if (status < 0)
    fail(status == -EBUSY ? "is busy: another program uses it" : "cannot start to stream", status);
  streaming_ = true;
}

// --- images

int V4l2Output::send(std::span<const std::uint8_t> grey, std::int64_t stamp_us) {
  if (const int status = free_ > 0 ? 0 : take_back(); status < 0) return status;
  fill(next_, grey);
  v4l2_buffer buffer = description();
  buffer.index = static_cast<std::uint32_t>(next_);
  buffer.bytesused = static_cast<std::uint32_t>(image_bytes_);
  buffer.field = V4L2_FIELD_NONE;
  buffer.flags = V4L2_BUF_FLAG_TIMESTAMP_COPY;
  buffer.timestamp.tv_sec = static_cast<time_t>(stamp_us / 1'000'000);
  buffer.timestamp.tv_usec = static_cast<suseconds_t>(stamp_us % 1'000'000);
  if (const int status = system_->ioctl(fd_, VIDIOC_QBUF, &buffer); status < 0) return status;
  --free_;
  next_ = (next_ + 1) % buffers_;
  return 0;
}

// Buffers come back in the order in which they were handed over, so that the one to be filled next is the
// oldest. v4l2loopback 0.12 names another in its answer, the newest; filled at once, that would overwrite an
// image which its reader has not seen yet.
int V4l2Output::take_back() {
  v4l2_buffer buffer = description();
  if (const int status = system_->ioctl(fd_, VIDIOC_DQBUF, &buffer); status < 0) return status;
  ++free_;
  return 0;
}

void V4l2Output::fill(std::size_t index, std::span<const std::uint8_t> grey) {
  const auto width = static_cast<std::size_t>(format_.width_px),
             height = static_cast<std::size_t>(format_.height_px);
  auto* memory = static_cast<std::uint8_t*>(mappings_.at(index).memory);
  for (std::size_t row = 0; row < height; ++row)
    std::copy_n(grey.begin() + static_cast<std::ptrdiff_t>(row * width), width, memory + row * row_stride_);
}

}  // namespace farpoint::drivers
