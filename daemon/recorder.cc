#include "daemon/recorder.h"

#include <algorithm>

#include "ipc/channels.h"

namespace farpoint::daemon {

Recorder::Recorder(const std::string& path, const calibration_t& calibration, int camera_index)
    : width_px_(calibration.cameras.at(static_cast<std::size_t>(camera_index)).width),
      height_px_(calibration.cameras.at(static_cast<std::size_t>(camera_index)).height),
      channel_(ipc::kCameraChannelPrefix + std::to_string(camera_index)),
      log_(path),
      images_(kWaiting,
              Image{0, 0, -1, -1.0F,
                    std::vector<std::uint8_t>(static_cast<std::size_t>(width_px_ * height_px_), 0)}) {
  log_.write_message(ipc::kCalibrationChannel, calibration.utime, calibration);
  message_.camera = camera_index;
  message_.width = message_.row_stride = width_px_;
  message_.height = height_px_;
  message_.pixel_format = image_t::PIXEL_FORMAT_GREY;
  message_.size = width_px_ * height_px_;
}

void Recorder::offer(const CapturedImage& image) {
  Image* slot = images_.begin_push();
  if (slot == nullptr) {
    left_out_.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  slot->utime = image.utime;
  slot->sequence = image.sequence;
  slot->exposure_us = image.exposure_us;
  slot->gain = image.gain;
  std::copy(image.image.pixels.begin(), image.image.pixels.end(), slot->pixels.begin());
  images_.end_push();
  arrived_.notify();
}

void Recorder::run() {
  for (;;) {
    const std::uint32_t seen = arrived_.seen();
    const bool last = stop_.load(std::memory_order_acquire);
    write_all();
    if (last) return;
    arrived_.wait(seen);
  }
}

void Recorder::write_all() {
  while (Image* image = images_.front()) {
    message_.utime = image->utime;
    message_.sequence = image->sequence;
    message_.exposure_us = image->exposure_us;
    message_.gain = image->gain;
    message_.data.assign(image->pixels.begin(), image->pixels.end());
    images_.pop();
    const bool stored = log_.write_message(channel_, message_.utime, message_);
    (stored ? written_ : left_out_).fetch_add(1, std::memory_order_relaxed);
  }
}

void Recorder::stop() {
  stop_.store(true, std::memory_order_release);
  arrived_.notify();
}

std::size_t Recorder::bytes() const {
  return kWaiting * images_.sample().pixels.capacity();
}

}  // namespace farpoint::daemon
