// --record: what the cameras gave, as a log that can be replayed. Written on a thread of its own; when the
// disk cannot follow, images are left out and counted, and nobody waits.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "daemon/system/notifier.h"
#include "drivers/camera/camera.h"
#include "ipc/image_codec.h"
#include "ipc/log.h"
#include "ipc/message.h"
#include "slam/spsc_ring.h"

namespace farpoint::daemon {

class Recorder {
 public:
  static constexpr const char* kThread = "fp-record";

  // For all cameras of the calibration, with which the log begins. Throws std::runtime_error where it cannot
  // be written.
  Recorder(const std::string& path, const calibration_t& calibration);

  // The capture thread of this camera.
  void offer(int camera, const ipc::GreyImage& image, const drivers::CameraFrame& frame);
  // The recorder's thread: writes until stop() and all is written.
  void run();
  // After capture has ended.
  void stop();
  // After run() has returned. Throws std::runtime_error where something was not stored.
  void close() { log_.close(); }

  // Of all cameras.
  [[nodiscard]] std::int64_t written() const { return written_.load(); }
  [[nodiscard]] std::int64_t left_out() const { return left_out_.load(); }

 private:
  static constexpr std::size_t kWaiting = 60;  // images of a camera: two seconds of an ordinary one
  struct Image {
    drivers::CameraFrame frame;
    std::vector<std::uint8_t> pixels;
  };
  // One camera's, as a ring has one thread that pushes.
  struct Channel {
    Channel(int camera, const camera_calibration_t& calibration);
    const std::string name;
    image_t message{};
    slam::SpscRing<Image> images;
  };
  void write_all();
  // Whose oldest waiting image is the oldest of all; null where none waits.
  [[nodiscard]] Channel* oldest();

  ipc::LogWriter log_;
  std::deque<Channel> channels_;  // rings do not move
  Notifier arrived_;
  std::atomic<bool> stop_{false};
  std::atomic<std::int64_t> written_{0}, left_out_{0};
};

}  // namespace farpoint::daemon
