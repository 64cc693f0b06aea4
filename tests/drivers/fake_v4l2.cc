#include "tests/drivers/fake_v4l2.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <tuple>
#include <utility>

namespace farpoint::test {
namespace {

constexpr int kFd = 77;

std::vector<std::uint32_t> codes_of(const FakeCamera& camera) {
  std::vector<std::uint32_t> codes;
  for (const FakeFormat& f : camera.formats)
    if (std::find(codes.begin(), codes.end(), f.code) == codes.end()) codes.push_back(f.code);
  return codes;
}

int bytes_a_pixel(std::uint32_t code) {
  return code == V4L2_PIX_FMT_YUYV ? 2 : code == V4L2_PIX_FMT_MJPEG ? 0 : 1;
}

void advance(FakeCamera* camera, std::int64_t ms) {
  camera->waited_ms += ms;
  camera->now.monotonic_us += 1000 * ms;
  camera->now.boottime_us += 1000 * ms;
  camera->now.realtime_us += 1000 * ms;
}

}  // namespace

FakeFrame fake_frame(const FakeCamera& camera, std::uint32_t sequence, std::uint8_t grey) {
  FakeFrame frame;
  frame.bytes.assign(static_cast<std::size_t>(camera.set.sizeimage), grey);
  frame.sequence = sequence;
  frame.stamp_us = camera.now.monotonic_us;
  return frame;
}

int FakeV4l2System::open(const char* path) {
  if (!camera_->plugged || std::strcmp(path, "/dev/null") != 0) return -ENOENT;
  ++camera_->opened;
  camera_->queued.clear();
  camera_->streaming = false;
  return kFd;
}

void FakeV4l2System::close(int) {
  ++camera_->closed;
}

void* FakeV4l2System::map(int, std::size_t bytes, std::int64_t offset) {
  const auto index = static_cast<std::size_t>(offset);
  if (index >= camera_->memory.size() || bytes != camera_->memory[index].size()) return nullptr;
  ++camera_->mapped;
  return camera_->memory[index].data();
}

void FakeV4l2System::unmap(void*, std::size_t) {
  ++camera_->unmapped;
}

void FakeV4l2Wait::wait(int fd, int timeout_ms) {
  camera_->waits_ms.push_back(timeout_ms);
  const bool something =
      fd >= 0 && (!camera_->frames.empty() || camera_->stream_error != 0 || !camera_->plugged);
  advance(camera_.get(), something ? 1 : timeout_ms);
}

int FakeV4l2System::ioctl(int, unsigned long request, void* argument) {
  if (!camera_->plugged) return -ENODEV;
  switch (request) {
    case VIDIOC_QUERYCAP: {
      auto* c = static_cast<v4l2_capability*>(argument);
      std::memcpy(c->driver, camera_->driver.c_str(), std::min<std::size_t>(camera_->driver.size() + 1, 16));
      c->capabilities = camera_->capabilities | V4L2_CAP_DEVICE_CAPS;
      c->device_caps = camera_->capabilities;
      return 0;
    }
    case VIDIOC_ENUM_FMT:
      return list_format(static_cast<v4l2_fmtdesc*>(argument));
    case VIDIOC_ENUM_FRAMESIZES:
      return list_size(static_cast<v4l2_frmsizeenum*>(argument));
    case VIDIOC_ENUM_FRAMEINTERVALS:
      return list_interval(static_cast<v4l2_frmivalenum*>(argument));
    case VIDIOC_S_FMT:
      return set_format(static_cast<v4l2_format*>(argument));
    case VIDIOC_S_PARM: {
      const v4l2_fract& t = static_cast<v4l2_streamparm*>(argument)->parm.capture.timeperframe;
      camera_->set_rate_hz = static_cast<double>(t.denominator) / static_cast<double>(t.numerator);
      return 0;
    }
    case VIDIOC_REQBUFS:
      return request_buffers(static_cast<v4l2_requestbuffers*>(argument));
    case VIDIOC_QUERYBUF: {
      auto* b = static_cast<v4l2_buffer*>(argument);
      b->length = static_cast<std::uint32_t>(buffer_bytes());
      b->m.offset = b->index;
      return 0;
    }
    case VIDIOC_QBUF:
      camera_->queued.push_back(static_cast<v4l2_buffer*>(argument)->index);
      return 0;
    case VIDIOC_DQBUF:
      return dequeue(static_cast<v4l2_buffer*>(argument));
    case VIDIOC_STREAMON:
      camera_->streaming = true;
      ++camera_->streams;
      return 0;
    case VIDIOC_STREAMOFF:
      camera_->streaming = false;
      return 0;
    default:
      return control(request, argument);
  }
}

int FakeV4l2System::list_format(v4l2_fmtdesc* entry) {
  const auto codes = codes_of(*camera_);
  if (entry->index >= codes.size()) return -EINVAL;
  entry->pixelformat = codes[entry->index];
  return 0;
}

int FakeV4l2System::list_size(v4l2_frmsizeenum* entry) {
  std::uint32_t index = 0;
  for (const FakeFormat& f : camera_->formats) {
    if (f.code != entry->pixel_format || index++ != entry->index) continue;
    entry->type = V4L2_FRMSIZE_TYPE_DISCRETE;
    entry->discrete = {static_cast<std::uint32_t>(f.width), static_cast<std::uint32_t>(f.height)};
    return 0;
  }
  return -EINVAL;
}

int FakeV4l2System::list_interval(v4l2_frmivalenum* entry) {
  for (const FakeFormat& f : camera_->formats) {
    if (f.code != entry->pixel_format || f.width != static_cast<int>(entry->width) || entry->index > 0)
      continue;
    entry->type = V4L2_FRMIVAL_TYPE_DISCRETE;
    entry->discrete = {1000, static_cast<std::uint32_t>(std::lround(1000 * f.fastest_hz))};
    return 0;
  }
  return -EINVAL;
}

int FakeV4l2System::set_format(v4l2_format* format) {
  v4l2_pix_format& pix = format->fmt.pix;
  for (const FakeFormat& f : camera_->formats) {
    if (f.code != pix.pixelformat || f.width != static_cast<int>(pix.width)) continue;
    if (camera_->takes_other_size) pix.width -= 4;
    pix.bytesperline = pix.width * static_cast<std::uint32_t>(bytes_a_pixel(f.code)) +
                       static_cast<std::uint32_t>(f.stride_padding);
    pix.sizeimage = f.code == V4L2_PIX_FMT_MJPEG  ? pix.width * pix.height
                    : f.code == V4L2_PIX_FMT_NV12 ? pix.bytesperline * pix.height * 3 / 2
                                                  : pix.bytesperline * pix.height;
    camera_->set = pix;
    return 0;
  }
  return -EINVAL;
}

std::size_t FakeV4l2System::buffer_bytes() const {
  return camera_->set.sizeimage;
}

int FakeV4l2System::request_buffers(v4l2_requestbuffers* request) {
  camera_->memory.assign(request->count, std::vector<std::uint8_t>(buffer_bytes()));
  return 0;
}

int FakeV4l2System::dequeue(v4l2_buffer* buffer) {
  if (camera_->stream_error != 0) return -std::exchange(camera_->stream_error, 0);
  if (camera_->frames.empty() || camera_->queued.empty()) return -EAGAIN;
  const FakeFrame frame = std::move(camera_->frames.front());
  camera_->frames.pop_front();
  buffer->index = camera_->queued.front();
  camera_->queued.erase(camera_->queued.begin());
  std::vector<std::uint8_t>& memory = camera_->memory[buffer->index];
  std::copy_n(frame.bytes.begin(), std::min(frame.bytes.size(), memory.size()), memory.begin());
  buffer->bytesused = static_cast<std::uint32_t>(frame.bytes.size());
  buffer->sequence = frame.sequence;
  buffer->flags = frame.flags;
  buffer->timestamp.tv_sec = frame.stamp_us / 1'000'000;
  buffer->timestamp.tv_usec = frame.stamp_us % 1'000'000;
  return 0;
}

int FakeV4l2System::control(unsigned long request, void* argument) {
  if (request == VIDIOC_QUERYCTRL) {
    auto* q = static_cast<v4l2_queryctrl*>(argument);
    if (!camera_->control_ranges.contains(q->id)) return -EINVAL;
    std::tie(q->minimum, q->maximum) = camera_->control_ranges.at(q->id);
    return 0;
  }
  if (request != VIDIOC_S_CTRL && request != VIDIOC_G_CTRL) return -ENOTTY;
  auto* c = static_cast<v4l2_control*>(argument);
  if (!camera_->control_ranges.contains(c->id)) return -EINVAL;
  const auto [min, max] = camera_->control_ranges.at(c->id);
  if (request == VIDIOC_G_CTRL) {
    c->value = camera_->controls[c->id];
    return 0;
  }
  if (c->value < min || c->value > max) return -ERANGE;
  camera_->controls[c->id] = c->value;
  return 0;
}

}  // namespace farpoint::test
