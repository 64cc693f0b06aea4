// --record: what the camera gave, as a log that can be replayed. Written on a thread of its own; when the
// disk cannot follow, images are left out and counted, and nobody waits.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "daemon/image_queue.h"
#include "daemon/notifier.h"
#include "ipc/log.h"
#include "ipc/message.h"
#include "slam/spsc_ring.h"

namespace farpoint::daemon {

class Recorder {
 public:
  static constexpr const char* kThread = "fp-record";

  // The log begins with the calibration. Throws std::runtime_error where it cannot be written.
  Recorder(const std::string& path, const calibration_t& calibration, int camera_index);

  // Capture's thread.
  void offer(const CapturedImage& image);
  // The recorder's thread: writes until stop() and all is written.
  void run();
  // After capture has ended.
  void stop();
  // After run() has returned. Throws std::runtime_error where something was not stored.
  void close() { log_.close(); }

  [[nodiscard]] std::int64_t written() const { return written_.load(); }
  [[nodiscard]] std::int64_t left_out() const { return left_out_.load(); }
  [[nodiscard]] std::size_t bytes() const;

 private:
  static constexpr std::size_t kWaiting = 60;  // images: two seconds of an ordinary camera
  struct Image {
    std::int64_t utime = 0, sequence = 0;
    std::int32_t exposure_us = -1;
    float gain = -1.0F;
    std::vector<std::uint8_t> pixels;
  };
  void write_all();

  const int width_px_, height_px_;
  const std::string channel_;
  ipc::LogWriter log_;
  slam::SpscRing<Image> images_;
  image_t message_{};
  Notifier arrived_;
  std::atomic<bool> stop_{false};
  std::atomic<std::int64_t> written_{0}, left_out_{0};
};

}  // namespace farpoint::daemon
