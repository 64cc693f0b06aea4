// SPDX-License-Identifier: Apache-2.0
// Matches the images of the first camera and a further one by time. Counts pairs and single images, and
// measures how far the images of a pair are apart. No image waits for the result, which follows within
// kPatience_us. While the further camera is away, each image of the first counts as alone at once. Before the
// further camera's first image, it counts as alone after kPatience_us.
#pragma once

#include <cstdint>
#include <optional>

#include "daemon/input/camera_reports.h"
#include "daemon/input/counts.h"
#include "drivers/camera/stereo_pairing.h"

namespace farpoint::daemon {

class StereoWatch {
 public:
  // `further`: reports of the further camera; outlives this object.
  StereoWatch(CameraReports* further, std::int64_t tolerance_us);

  // The first camera's capture thread calls it after each of its turns. Takes the further camera's new
  // reports and its own image, if any. now_us: CLOCK_MONOTONIC, like the images' times.
  void note(const std::optional<drivers::CameraFrame>& image, std::int64_t now_us);
  // Adds the further camera's images and losses, and the pairs so far.
  void add_to(InputCounts* in) const;

 private:
  // Delays the count only, since no image waits; long enough for a slow driver.
  static constexpr std::int64_t kPatience_us = 200'000;
  void take_decided(std::int64_t now_us);

  CameraReports* further_;
  drivers::StereoPairing pairing_;
  std::int64_t left_refused_ = 0, right_refused_ = 0;  // arrived after their turn
  std::int64_t skew_us_ = 0;                           // of the last pair
  CameraReport last_;
};

}  // namespace farpoint::daemon
