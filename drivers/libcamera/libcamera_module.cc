// SPDX-License-Identifier: Apache-2.0
// Implements libcamera_system.h by libcamera: the module that farpointd loads. Written against 0.0.3 with
// calls that later versions keep; LIBCAMERA_VERSION_* or types select where they differ.
#include <libcamera/libcamera.h>
#include <linux/dma-buf.h>
#include <sys/ioctl.h>
#include <sys/mman.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "drivers/libcamera/libcamera_system.h"

namespace farpoint::drivers {
namespace {

namespace lc = libcamera;

lc::PixelFormat pixel_format(CameraFormat format) {
  switch (format) {
    case CameraFormat::kGrey:
      return lc::formats::R8;
    case CameraFormat::kNv12:
      return lc::formats::NV12;
    case CameraFormat::kYuyv:
      return lc::formats::YUYV;
    case CameraFormat::kRgb24:
      return lc::formats::BGR888;  // named from the highest byte of a word: red is the first in memory
    case CameraFormat::kMjpeg:
      return lc::formats::MJPEG;
    case CameraFormat::kAuto:
      break;
  }
  return {};
}

// Processed images first; a grey sensor's own are of the role Raw.
constexpr std::array kRoles = {lc::StreamRole::VideoRecording, lc::StreamRole::Raw};

// Null where the camera cannot give just this.
std::unique_ptr<lc::CameraConfiguration> configuration_for(lc::Camera* camera, lc::PixelFormat format,
                                                           const lc::Size& size, unsigned int buffers) {
  for (const lc::StreamRole role : kRoles) {
    std::unique_ptr<lc::CameraConfiguration> wanted = camera->generateConfiguration({role});
    if (!wanted || wanted->empty()) continue;
    lc::StreamConfiguration& stream = wanted->at(0);
    stream.pixelFormat = format;
    stream.size = size;
    stream.bufferCount = buffers;
    if (wanted->validate() == lc::CameraConfiguration::Invalid) continue;
    // It may have adjusted anything.
    if (stream.pixelFormat == format && stream.size == size) return wanted;
  }
  return nullptr;
}

bool is_number(const char* name) {
  return *name != '\0' && std::strspn(name, "0123456789") == std::strlen(name);
}

std::shared_ptr<lc::Camera> find(lc::CameraManager* manager, const char* name) {
  if (!is_number(name)) return manager->get(std::string(name));
  const auto cameras = manager->cameras();
  const std::size_t index = std::strtoul(name, nullptr, 10);
  return index < cameras.size() ? cameras[index] : nullptr;
}

// The memory of one buffer's first plane, and the fence around reading it: on many boards the processor's
// cache knows nothing of what the camera wrote.
class Mapping {
 public:
  Mapping() = default;
  ~Mapping() {
    if (memory_ != MAP_FAILED) munmap(memory_, bytes_);
  }
  Mapping(const Mapping&) = delete;
  Mapping& operator=(const Mapping&) = delete;

  bool map(const lc::FrameBuffer::Plane& plane) {
    fd_ = plane.fd.get();
    offset_ = plane.offset == lc::FrameBuffer::Plane::kInvalidOffset ? 0 : plane.offset;
    bytes_ = offset_ + plane.length;
    memory_ = mmap(nullptr, bytes_, PROT_READ, MAP_SHARED, fd_, 0);
    return memory_ != MAP_FAILED;
  }
  [[nodiscard]] std::span<const std::uint8_t> read(std::size_t used) {
    fence(DMA_BUF_SYNC_START);
    const auto* start = static_cast<const std::uint8_t*>(memory_);
    return {start + offset_, std::min(used, bytes_ - offset_)};
  }
  void end_reading() { fence(DMA_BUF_SYNC_END); }

 private:
  void fence(std::uint64_t edge) {
    dma_buf_sync sync{edge | DMA_BUF_SYNC_READ};
    // Memory that is no DMA buffer needs no synchronisation and returns an error.
    (void)ioctl(fd_, DMA_BUF_IOCTL_SYNC, &sync);
  }

  int fd_ = -1;  // the buffer's
  std::size_t offset_ = 0, bytes_ = 0;
  void* memory_ = MAP_FAILED;
};

class Libcamera final : public LibcameraSystem {
 public:
  ~Libcamera() override { close(); }

  [[nodiscard]] int open(const char* name, FinishedRequests* finished, const char** what) override;
  void close() override;
  [[nodiscard]] int configure(CameraFormat format, int width_px, int height_px, int buffers,
                              LibcameraStream* stream, const char** what) override;
  [[nodiscard]] int start(const LibcameraSetting& setting, const char** what) override;
  void read(std::uint32_t request, LibcameraFrame* frame) override;
  [[nodiscard]] int give_back(std::uint32_t request, const LibcameraSetting& setting) override;

