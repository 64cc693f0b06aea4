// SPDX-License-Identifier: Apache-2.0
// Requests for small pictures of the shipped worlds.
#pragma once

#include <string>

#include "tools/simulate/simulation.h"

namespace farpoint::tools::simulate {

// Keys of a map may be replaced, as "key: value" lines at its end would be refused as given twice.
struct Change {
  std::string from, to;
};
[[nodiscard]] SimulationRequest request_for(const std::string& world, int width_px, int height_px,
                                            double duration_s, const std::vector<Change>& changes = {});

// A sensor that adds no noise and does not bend its curve.
inline const char* const kCleanSensor =
    "sensor: {full_well: 200000, read_noise: 0, gamma: 1, vignetting: 0, exposure_s: 0.0005}\n";

}  // namespace farpoint::tools::simulate
