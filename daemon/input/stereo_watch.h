// SPDX-License-Identifier: Apache-2.0
// Matches the images of a stereo pair by time, and counts pairs and single images. No image waits for the
// result, which follows within kPatience_us; at once after the second camera went away. A second camera that
// has not come yet may still open, so its partners are counted as alone after kPatience_us.
#pragma once

#include <cstdint>
#include <optional>

#include "daemon/input/counts.h"
#include "daemon/input/second_camera.h"
#include "drivers/camera/stereo_pairing.h"

namespace farpoint::daemon {

class StereoWatch {
 public:
  // `second` outlives this object.
  StereoWatch(SecondCamera* second, std::int64_t tolerance_us);

  // The first camera's capture thread calls it after each of its turns. Takes the second camera's new times
  // and its own image, if any. now_us: CLOCK_MONOTONIC, like the images' times.
  void note(std::optional<std::int64_t> utime, std::int64_t now_us);
  // The second camera's images and losses, and the pairs so far.
  void add_to(InputCounts* in) const;

 private:
  // Delays the count only, since no image waits; long enough for a slow driver.
  static constexpr std::int64_t kPatience_us = 200'000;
  void take_decided(std::int64_t now_us);

  SecondCamera& second_;
  drivers::StereoPairing pairing_;
  std::int64_t left_refused_ = 0, right_refused_ = 0;  // arrived after their turn
  SecondCamera::News last_;
};

}  // namespace farpoint::daemon
