// SPDX-License-Identifier: Apache-2.0
// --record: writes the cameras' images to a log that can be replayed, on a thread of its own (fp-record).
// When the disk is too slow or full, images are left out and counted; no thread waits, and what was written
// is kept (recording.h).
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "daemon/config/config.h"
#include "daemon/input/recording.h"
#include "daemon/system/notifier.h"
#include "drivers/camera/camera.h"
#include "ipc/image_codec.h"
#include "ipc/message.h"
#include "slam/spsc_ring.h"

namespace farpoint::daemon {

class Recorder {
 public:
  static constexpr const char* kThread = "fp-record";

  // Records all cameras of the calibration, which begins each file. Throws std::runtime_error if none can be
  // written.
  Recorder(const std::string& path, const RecordConfig& limits, const calibration_t& calibration);

  // Capture thread of this camera.
  void offer(int camera, const ipc::GreyImage& image, const drivers::CameraFrame& frame);
  // Thread of the wheels. Makes no heap call.
  void offer(const wheels_t& message);
  // Recorder's thread: writes until stop(), then the remaining images. Between images it finishes what a
  // killed run left.
  void run();
  // Call after the end of capture.
  void stop();
  // Call after run() has returned. Finishes the recording and keeps it in any case. Throws std::runtime_error
  // if images are missing for a failure of the disk.
  void close();
  // Call after close(): the files written.
  [[nodiscard]] std::vector<std::string> files() const { return recording_.files(); }

  // Images of all cameras. Measurements of the wheels that find no room are left out too.
  [[nodiscard]] std::int64_t written() const { return written_.load(); }
  [[nodiscard]] std::int64_t left_out() const { return left_out_.load(); }

 private:
  struct Image {
    drivers::CameraFrame frame;
    std::vector<std::uint8_t> pixels;
  };
  // One ring a camera, since one thread pushes into a ring.
  struct Channel {
    Channel(int camera, const camera_calibration_t& calibration, int waiting_images);
    const std::string name;
    image_t message{};
    slam::SpscRing<Image> images;
  };
  void write_all();
  void write_image(Channel* channel);
  // The oldest measurement of the wheels, if it is not after that image. Null: no image waits.
  bool write_wheels_before(Channel* channel);
  // Returns the channel with the oldest waiting image; null without one.
  [[nodiscard]] Channel* oldest();

  Recording recording_;
  std::vector<std::uint8_t> encoded_;
  std::deque<Channel> channels_;  // rings do not move
  slam::SpscRing<wheels_t> wheels_;
  Notifier arrived_;
  std::atomic<bool> stop_{false};
  std::atomic<std::int64_t> written_{0}, left_out_{0};
};

}  // namespace farpoint::daemon
