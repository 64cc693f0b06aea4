// SPDX-License-Identifier: Apache-2.0
// A ring of reports from a further camera's thread to the first camera's: data of each image, changes of
// presence, counts. Neither thread waits for the other.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "drivers/camera/camera.h"
#include "slam/spsc_ring.h"

namespace farpoint::daemon {

struct CameraReport {
  std::optional<drivers::CameraFrame> frame;  // empty: no image came
  bool is_streaming = false;
  drivers::CameraCounts counts;
  std::int64_t unreported = 0;  // images without a report so far, since the ring was full
};

class CameraReports {
 public:
  // Further camera's thread, after each of its turns. Pushes an image, a change of presence, or a new number
  // of unreported images; otherwise has no effect.
  void put(const std::optional<drivers::CameraFrame>& frame, bool is_streaming,
           const drivers::CameraCounts& counts);
  // First camera's thread: takes the oldest report; false without one.
  [[nodiscard]] bool take(CameraReport* report);

 private:
  // The first camera's thread reads at least every 0.1 s: enough for 600 images a second.
  static constexpr std::size_t kReports = 64;

  slam::SpscRing<CameraReport> ring_{kReports};
  // Of the pushing thread; the second and the third as reported last.
  std::int64_t unreported_ = 0, reported_unreported_ = 0;
  bool reported_streaming_ = false;
};

}  // namespace farpoint::daemon
