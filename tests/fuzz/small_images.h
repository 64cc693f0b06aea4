// SPDX-License-Identifier: Apache-2.0
// One small picture in each format.
#pragma once

#include <vector>

#include "farpoint/image_t.hpp"

namespace farpoint::fuzz {

inline constexpr int kSmallWidth_px = 24, kSmallHeight_px = 16;

[[nodiscard]] std::vector<image_t> small_images();

}  // namespace farpoint::fuzz
