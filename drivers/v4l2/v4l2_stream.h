// SPDX-License-Identifier: Apache-2.0
// Maps the driver's buffers of one streaming V4L2 node, takes filled ones and returns them.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "drivers/v4l2/v4l2_format.h"

namespace farpoint::drivers {

// A filled buffer, valid until give_back().
struct V4l2Buffer {
  std::uint32_t index = 0;
  std::span<const std::uint8_t> bytes;  // filled by the driver
  std::int64_t stamp_us = 0;
  std::uint32_t flags = 0, sequence = 0;
};

class V4l2Stream {
 public:
  static constexpr int kMaxBuffers = 16;

  V4l2Stream(V4l2System* system, const V4l2Node& node) : system_(system), node_(node) {}
  ~V4l2Stream();
  V4l2Stream(const V4l2Stream&) = delete;
  V4l2Stream& operator=(const V4l2Stream&) = delete;

  // Returns 0, or negative errno; *what names the failed step.
  [[nodiscard]] int start(int buffers, const char** what);
  // Takes the oldest filled buffer; -EAGAIN without one.
  [[nodiscard]] int take(V4l2Buffer* buffer);
  [[nodiscard]] int give_back(const V4l2Buffer& buffer);

 private:
  struct Mapping {
    void* memory = nullptr;
    std::size_t bytes = 0;
  };
  [[nodiscard]] int map(std::uint32_t index);
  [[nodiscard]] int queue(std::uint32_t index);

  V4l2System* system_;
  V4l2Node node_;
  bool streaming_ = false;
  std::array<Mapping, kMaxBuffers> mappings_{};
};

}  // namespace farpoint::drivers
