#include "tests/drivers/fake_libcamera.h"

#include <poll.h>

#include <algorithm>
#include <cerrno>

namespace farpoint::test {

using drivers::CameraFormat;
using drivers::LibcameraFrame;
using drivers::LibcameraSetting;
using drivers::LibcameraStream;

FakeLibcamera::FakeLibcamera() {
  waits_ms.reserve(1 << 16);
  settings.reserve(1 << 10);
  queued.reserve(drivers::FinishedRequests::kMaxRequests);
}

bool FakeLibcamera::show(const FakeShot& shot) {
  if (!streaming || queued.empty()) return false;
  const std::uint32_t request = queued.front();
  queued.erase(queued.begin());
  std::vector<std::uint8_t>& bytes = memory[request];
  LibcameraFrame& frame = frames[request];
  frame = {};
  if (shot.bytes) {
    const std::size_t count = std::min(shot.bytes->size(), bytes.size());
    std::copy_n(shot.bytes->begin(), count, bytes.begin());
    frame.bytes = {bytes.data(), count};
  } else {
    std::fill(bytes.begin(), bytes.end(), shot.grey);
    frame.bytes = bytes;
  }
  frame.status = shot.status;
  frame.sequence = shot.sequence;
  frame.stamp_us = shot.stamp_us.value_or(now.monotonic_us);
  frame.exposure_us = shot.exposure_us;
  frame.gain = shot.gain;
  return finished->push(request);
}

void FakeLibcamera::unplug() {
  plugged = false;
  if (finished != nullptr) finished->set_removed();
}

int FakeLibcameraSystem::open(const char* name, drivers::FinishedRequests* finished, const char** what) {
  camera_->device = name;
  *what = "the fake has no camera";
  if (!camera_->plugged) return -ENOENT;
  *what = "another program has the fake";
  if (camera_->busy) return -EBUSY;
  camera_->finished = finished;
  ++camera_->opened;
  return 0;
}

void FakeLibcameraSystem::close() {
  if (camera_->finished == nullptr) return;
  ++camera_->closed;
  // What is queued comes back cancelled, as libcamera's stop() does it.
  for (const std::uint32_t request : camera_->queued) {
    camera_->frames[request].status = LibcameraFrame::Status::kCancelled;
    (void)camera_->finished->push(request);
  }
  camera_->queued.clear();
  camera_->streaming = false;
  camera_->finished = nullptr;
}

int FakeLibcameraSystem::configure(CameraFormat format, int width_px, int height_px, int /*buffers*/,
                                   LibcameraStream* stream, const char** /*what*/) {
  const auto& formats = camera_->formats;
  if (std::find(formats.begin(), formats.end(), format) == formats.end()) return -ENOTSUP;
  if (width_px != camera_->width_px || height_px != camera_->height_px) return -ENOTSUP;
  camera_->configured = format;
  const int bytes_a_pixel = format == CameraFormat::kYuyv ? 2 : 1;
  camera_->row_stride = width_px * bytes_a_pixel + camera_->stride_padding;
  *stream = camera_->has;
  stream->row_stride = camera_->row_stride;
  stream->requests = camera_->requests;
  const auto count = static_cast<std::size_t>(camera_->requests);
  const auto bytes = static_cast<std::size_t>(camera_->row_stride) * static_cast<std::size_t>(height_px);
  camera_->memory.assign(count, std::vector<std::uint8_t>(bytes));
  camera_->frames.assign(count, {});
  return 0;
}

int FakeLibcameraSystem::start(const LibcameraSetting& setting, const char** /*what*/) {
  note(setting);
  camera_->streaming = true;
  ++camera_->starts;
  for (std::uint32_t i = 0; i < camera_->memory.size(); ++i) camera_->queued.push_back(i);
  return 0;
}

void FakeLibcameraSystem::read(std::uint32_t request, LibcameraFrame* frame) {
  *frame = camera_->frames[request];
}

int FakeLibcameraSystem::give_back(std::uint32_t request, const LibcameraSetting& setting) {
  if (camera_->queue_error != 0) return -camera_->queue_error;
  note(setting);
  camera_->queued.push_back(request);
  return 0;
}

void FakeLibcameraSystem::note(const LibcameraSetting& setting) {
  if (setting.auto_exposure || setting.exposure_us || setting.gain || setting.frame_duration_us)
    camera_->settings.push_back(setting);
}

void FakeCameraWait::wait(int fd, int timeout_ms) {
  camera_->waits_ms.push_back(timeout_ms);
  pollfd descriptor{fd, POLLIN, 0};
  const bool something = poll(&descriptor, 1, 0) > 0;
  const std::int64_t passed_us = something ? 1000 : std::int64_t{1000} * timeout_ms;
  camera_->now.monotonic_us += passed_us;
  camera_->now.boottime_us += passed_us;
  camera_->now.realtime_us += passed_us;
}

}  // namespace farpoint::test
