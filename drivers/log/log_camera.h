// SPDX-License-Identifier: Apache-2.0
// A recorded log as a live camera: its images come at the recording's pace and without end. Each time is the
// moment at which the image is due, CLOCK_MONOTONIC, so that steps between times are the recording's.
//
// For trials without hardware: give_back() reads the next image from the disk and decodes it, on the capture
// thread. It makes no heap call, except at the end of the log, where it is opened anew.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "drivers/camera/camera_device.h"
#include "drivers/log/log_source.h"

namespace farpoint::drivers {

class LogCamera final : public CameraDevice {
 public:
  // options.device: path of the log; options.index: N of its channel CAMERA_N.
  explicit LogCamera(const CameraOptions& options) : options_(options) {}
  ~LogCamera() override { close(); }
  LogCamera(const LogCamera&) = delete;
  LogCamera& operator=(const LogCamera&) = delete;

  // The first open() begins with the log's first image, a later one with the image that was next.
  [[nodiscard]] CameraEvent open() override;
  void close() override;
  [[nodiscard]] int fd() const override { return timer_fd_; }
  [[nodiscard]] int take(RawFrame* raw, const char** what) override;
  // Reads the next image. Passes over images that are late by more than options.buffers periods, as a camera
  // does whose buffers are all full.
  [[nodiscard]] int give_back(const char** what) override;
  void adapt_exposure(const ipc::GreyImage& /*image*/) override {}
  void set_exposure(const ExposureOptions& /*options*/) override {}

 private:
  // One image that waits for its time.
  struct Next {
    std::int64_t due_us = 0;
    std::int32_t exposure_us = -1;
    float gain = -1.0F;
  };
  [[nodiscard]] bool read_next();
  [[nodiscard]] bool read_item(LogItem* item);
  [[nodiscard]] bool begin_again();
  [[nodiscard]] std::int64_t due_us(std::int64_t utime);
  void arm() const;

  CameraOptions options_;
  std::optional<LogSource> source_;
  ipc::GreyImage image_;  // of next_
  std::optional<Next> next_;
  std::uint32_t sequence_ = 0;
  std::int64_t period_us_ = 0;             // last step between two images; 0: unknown
  std::optional<std::int64_t> log_utime_;  // of the last image read
  std::optional<std::int64_t>
      loop_offset_us_;  // due time minus log time; empty: the next image begins a loop
  std::int64_t last_due_us_ = 0;
  int timer_fd_ = -1;
};

}  // namespace farpoint::drivers
