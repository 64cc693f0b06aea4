// SPDX-License-Identifier: Apache-2.0
#include "daemon/input/recorder.h"

#include <algorithm>
#include <stdexcept>

#include "drivers/can/wheel_reader.h"
#include "ipc/channels.h"

namespace farpoint::daemon {

namespace {

// Two seconds of wheels at 100 Hz: longer than a disk makes the recorder wait.
constexpr std::size_t kWaitingWheels = 256;

}  // namespace

Recorder::Channel::Channel(int camera, const camera_calibration_t& calibration, int waiting_images)
    : name(ipc::kCameraChannelPrefix + std::to_string(camera)),
      images(static_cast<std::size_t>(waiting_images),
             Image{{},
                   std::vector<std::uint8_t>(static_cast<std::size_t>(calibration.width * calibration.height),
                                             0)}) {
  message.camera = camera;
  message.width = message.row_stride = calibration.width;
  message.height = calibration.height;
  message.pixel_format = image_t::PIXEL_FORMAT_GREY;
  message.size = calibration.width * calibration.height;
}

Recorder::Recorder(const std::string& path, const RecordConfig& limits, const calibration_t& calibration)
    : recording_(path, limits, calibration), wheels_(kWaitingWheels, drivers::wheels_with_room()) {
  for (const camera_calibration_t& camera : calibration.cameras)
    channels_.emplace_back(static_cast<int>(channels_.size()), camera, limits.waiting_images);
}

void Recorder::offer(int camera, const ipc::GreyImage& image, const drivers::CameraFrame& frame) {
  slam::SpscRing<Image>& images = channels_[static_cast<std::size_t>(camera)].images;
  Image* slot = images.begin_push();
  if (slot == nullptr) {
    left_out_.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  slot->frame = frame;
  std::copy(image.pixels.begin(), image.pixels.end(), slot->pixels.begin());
  images.end_push();
  arrived_.notify();
}

void Recorder::offer(const wheels_t& message) {
  wheels_t* slot = wheels_.begin_push();
  if (slot == nullptr) {
    left_out_.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  *slot = message;  // as many wheels as there is room for
  wheels_.end_push();
  arrived_.notify();
}

void Recorder::run() {
  for (;;) {
    const std::uint32_t seen = arrived_.seen();
    const bool last = stop_.load(std::memory_order_acquire);
    write_all();
    if (last) return;
    if (!recording_.tidy()) arrived_.wait(seen);
  }
}

void Recorder::write_all() {
  for (;;) {
    Channel* channel = oldest();
    if (write_wheels_before(channel)) continue;
    if (channel == nullptr) return;
    write_image(channel);
  }
}

void Recorder::write_image(Channel* channel) {
  Image* image = channel->images.front();
  image_t& message = channel->message;
  message.utime = image->frame.utime;
  message.sequence = image->frame.sequence;
  message.exposure_us = image->frame.exposure_us;
  message.gain = image->frame.gain;
  message.data.assign(image->pixels.begin(), image->pixels.end());
  channel->images.pop();
  ipc::encode(message, &encoded_);
  const bool stored = recording_.write(channel->name, message.utime, encoded_);
  (stored ? written_ : left_out_).fetch_add(1, std::memory_order_relaxed);
}

bool Recorder::write_wheels_before(Channel* channel) {
  const wheels_t* message = wheels_.front();
  if (message == nullptr) return false;
  if (channel != nullptr && channel->images.front()->frame.utime < message->utime) return false;
  ipc::encode(*message, &encoded_);
  if (!recording_.write(ipc::kWheelsChannel, message->utime, encoded_))
    left_out_.fetch_add(1, std::memory_order_relaxed);
  wheels_.pop();
  return true;
}

Recorder::Channel* Recorder::oldest() {
  Channel* found = nullptr;
  std::int64_t found_utime = 0;
  for (Channel& channel : channels_) {
    const Image* image = channel.images.front();
    if (image == nullptr || (found != nullptr && image->frame.utime >= found_utime)) continue;
    found = &channel;
    found_utime = image->frame.utime;
  }
  return found;
}

void Recorder::close() {
  const std::string problem = recording_.close();
  if (problem.empty()) return;
  throw std::runtime_error("the recording misses " + std::to_string(left_out()) +
                           " images, what was written is kept: " + problem);
}

void Recorder::stop() {
  stop_.store(true, std::memory_order_release);
  arrived_.notify();
}

}  // namespace farpoint::daemon
