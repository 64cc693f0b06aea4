// SPDX-License-Identifier: Apache-2.0
// Writes grey images into a V4L2 output device, such as v4l2loopback's.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "drivers/v4l2/v4l2_system.h"

namespace farpoint::drivers {

struct OutputFormat {
  int width_px = 0, height_px = 0;
  double rate_hz = 0.0;  // passed to the device, which may ignore it
};

class V4l2Output {
 public:
  // Opens the device and starts its stream. Throws std::runtime_error naming the device and the missing
  // capability.
  V4l2Output(std::string device, const OutputFormat& format, std::unique_ptr<V4l2System> system);
  ~V4l2Output();
  V4l2Output(const V4l2Output&) = delete;
  V4l2Output& operator=(const V4l2Output&) = delete;

  // Sends one image with its time (CLOCK_MONOTONIC) as stamp. Returns 0; -EAGAIN while the device holds all
  // buffers (the image may be sent again later); another negative errno after the end of the stream.
  // Precondition: width times height pixels.
  [[nodiscard]] int send(std::span<const std::uint8_t> grey, std::int64_t stamp_us);

 private:
  static constexpr std::size_t kBuffers = 4;
  struct Mapping {
    void* memory = nullptr;
    std::size_t bytes = 0;
  };

  void set_up();
  void require_output();
  void agree_on_format();
  void map_buffers();
  void start();
  [[nodiscard]] int take_back();
  void fill(std::size_t index, std::span<const std::uint8_t> grey);
  void close();
  [[noreturn]] void fail(const std::string& why, int status = 0) const;

  std::string device_;
  OutputFormat format_;
  std::unique_ptr<V4l2System> system_;
  int fd_ = -1;
  std::size_t row_stride_ = 0, image_bytes_ = 0;
  std::array<Mapping, kBuffers> mappings_{};
  std::size_t buffers_ = 0;  // allocated by the device
  std::size_t free_ = 0;     // not with the device
  std::size_t next_ = 0;     // to be filled
  bool streaming_ = false;
};

}  // namespace farpoint::drivers
