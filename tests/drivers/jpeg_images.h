// Plain JPEG images for tests of MJPEG cameras.
#pragma once

#include <cstdint>
#include <vector>

namespace farpoint::test {

[[nodiscard]] std::vector<std::uint8_t> jpeg_of(int width, int height, std::uint8_t grey);

}  // namespace farpoint::test
