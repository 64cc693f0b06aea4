// SPDX-License-Identifier: Apache-2.0
#include "tests/drivers/v4l2/fake_v4l2.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <tuple>

namespace farpoint::test {

using drivers::CameraFormat;

namespace {

constexpr const char* kPath = "/dev/null";  // exists; nothing else is opened
constexpr int kFd = 77;
constexpr double kExposureUnit_us = 100.0;

struct Code {
  CameraFormat format;
  std::uint32_t code;
};
constexpr std::array kCodes = {
    Code{CameraFormat::kGrey, V4L2_PIX_FMT_GREY}, Code{CameraFormat::kNv12, V4L2_PIX_FMT_NV12},
    Code{CameraFormat::kYuyv, V4L2_PIX_FMT_YUYV}, Code{CameraFormat::kRgb24, V4L2_PIX_FMT_RGB24},
    Code{CameraFormat::kMjpeg, V4L2_PIX_FMT_MJPEG}};

std::uint32_t code_of(CameraFormat format) {
  return std::find_if(kCodes.begin(), kCodes.end(), [=](const Code& c) { return c.format == format; })->code;
}

std::uint32_t bytes_a_pixel(CameraFormat format) {
  switch (format) {
    case CameraFormat::kYuyv:
      return 2;
    case CameraFormat::kRgb24:
      return 3;
    case CameraFormat::kMjpeg:
      return 0;
    default:
      return 1;
  }
}

}  // namespace

class FakeV4l2::System final : public drivers::V4l2System {
 public:
  explicit System(FakeV4l2* camera) : camera_(camera) {}
  [[nodiscard]] int open(const char* path) override;
  void close(int fd) override;
  [[nodiscard]] int ioctl(int fd, unsigned long request, void* argument) override;
  [[nodiscard]] void* map(int fd, std::size_t bytes, std::int64_t offset) override;
  void unmap(void* memory, std::size_t bytes) override;
  // At once: threads are ControlWriter's affair.
  [[nodiscard]] bool start_controls(drivers::ControlJob* job) override;
  [[nodiscard]] bool finished_controls() override { return std::exchange(job_done_, false); }
  void wait_for_controls() override { job_done_ = false; }

 private:
  int list_format(v4l2_fmtdesc* entry);
  int list_size(v4l2_frmsizeenum* entry);
  int list_interval(v4l2_frmivalenum* entry);
  int set_format(v4l2_format* wanted);
  int request_buffers(v4l2_requestbuffers* request);
  int queue(const v4l2_buffer& buffer);
  int dequeue(v4l2_buffer* buffer);
  int control(unsigned long request, void* argument);
  void note(const v4l2_control& set);
  [[nodiscard]] const CameraFormat* find(std::uint32_t code) const;
  [[nodiscard]] std::size_t buffer_bytes() const { return camera_->set_.sizeimage; }

  FakeV4l2* camera_;
  bool job_done_ = false;  // and not reported yet
};

// --- what tests ask for

FakeV4l2::FakeV4l2() {
  images_.reserve(32);
}

std::unique_ptr<drivers::CameraDevice> FakeV4l2::make_device(drivers::CameraOptions options) {
  options.device = kPath;
  return std::make_unique<drivers::V4l2Device>(options, std::make_unique<System>(this));
}

std::unique_ptr<drivers::V4l2System> FakeV4l2::make_system() {
  return std::make_unique<System>(this);
}

void FakeV4l2::give_exposure_and_gain() {
  gain_min = 0;
  gain_max = 100;
  control_ranges[V4L2_CID_EXPOSURE_AUTO] = {0, 3};
  control_ranges[V4L2_CID_EXPOSURE_ABSOLUTE] = {1, 500};
  control_ranges[V4L2_CID_GAIN] = {gain_min, gain_max};
}

bool FakeV4l2::show(const FakeShot& shot) {
  const auto filled = fill(shot);
  if (!filled) return false;
  const std::uint32_t error = shot.damaged ? V4L2_BUF_FLAG_ERROR : 0;
  images_.push_back({*filled, shot.sequence, flags | error, shot.stamp_us.value_or(now.monotonic_us)});
  return true;
}

void FakeV4l2::unplug() {
  plugged = false;
  images_.clear();
}

bool FakeV4l2::is_readable(int fd) const {
  return fd == kFd && (!images_.empty() || stream_error_ != 0 || !plugged);
}

// --- what the driver calls

int FakeV4l2::System::open(const char* path) {
  if (!camera_->plugged || std::strcmp(path, kPath) != 0) return -ENOENT;
  ++camera_->opened;
  if (camera_->on_open) camera_->on_open();
  return kFd;
}

void FakeV4l2::System::close(int) {
  ++camera_->closed;
  if (camera_->on_close) camera_->on_close();
  camera_->queued_.clear();
  camera_->images_.clear();
}

void* FakeV4l2::System::map(int, std::size_t bytes, std::int64_t offset) {
  const auto index = static_cast<std::size_t>(offset);
  if (index >= camera_->memory_.size() || bytes != camera_->memory_[index].size()) return nullptr;
  ++camera_->mapped;
  return camera_->memory_[index].data();
}

void FakeV4l2::System::unmap(void*, std::size_t) {
  ++camera_->unmapped;
}

int FakeV4l2::System::ioctl(int, unsigned long request, void* argument) {
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
      return queue(*static_cast<v4l2_buffer*>(argument));
    case VIDIOC_DQBUF:
      return dequeue(static_cast<v4l2_buffer*>(argument));
    case VIDIOC_STREAMON:
      ++camera_->streams;
      return 0;
    case VIDIOC_STREAMOFF:
      return 0;
    default:
      return control(request, argument);
  }
}