 private:
  static constexpr std::uint32_t kMaxRequests = FinishedRequests::kMaxRequests;

  // libcamera's thread.
  void on_finished(lc::Request* request) { finished_->push(static_cast<std::uint32_t>(request->cookie())); }
  void on_disconnected() { finished_->set_removed(); }

  [[nodiscard]] int make_requests();
  void describe_controls(LibcameraStream* stream) const;
  [[nodiscard]] bool has(const lc::ControlId& control) const {
    return camera_->controls().find(control.id()) != camera_->controls().end();
  }

  // In the order in which they depend on each other.
  std::unique_ptr<lc::CameraManager> manager_;
  std::shared_ptr<lc::Camera> camera_;
  std::unique_ptr<lc::CameraConfiguration> configuration_;
  std::unique_ptr<lc::FrameBufferAllocator> allocator_;
  std::vector<std::unique_ptr<lc::Request>> requests_;
  std::array<std::optional<Mapping>, kMaxRequests> mappings_;
  FinishedRequests* finished_ = nullptr;
  lc::Stream* stream_ = nullptr;
  bool acquired_ = false, started_ = false;
};

// A manager of its own for each try: it looks through the devices itself, so that a camera is found again
// also where libcamera cannot listen to udev (the service may not use its socket).
int Libcamera::open(const char* name, FinishedRequests* finished, const char** what) {
  close();
  finished_ = finished;
  manager_ = std::make_unique<lc::CameraManager>();
  *what = "libcamera does not start";
  if (const int status = manager_->start(); status < 0) return status;
  camera_ = find(manager_.get(), name);
  *what = "libcamera does not list it";
  if (!camera_) return -ENOENT;
  *what = "it cannot be taken (another program may hold it)";
  if (const int status = camera_->acquire(); status < 0) return status;
  acquired_ = true;
  camera_->requestCompleted.connect(this, &Libcamera::on_finished);
  camera_->disconnected.connect(this, &Libcamera::on_disconnected);
  return 0;
}

// The signals stay connected until libcamera's thread has ended: taking them away while it may just be
// calling one would be the race.
void Libcamera::close() {
  if (started_) camera_->stop();
  requests_.clear();
  for (auto& mapping : mappings_) mapping.reset();
  if (allocator_ && stream_ != nullptr) allocator_->free(stream_);
  allocator_.reset();
  if (acquired_) camera_->release();
  configuration_.reset();
  camera_.reset();
  if (manager_) manager_->stop();
  manager_.reset();
  stream_ = nullptr;
  acquired_ = started_ = false;
}

int Libcamera::configure(CameraFormat format, int width_px, int height_px, int buffers,
                         LibcameraStream* stream, const char** what) {
  const lc::Size size(static_cast<unsigned int>(width_px), static_cast<unsigned int>(height_px));
  configuration_ =
      configuration_for(camera_.get(), pixel_format(format), size, static_cast<unsigned int>(buffers));
  if (!configuration_) return -ENOTSUP;
  *what = "it does not take its own configuration";
  if (const int status = camera_->configure(configuration_.get()); status < 0) return status;
  const lc::StreamConfiguration& agreed = configuration_->at(0);
  stream_ = agreed.stream();
  allocator_ = std::make_unique<lc::FrameBufferAllocator>(camera_);
  *what = "it has no buffers to give";
  if (const int status = allocator_->allocate(stream_); status < 0) return status;
  *what = "its buffers cannot be mapped";
  if (const int status = make_requests(); status < 0) return status;
  *stream = {};
  stream->row_stride = static_cast<int>(agreed.stride);
  stream->requests = static_cast<int>(requests_.size());
  describe_controls(stream);
  return 0;
}

int Libcamera::make_requests() {
  const auto& buffers = allocator_->buffers(stream_);
  for (std::size_t i = 0; i < buffers.size() && i < kMaxRequests; ++i) {
    if (buffers[i]->planes().empty() || !mappings_.at(i).emplace().map(buffers[i]->planes()[0]))
      return -ENOMEM;
    std::unique_ptr<lc::Request> request = camera_->createRequest(i);
    if (!request) return -ENOMEM;
    if (const int status = request->addBuffer(stream_, buffers[i].get()); status < 0) return status;
    requests_.push_back(std::move(request));
  }
  return requests_.size() < 2 ? -ENOMEM : 0;
}

void Libcamera::describe_controls(LibcameraStream* stream) const {
  const lc::ControlInfoMap& controls = camera_->controls();
  stream->has_auto_exposure = has(lc::controls::AeEnable);
  stream->has_frame_duration = has(lc::controls::FrameDurationLimits);
  stream->has_exposure = has(lc::controls::ExposureTime);
  stream->has_gain = has(lc::controls::AnalogueGain);
  if (stream->has_exposure) {
    const lc::ControlInfo& info = controls.find(lc::controls::ExposureTime.id())->second;
    stream->range.min_us = std::max(info.min().get<std::int32_t>(), 1);
    stream->range.max_us = info.max().get<std::int32_t>();
    // Some handlers give no upper limit.
    if (stream->range.max_us <= stream->range.min_us) stream->range.max_us = 1e6;
  }
  if (stream->has_gain) {
    const lc::ControlInfo& info = controls.find(lc::controls::AnalogueGain.id())->second;
    stream->range.gain_min = static_cast<int>(std::ceil(info.min().get<float>() / kLibcameraGainUnit));
    stream->range.gain_max = static_cast<int>(std::floor(info.max().get<float>() / kLibcameraGainUnit));
    stream->has_gain = stream->range.gain_max > stream->range.gain_min;
  }
}

void set_controls(const LibcameraSetting& setting, lc::ControlList* controls) {
  if (setting.auto_exposure) controls->set(lc::controls::AeEnable, *setting.auto_exposure);
  if (setting.exposure_us) controls->set(lc::controls::ExposureTime, *setting.exposure_us);
  if (setting.gain)
    controls->set(lc::controls::AnalogueGain, static_cast<float>(kLibcameraGainUnit * *setting.gain));
  if (setting.frame_duration_us) {
    const std::array<std::int64_t, 2> limits = {*setting.frame_duration_us, *setting.frame_duration_us};
    controls->set(lc::controls::FrameDurationLimits, lc::Span<const std::int64_t, 2>(limits));
  }
}

int Libcamera::start(const LibcameraSetting& setting, const char** what) {
  *what = "it cannot start to stream";
  lc::ControlList controls(camera_->controls());
  set_controls(setting, &controls);
  if (const int status = camera_->start(&controls); status < 0) return status;
  started_ = true;
  // Some handlers take no controls at the start: the first request has them too.
  set_controls(setting, &requests_.front()->controls());
  *what = "it takes no requests";
  for (const auto& request : requests_)
    if (const int status = camera_->queueRequest(request.get()); status < 0) return status;
  return 0;
}

void Libcamera::read(std::uint32_t request, LibcameraFrame* frame) {
  constexpr std::int64_t kNanosPerMicro = 1000;
  *frame = {};
  lc::Request& finished = *requests_.at(request);
  const lc::FrameBuffer* buffer = finished.findBuffer(stream_);
  const lc::FrameMetadata& metadata = buffer->metadata();
  const bool cancelled = finished.status() != lc::Request::RequestComplete ||
                         metadata.status == lc::FrameMetadata::FrameCancelled;
  if (cancelled) {
    frame->status = LibcameraFrame::Status::kCancelled;
    return;
  }
  if (metadata.status != lc::FrameMetadata::FrameSuccess) frame->status = LibcameraFrame::Status::kDamaged;
  frame->sequence = metadata.sequence;
  frame->bytes = mappings_.at(request)->read(metadata.planes()[0].bytesused);
  const lc::ControlList& reported = finished.metadata();
  const auto stamp_ns = reported.get(lc::controls::SensorTimestamp);
  frame->stamp_us = (stamp_ns ? *stamp_ns : static_cast<std::int64_t>(metadata.timestamp)) / kNanosPerMicro;
  if (const auto us = reported.get(lc::controls::ExposureTime)) frame->exposure_us = *us;
  if (const auto gain = reported.get(lc::controls::AnalogueGain))
    frame->gain = static_cast<int>(std::lround(*gain / kLibcameraGainUnit));
}

int Libcamera::give_back(std::uint32_t request, const LibcameraSetting& setting) {
  mappings_.at(request)->end_reading();
  lc::Request& again = *requests_.at(request);
  again.reuse(lc::Request::ReuseBuffers);
  set_controls(setting, &again.controls());
  return camera_->queueRequest(&again);
}

}  // namespace
}  // namespace farpoint::drivers

extern "C" {

[[gnu::visibility("default")]] int farpoint_libcamera_interface() {
  return farpoint::drivers::kLibcameraInterface;
}

[[gnu::visibility("default")]] farpoint::drivers::LibcameraSystem* farpoint_make_libcamera() {
  return std::make_unique<farpoint::drivers::Libcamera>().release();
}
}
