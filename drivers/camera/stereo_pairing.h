// SPDX-License-Identifier: Apache-2.0
// Matches the images of two cameras by time. An image without a partner becomes a monocular frame and is
// counted. Fixed memory, no lock, no clock; all calls come from one thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "drivers/camera/camera.h"

namespace farpoint::drivers {

struct StereoOptions {
  // Largest time difference within a pair. Must be below half a frame period, or the match is ambiguous.
  std::int64_t tolerance_us = 5'000;
  // Longest wait of an image for a partner, from its arrival.
  std::int64_t patience_us = 20'000;
};

// A pair, or one image alone.
struct StereoFrame {
  std::optional<CameraFrame> left, right;
  [[nodiscard]] bool is_pair() const { return left && right; }
  [[nodiscard]] std::int64_t utime() const { return left ? left->utime : right->utime; }
};

struct StereoCounts {
  std::int64_t pairs = 0, left_alone = 0, right_alone = 0;
  // Refused: the time is not after the previous image's, or not after that of a frame already returned.
  std::int64_t late = 0;
};

class StereoPairing {
 public:
  enum class Side : std::uint8_t { kLeft, kRight };

  explicit StereoPairing(const StereoOptions& options) : options_(options) {}

  // Adds an image that arrived at `now_us` (clock of the images). Returns false for a refused image
  // (counted). Precondition: take() was called until false since the last
  // put().
  [[nodiscard]] bool put(Side side, const CameraFrame& image, std::int64_t now_us);
  // Returns the next frame in order of time; false while none is decided. Call again after due_us().
  [[nodiscard]] bool take(std::int64_t now_us, StereoFrame* frame);
  // Time at which a waiting image becomes a frame alone; empty: none waits.
  [[nodiscard]] std::optional<std::int64_t> due_us() const;
  // Images do not wait for partners from an absent camera.
  void set_away(Side side, bool away) { queue(side).away = away; }

  [[nodiscard]] const StereoCounts& counts() const { return counts_; }

 private:
  static constexpr std::size_t kWaiting = 8;  // of one side; more than patience_us admits

  struct Waiting {
    CameraFrame image;
    std::int64_t came_us = 0;
  };
  struct Queue {
    std::array<Waiting, kWaiting> images{};
    std::size_t first = 0, count = 0;
    std::optional<std::int64_t> last_utime;
    bool away = false;

    [[nodiscard]] bool is_full() const { return count == kWaiting; }
    [[nodiscard]] const Waiting* front() const { return count > 0 ? &images.at(first) : nullptr; }
    void push(const Waiting& image) { images.at((first + count++) % kWaiting) = image; }
    CameraFrame pop();
  };

  [[nodiscard]] Queue& queue(Side side) { return side == Side::kLeft ? left_ : right_; }
  [[nodiscard]] bool waits_in_vain(const Queue& own, const Queue& other, std::int64_t now_us) const;
  [[nodiscard]] StereoFrame decide_both();
  void count(const StereoFrame& frame);

  StereoOptions options_;
  Queue left_, right_;
  std::optional<std::int64_t> gone_utime_;  // of the last frame returned
  StereoCounts counts_;
};

}  // namespace farpoint::drivers
