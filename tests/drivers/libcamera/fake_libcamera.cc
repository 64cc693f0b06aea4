// SPDX-License-Identifier: Apache-2.0
#include "tests/drivers/libcamera/fake_libcamera.h"

#include <poll.h>

#include <algorithm>
#include <cerrno>
#include <string_view>

namespace farpoint::test {

using drivers::CameraFormat;
using drivers::LibcameraFrame;
using drivers::LibcameraSetting;
using drivers::LibcameraStream;

namespace {

constexpr const char* kName = "fake";

}  // namespace

class FakeLibcamera::System final : public drivers::LibcameraSystem {
 public:
  explicit System(FakeLibcamera* camera) : camera_(camera) {}
  ~System() override { close(); }
  [[nodiscard]] int open(const char* name, drivers::FinishedRequests* finished, const char** what) override;
  void close() override;
  [[nodiscard]] int configure(CameraFormat format, int width_px, int height_px, int buffers,
                              LibcameraStream* stream, const char** what) override;
  [[nodiscard]] int start(const LibcameraSetting& setting, const char** what) override;
  void read(std::uint32_t request, LibcameraFrame* frame) override;
  [[nodiscard]] int give_back(std::uint32_t request, const LibcameraSetting& setting) override;

 private:
  FakeLibcamera* camera_;
};

// --- what tests ask for

FakeLibcamera::FakeLibcamera() {
  settings.reserve(1 << 10);
}

std::unique_ptr<drivers::CameraDevice> FakeLibcamera::make_device(drivers::CameraOptions options) {
  options.device = kName;
  return std::make_unique<drivers::LibcameraDevice>(options, std::make_unique<System>(this));
}

void FakeLibcamera::give_exposure_and_gain() {
  gain_min = 100;
  gain_max = 1600;
  has.has_auto_exposure = has.has_exposure = has.has_gain = true;
  has.range = {100, 50'000, gain_min, gain_max};
}

bool FakeLibcamera::show(const FakeShot& shot) {
  if (!streaming_) return false;
  const auto filled = fill(shot);
  if (!filled) return false;
  LibcameraFrame& frame = frames_.at(filled->buffer);
  frame.status = shot.damaged ? LibcameraFrame::Status::kDamaged : LibcameraFrame::Status::kOk;
  frame.bytes = {memory_.at(filled->buffer).data(), filled->bytes};
  frame.sequence = shot.sequence;
  frame.stamp_us = shot.stamp_us.value_or(now.monotonic_us);
  frame.exposure_us = reported_exposure_us;
  frame.gain = reported_gain;
  return finished->push(filled->buffer);
}

void FakeLibcamera::unplug() {
  plugged = false;
  if (finished != nullptr) finished->set_removed();
}

void FakeLibcamera::fail_stream() {
  const std::uint32_t request = queued_.front();
  queued_.erase(queued_.begin());
  frames_.at(request).status = LibcameraFrame::Status::kCancelled;
  (void)finished->push(request);
}

bool FakeLibcamera::is_readable(int fd) const {
  pollfd descriptor{fd, POLLIN, 0};
  return poll(&descriptor, 1, 0) > 0;
}

void FakeLibcamera::note(const LibcameraSetting& setting) {
  if (setting.auto_exposure || setting.exposure_us || setting.gain || setting.frame_duration_us)
    settings.push_back(setting);
  if (setting.exposure_us) exposure_us = *setting.exposure_us;
  if (setting.gain) gain = setting.gain;
  if (setting.auto_exposure) is_automatic = setting.auto_exposure;
}

// --- what the driver calls

int FakeLibcamera::System::open(const char* name, drivers::FinishedRequests* finished, const char** what) {
  *what = "the fake has no such camera";
  if (!camera_->plugged || std::string_view(name) != kName) return -ENOENT;
  *what = "another program has the fake";
  if (camera_->busy) return -EBUSY;
  camera_->finished = finished;
  ++camera_->opened;
  if (camera_->on_open) camera_->on_open();
  return 0;
}

void FakeLibcamera::System::close() {
  if (camera_->finished == nullptr) return;
  ++camera_->closed;
  if (camera_->on_close) camera_->on_close();
  // What is queued comes back cancelled, as libcamera's stop() does it.
  for (const std::uint32_t request : camera_->queued_) {
    camera_->frames_[request].status = LibcameraFrame::Status::kCancelled;
    (void)camera_->finished->push(request);
  }
  camera_->queued_.clear();
  camera_->streaming_ = false;
  camera_->finished = nullptr;
}

int FakeLibcamera::System::configure(CameraFormat format, int width_px, int height_px, int /*buffers*/,
                                     LibcameraStream* stream, const char** /*what*/) {
  const auto& formats = camera_->formats;
  if (std::find(formats.begin(), formats.end(), format) == formats.end()) return -ENOTSUP;
  if (width_px != camera_->width_px || height_px != camera_->height_px) return -ENOTSUP;
  camera_->configured = format;
  const int bytes_a_pixel = format == CameraFormat::kRgb24 ? 3 : format == CameraFormat::kYuyv ? 2 : 1;
  *stream = camera_->has;
  stream->row_stride = width_px * bytes_a_pixel + camera_->stride_padding;
  stream->requests = camera_->requests;
  const auto count = static_cast<std::size_t>(camera_->requests);
  const auto bytes = static_cast<std::size_t>(stream->row_stride) * static_cast<std::size_t>(height_px);
  camera_->memory_.assign(count, std::vector<std::uint8_t>(bytes));
  camera_->frames_.assign(count, {});
  return 0;
}

int FakeLibcamera::System::start(const LibcameraSetting& setting, const char** /*what*/) {
  camera_->note(setting);
  camera_->streaming_ = true;
  ++camera_->streams;
  for (std::uint32_t i = 0; i < camera_->memory_.size(); ++i) camera_->queued_.push_back(i);
  return 0;
}

void FakeLibcamera::System::read(std::uint32_t request, LibcameraFrame* frame) {
  *frame = camera_->frames_[request];
}

int FakeLibcamera::System::give_back(std::uint32_t request, const LibcameraSetting& setting) {
  if (camera_->give_back_error != 0) return -camera_->give_back_error;
  camera_->note(setting);
  camera_->queued_.push_back(request);
  return 0;
}

}  // namespace farpoint::test
