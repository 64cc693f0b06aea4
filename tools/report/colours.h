// SPDX-License-Identifier: Apache-2.0
// Colours of a value: from dark blue (low) by green to yellow (high), of rising lightness, so that the order
// stays visible in grey and to the colour-blind.
#pragma once

#include <string>

namespace farpoint::tools::report {

inline constexpr int kColourLevels = 16;

// Level 0 .. kColourLevels - 1 of a value in a range; ends beyond it, 0 for NaN.
[[nodiscard]] int colour_level(double value, double low, double high);
// `#rrggbb` of a level.
[[nodiscard]] std::string level_colour(int level);

}  // namespace farpoint::tools::report
