// SPDX-License-Identifier: Apache-2.0
// Converts light to grey values: automatic exposure, lens fall-off, shot and read noise, tone curve.
#pragma once

#include <cstdint>
#include <vector>

#include "tools/simulate/world/random.h"
#include "tools/simulate/world/world_description.h"

namespace farpoint::tools::simulate {

struct Exposure {
  double time_s = 0.0;
  double gain = 1.0;
};

class CameraSensor {
 public:
  CameraSensor(const SensorDescription& description, const slam::Camera::Parameters& camera,
               std::uint64_t seed);

  // For the next frame, at a time.
  [[nodiscard]] Exposure exposure_at(double time_s) const;
  // Converts the radiance of each pixel (1: white in full sun) to grey values. Then sets the next exposure by
  // the result, as cameras do.
  void expose(const std::vector<float>& radiance, const Exposure& exposure, double time_s,
              double frame_interval_s, std::uint8_t* grey);

 private:
  [[nodiscard]] double jump_at(double time_s) const;

  SensorDescription d_;
  std::uint64_t seed_;
  std::vector<float> fall_off_;           // of each pixel
  std::vector<float> normal_;             // a table of normal deviates
  std::vector<std::uint8_t> tone_curve_;  // from the share of the full well
  double level_ = 1.0;                    // exposure, 1: the description's
  bool has_metered_ = false;
  std::uint64_t frames_ = 0;
};

}  // namespace farpoint::tools::simulate
