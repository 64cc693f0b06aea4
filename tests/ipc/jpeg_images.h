// SPDX-License-Identifier: Apache-2.0
// JPEG images for tests.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace farpoint::test {

// One channel: grey; three: RGB.
[[nodiscard]] std::vector<std::uint8_t> to_jpeg(std::span<const std::uint8_t> pixels, int width_px,
                                                int height_px, int channels, bool progressive = false);
// Every pixel alike.
[[nodiscard]] std::vector<std::uint8_t> plain_jpeg(int width_px, int height_px, std::uint8_t grey);

}  // namespace farpoint::test
