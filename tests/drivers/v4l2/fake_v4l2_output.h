// SPDX-License-Identifier: Apache-2.0
// A V4L2 output device in memory: takes images, gives buffers back in order, and does wrong what a test asks
// for.
#pragma once

#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <memory>
#include <vector>

#include "drivers/v4l2/v4l2_output.h"

namespace farpoint::test {

struct FakeOutput {
  // What it is.
  bool present = true;
  std::uint32_t capabilities = V4L2_CAP_VIDEO_OUTPUT | V4L2_CAP_STREAMING;
  int format_errno = 0, buffers_errno = 0, start_errno = 0;
  bool keeps_its_size = false;  // S_FMT is answered well, and changes nothing
  std::uint32_t stride_padding = 0, most_buffers = 8;
  int held = 0;                                   // buffers that it keeps when they are requested
  std::size_t unplugged_after = ~std::size_t{0};  // images

  // What it was given.
  struct Image {
    std::vector<std::uint8_t> bytes;  // rows with their padding
    std::int64_t stamp_us = 0;
    std::uint32_t flags = 0, index = 0;
  };
  std::vector<Image> images;
  double rate_hz = 0.0;
  int opened = 0, closed = 0, mapped = 0, unmapped = 0, streaming = 0;

  [[nodiscard]] std::unique_ptr<drivers::V4l2System> make_system();
};

class FakeOutputSystem final : public drivers::V4l2System {
 public:
  explicit FakeOutputSystem(FakeOutput* device) : device_(*device) {}
  [[nodiscard]] int open(const char* path) override {
    if (!device_.present || std::strncmp(path, "/dev/video", 10) != 0) return -ENOENT;
    ++device_.opened;
    return 5;
  }
  void close(int) override { ++device_.closed; }
  [[nodiscard]] void* map(int, std::size_t bytes, std::int64_t offset) override {
    auto& memory = memory_.at(static_cast<std::size_t>(offset));
    memory.resize(bytes);
    ++device_.mapped;
    return memory.data();
  }
  void unmap(void*, std::size_t) override { ++device_.unmapped; }
  [[nodiscard]] int ioctl(int, unsigned long request, void* argument) override {
    if (device_.images.size() >= device_.unplugged_after) return -ENODEV;
    switch (request) {
      case VIDIOC_QUERYCAP: {
        auto* c = static_cast<v4l2_capability*>(argument);
        c->capabilities = V4L2_CAP_DEVICE_CAPS | V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_VIDEO_OUTPUT;
        c->device_caps = device_.capabilities;
        return 0;
      }
      case VIDIOC_G_FMT:
        static_cast<v4l2_format*>(argument)->fmt.pix = pix_;
        return 0;
      case VIDIOC_S_FMT:
        return set_format(static_cast<const v4l2_format*>(argument)->fmt.pix);
      case VIDIOC_S_PARM: {
        const v4l2_fract& t = static_cast<v4l2_streamparm*>(argument)->parm.output.timeperframe;
        device_.rate_hz = static_cast<double>(t.denominator) / static_cast<double>(t.numerator);
        return 0;
      }
      case VIDIOC_REQBUFS: {
        auto* r = static_cast<v4l2_requestbuffers*>(argument);
        r->count = std::min(r->count, device_.most_buffers);
        return -device_.buffers_errno;
      }
      case VIDIOC_QUERYBUF: {
        auto* b = static_cast<v4l2_buffer*>(argument);
        b->length = pix_.sizeimage;
        b->m.offset = b->index;
        return 0;
      }
      case VIDIOC_STREAMON:
        device_.streaming += device_.start_errno == 0 ? 1 : 0;
        return -device_.start_errno;
      case VIDIOC_STREAMOFF:
        --device_.streaming;
        return 0;
      case VIDIOC_QBUF:
        return queue(*static_cast<const v4l2_buffer*>(argument));
      case VIDIOC_DQBUF:
        return give_back(static_cast<v4l2_buffer*>(argument));
      default:
        return -ENOTTY;
    }
  }
  [[nodiscard]] bool start_controls(drivers::ControlJob* /*job*/) override { return false; }
  [[nodiscard]] bool finished_controls() override { return false; }
  void wait_for_controls() override {}

 private:
  int set_format(const v4l2_pix_format& wanted) {
    if (device_.format_errno != 0) return -device_.format_errno;
    if (device_.keeps_its_size) return 0;
    pix_ = wanted;
    pix_.bytesperline = wanted.width + device_.stride_padding;
    pix_.sizeimage = pix_.bytesperline * wanted.height;
    return 0;
  }
  int queue(const v4l2_buffer& buffer) {
    if (std::find(queued_.begin(), queued_.end(), buffer.index) != queued_.end()) return -EINVAL;
    const auto& memory = memory_.at(buffer.index);
    queued_.push_back(buffer.index);
    device_.images.push_back(
        {{memory.begin(), memory.begin() + static_cast<std::ptrdiff_t>(buffer.bytesused)},
         std::int64_t{buffer.timestamp.tv_sec} * 1'000'000 + buffer.timestamp.tv_usec,
         buffer.flags,
         buffer.index});
    return 0;
  }
  int give_back(v4l2_buffer* buffer) {
    if (queued_.empty() || device_.held > 0) return -EAGAIN;
    // As v4l2loopback does, it names the newest.
    buffer->index = queued_.back();
    queued_.erase(queued_.begin());
    return 0;
  }

  FakeOutput& device_;
  v4l2_pix_format pix_{
      640, 480, V4L2_PIX_FMT_YUYV, V4L2_FIELD_NONE, 1280, 614400, V4L2_COLORSPACE_SRGB, 0, 0, {0}, 0, 0};
  std::array<std::vector<std::uint8_t>, 8> memory_;
  std::vector<std::uint32_t> queued_;
};

inline std::unique_ptr<drivers::V4l2System> FakeOutput::make_system() {
  return std::make_unique<FakeOutputSystem>(this);
}

}  // namespace farpoint::test
