// Whether the two cameras of a stereo pair keep together: their images matched by time, and counted. Nothing
// waits for the outcome, which is known up to kPatience_us after an image.
#pragma once

#include <cstdint>
#include <optional>

#include "daemon/input/counts.h"
#include "daemon/input/second_camera.h"
#include "drivers/camera/stereo_pairing.h"

namespace farpoint::daemon {

class StereoWatch {
 public:
  // `second` outlives this.
  StereoWatch(SecondCamera* second, std::int64_t tolerance_us);

  // The first camera's capture thread, after each of its turns: hears of the second camera's images, and
  // takes in its own, if one came. now_us: CLOCK_MONOTONIC, as the images' times.
  void note(std::optional<std::int64_t> utime, std::int64_t now_us);
  // The second camera's images and losses, and what was matched so far.
  void add_to(InputCounts* in) const;

 private:
  // As no image waits, it is only the answer that comes later: long enough for a slow driver.
  static constexpr std::int64_t kPatience_us = 200'000;
  void take_decided(std::int64_t now_us);

  SecondCamera& second_;
  drivers::StereoPairing pairing_;
  std::int64_t left_refused_ = 0, right_refused_ = 0;  // came after their turn
  SecondCamera::News last_;
};

}  // namespace farpoint::daemon