bool FakeV4l2::System::start_controls(drivers::ControlJob* job) {
  if (job_done_) return false;
  job->run();
  job_done_ = true;
  return true;
}

const CameraFormat* FakeV4l2::System::find(std::uint32_t code) const {
  for (const CameraFormat& format : camera_->formats)
    if (code_of(format) == code) return &format;
  return nullptr;
}

int FakeV4l2::System::list_format(v4l2_fmtdesc* entry) {
  if (entry->index >= camera_->formats.size()) return -EINVAL;
  entry->pixelformat = code_of(camera_->formats[entry->index]);
  return 0;
}

int FakeV4l2::System::list_size(v4l2_frmsizeenum* entry) {
  if (find(entry->pixel_format) == nullptr || entry->index > 0) return -EINVAL;
  entry->type = V4L2_FRMSIZE_TYPE_DISCRETE;
  entry->discrete = {static_cast<std::uint32_t>(camera_->width_px),
                     static_cast<std::uint32_t>(camera_->height_px)};
  return 0;
}

int FakeV4l2::System::list_interval(v4l2_frmivalenum* entry) {
  const CameraFormat* format = find(entry->pixel_format);
  if (format == nullptr || camera_->width_px != static_cast<int>(entry->width) || entry->index > 0)
    return -EINVAL;
  const auto limit = camera_->fastest_hz.find(*format);
  const double fastest_hz = limit == camera_->fastest_hz.end() ? 30.0 : limit->second;
  entry->type = V4L2_FRMIVAL_TYPE_DISCRETE;
  entry->discrete = {1000, static_cast<std::uint32_t>(std::lround(1000 * fastest_hz))};
  return 0;
}

int FakeV4l2::System::set_format(v4l2_format* wanted) {
  v4l2_pix_format& pix = wanted->fmt.pix;
  const CameraFormat* format = find(pix.pixelformat);
  if (format == nullptr || camera_->width_px != static_cast<int>(pix.width)) return -EINVAL;
  if (camera_->takes_other_size) pix.width -= 4;
  pix.bytesperline = pix.width * bytes_a_pixel(*format) + static_cast<std::uint32_t>(camera_->stride_padding);
  pix.sizeimage = *format == CameraFormat::kMjpeg  ? pix.width * pix.height
                  : *format == CameraFormat::kNv12 ? pix.bytesperline * pix.height * 3 / 2
                                                   : pix.bytesperline * pix.height;
  camera_->set_ = pix;
  camera_->configured = *format;
  return 0;
}

int FakeV4l2::System::request_buffers(v4l2_requestbuffers* request) {
  camera_->memory_.assign(request->count, std::vector<std::uint8_t>(buffer_bytes()));
  return 0;
}

int FakeV4l2::System::queue(const v4l2_buffer& buffer) {
  if (camera_->give_back_error != 0) return -camera_->give_back_error;
  camera_->queued_.push_back(buffer.index);
  return 0;
}

int FakeV4l2::System::dequeue(v4l2_buffer* buffer) {
  if (camera_->stream_error_ != 0) return -std::exchange(camera_->stream_error_, 0);
  if (camera_->images_.empty()) return -EAGAIN;
  const Image image = camera_->images_.front();
  camera_->images_.erase(camera_->images_.begin());
  buffer->index = image.filled.buffer;
  buffer->bytesused = static_cast<std::uint32_t>(image.filled.bytes);
  buffer->sequence = image.sequence;
  buffer->flags = image.flags;
  buffer->timestamp.tv_sec = camera_->stamp_s.value_or(image.stamp_us / 1'000'000);
  buffer->timestamp.tv_usec = image.stamp_us % 1'000'000;
  return 0;
}

int FakeV4l2::System::control(unsigned long request, void* argument) {
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
  note(*c);
  return 0;
}

void FakeV4l2::System::note(const v4l2_control& set) {
  if (set.id == V4L2_CID_EXPOSURE_ABSOLUTE) camera_->exposure_us = kExposureUnit_us * set.value;
  if (set.id == V4L2_CID_GAIN) camera_->gain = set.value;
  if (set.id == V4L2_CID_EXPOSURE_AUTO) camera_->is_automatic = set.value == V4L2_EXPOSURE_AUTO;
}

}  // namespace farpoint::test
