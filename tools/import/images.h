// SPDX-License-Identifier: Apache-2.0
// A folder of pictures of one camera: PNG and JPEG files, in the order of their names. Numbers in names
// compare as numbers, so frame_9 comes before frame_10.
#pragma once

#include <filesystem>
#include <string>

#include "tools/import/recording.h"

namespace farpoint::tools {

enum class StampUnit : std::uint8_t {
  kAuto,  // the unit in which the median interval is at least 2 ms and less than 2 s
  kSeconds,
  kMilliseconds,
  kMicroseconds,
  kNanoseconds,
};

// Where the times of the pictures come from; exactly one of rate_hz and stamps is set.
struct PictureTimes {
  double rate_hz = 0.0;  // picture i is at i / rate_hz; 0 unset
  // A text file, or "names": the files' names are the stamps. A line is one stamp for each picture in order,
  // or `stamp name` of one picture. Separators are commas and blanks.
  std::string stamps;
  StampUnit unit = StampUnit::kAuto;
};

// Listed pictures that are absent are counted and left out. Sets *unit_used (may be null) to the unit of the
// stamps. Throws InputError naming file and line.
[[nodiscard]] Recording read_images(const std::filesystem::path& folder,
                                    const std::filesystem::path& camera_file, const PictureTimes& times,
                                    StampUnit* unit_used = nullptr);

// "s", "ms", "us", "ns" or "auto", as --unit takes them.
[[nodiscard]] const char* to_string(StampUnit unit);

// True where `a` comes before `b`: numbers compare as numbers, other characters as bytes.
[[nodiscard]] bool name_less(const std::string& a, const std::string& b);

}  // namespace farpoint::tools
