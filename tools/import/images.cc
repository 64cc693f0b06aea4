// SPDX-License-Identifier: Apache-2.0
#include "tools/import/images.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <optional>

#include "tools/common/errors.h"
#include "tools/common/numbers.h"
#include "tools/common/text_file.h"
#include "tools/evaluate/statistics.h"

namespace farpoint::tools {
namespace {

namespace fs = std::filesystem;

constexpr double kMinRate_hz = 1e-3, kMaxRate_hz = 10'000.0;
constexpr std::uintmax_t kMaxStampFileBytes = std::uintmax_t{64} << 20;
// Units are a factor of 1000 apart, as are these limits, so exactly one unit fits an interval.
constexpr double kLeastInterval_s = 2e-3, kMostInterval_s = 2.0;
constexpr std::array kUnits = {StampUnit::kSeconds, StampUnit::kMilliseconds, StampUnit::kMicroseconds,
                               StampUnit::kNanoseconds};

// One stamp as it was found.
struct Stamp {
  std::string text;
  std::string where;  // for errors: FILE:LINE or the picture
  fs::path picture;
};

double seconds_of(StampUnit unit) {
  switch (unit) {
    case StampUnit::kMilliseconds:
      return 1e-3;
    case StampUnit::kMicroseconds:
      return 1e-6;
    case StampUnit::kNanoseconds:
      return 1e-9;
    case StampUnit::kAuto:
    case StampUnit::kSeconds:
      break;
  }
  return 1.0;
}

bool is_picture_name(const fs::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension == ".png" || extension == ".jpg" || extension == ".jpeg";
}

std::vector<fs::path> list_pictures(const fs::path& folder) {
  std::vector<fs::path> pictures;
  std::size_t others = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    if (is_picture_name(entry.path())) {
      pictures.push_back(entry.path());
    } else {
      ++others;
    }
  }
  if (pictures.empty()) {
    throw InputError(folder.string() + ": none of its " + std::to_string(others) +
                     " files is a picture, expected names that end in .png, .jpg or .jpeg");
  }
  std::sort(pictures.begin(), pictures.end(), [](const fs::path& a, const fs::path& b) {
    return name_less(a.filename().string(), b.filename().string());
  });
  return pictures;
}

// ---- stamps ----

[[noreturn]] void refuse_stamp(const Stamp& stamp, const std::string& expected) {
  throw InputError(stamp.where + ": expected " + expected + ", found '" + stamp.text + "'");
}

double number_of(const Stamp& stamp) {
  double value = 0.0;
  const char* const last = stamp.text.data() + stamp.text.size();
  const auto [end, error] = std::from_chars(stamp.text.data(), last, value);
  if (error != std::errc() || end != last || !std::isfinite(value))
    refuse_stamp(stamp, "a number as the stamp (a heading begins with #)");
  return value;
}

// Rounds to microseconds. Nanoseconds since 1970 have more digits than a double: integers stay integers.
std::int64_t utime_of(const Stamp& stamp, StampUnit unit) {
  const double value_us = number_of(stamp) * (1e6 * seconds_of(unit));
  if (!(value_us >= 0.0 && value_us <= static_cast<double>(kMaxUtime)))
    refuse_stamp(stamp, std::string("a stamp of 0 to 9e9 seconds (read as ") + to_string(unit) + ")");
  const std::optional<std::int64_t> integer = whole_number(stamp.text);
  if (unit == StampUnit::kNanoseconds && integer) return microseconds_of(*integer);
  return std::llround(value_us);
}

// Refuses stamps that are dates of 2001 to 2103 in another unit, in which their pace is possible.
void refuse_other_date(const std::vector<Stamp>& stamps, double interval, StampUnit unit) {
  constexpr double kFirstDate_s = 1e9, kLastDate_s = 4.2e9, kFastest_s = 1e-4, kSlowest_s = 3600.0;
  for (const StampUnit other : kUnits) {
    const double unit_s = seconds_of(other), interval_s = interval * unit_s;
    const bool dates =
        number_of(stamps.front()) * unit_s >= kFirstDate_s && number_of(stamps.back()) * unit_s < kLastDate_s;
    if (other != unit && dates && interval_s >= kFastest_s && interval_s <= kSlowest_s)
      throw InputError(stamps.front().where + ": dates in " + to_string(other) +
                       ", while the pace is one in " + to_string(unit) + ", expected --unit");
  }
}

StampUnit unit_of(const std::vector<Stamp>& stamps) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < stamps.size(); ++i) {
    const std::optional<std::int64_t> from = whole_number(stamps[i - 1].text),
                                      to = whole_number(stamps[i].text);
    // Doubles of nanoseconds since 1970 are 256 ns apart.
    intervals.push_back(from && to ? static_cast<double>(*to) - static_cast<double>(*from)
                                   : number_of(stamps[i]) - number_of(stamps[i - 1]));
  }
  const double largest = number_of(stamps.back());
  const double interval = intervals.empty() ? 0.0 : percentile(std::move(intervals), 50.0);
  for (const StampUnit unit : kUnits) {
    const double interval_s = interval * seconds_of(unit);
    if (interval_s < kLeastInterval_s || interval_s >= kMostInterval_s) continue;
    refuse_other_date(stamps, interval, unit);
    return unit;
  }
  if (interval != 0.0) {
    throw InputError(stamps.front().where +
                     ": no unit gives a median interval of 2 ms to 2 s, expected --unit s, ms, us or ns");
  }
  // A single stamp: the largest unit in which it is a date.
  const auto fits = [&](StampUnit unit) {
    return largest * seconds_of(unit) * 1e6 <= static_cast<double>(kMaxUtime);
  };
  const auto* const found = std::find_if(kUnits.begin(), kUnits.end(), fits);
  return found != kUnits.end() ? *found : StampUnit::kNanoseconds;
}

std::vector<Stamp> stamps_of_names(const std::vector<fs::path>& pictures) {
  std::vector<Stamp> stamps;
  stamps.reserve(pictures.size());
  for (const fs::path& picture : pictures)
    stamps.push_back({picture.stem().string(), picture.string(), picture});
  return stamps;
}

// A name from the stamp file; it stays within the folder.
fs::path picture_of(const fs::path& folder, const FieldLine& line) {
  const fs::path name = std::string(line.text(1));
  const bool leaves = std::find(name.begin(), name.end(), "..") != name.end();
  if (name.is_absolute() || leaves)
    line.fail("expected the name of a picture within " + folder.string() + ", found '" + name.string() + "'");
  return folder / name;
}

void check_size(const fs::path& file) {
  std::error_code error;
  const fs::file_status status = fs::status(file, error);
  if (!fs::exists(status) || fs::is_directory(status)) return;  // refused by the reader
  const std::uintmax_t bytes = fs::file_size(file, error);
  if (error || bytes > kMaxStampFileBytes)
    throw InputError(file.string() + ": expected a text file of stamps of at most 64 MiB");
}

std::vector<Stamp> stamps_of_file(const fs::path& file, const fs::path& folder,
                                  const std::vector<fs::path>& pictures) {
  check_size(file);
  const FieldFile text(file, kCommaAndBlanks);
  if (text.lines().empty()) throw InputError(file.string() + ": holds no stamp, expected one a line");
  const bool named = text.lines().front().size() > 1;
  if (!named && text.lines().size() != pictures.size()) {
    throw InputError(file.string() + ": holds " + std::to_string(text.lines().size()) +
                     " stamps, expected one for each of the " + std::to_string(pictures.size()) +
                     " pictures in " + folder.string() + ", or lines 'stamp name'");
  }
  std::vector<Stamp> stamps;
  for (const FieldLine& line : text.lines()) {
    line.require_fields(named ? 2 : 1, "stamp name, as in the first line");
    stamps.push_back({std::string(line.text(0)), file.string() + ":" + std::to_string(line.number()),
                      named ? picture_of(folder, line) : pictures[stamps.size()]});
  }
  return stamps;
}

// ---- pictures with times ----

void add_at_rate(const std::vector<fs::path>& pictures, double rate_hz, Recording* recording) {
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const auto number = static_cast<std::int64_t>(i);
    const std::int64_t utime = std::llround(static_cast<double>(number) * 1e6 / rate_hz);
    recording->images.push_back({utime, number, 0, pictures[i]});
  }
}

void add_at_stamps(const std::vector<Stamp>& stamps, StampUnit unit, Recording* recording) {
  std::int64_t last_utime = -1, number = 0;
  for (const Stamp& stamp : stamps) {
    const std::int64_t utime = utime_of(stamp, unit);
    if (utime <= last_utime)
      refuse_stamp(stamp, std::string("a stamp after the one before (read as ") + to_string(unit) + ")");
    last_utime = utime;
    if (fs::is_regular_file(stamp.picture)) {
      recording->images.push_back({utime, number, 0, stamp.picture});
    } else {
      ++recording->missing_images;
    }
    ++number;
  }
}

void check_times(const PictureTimes& times) {
  const bool has_rate = times.rate_hz != 0.0, has_stamps = !times.stamps.empty();
  if (has_rate == has_stamps) throw InputError("import images: expected one of --rate HZ and --times FILE");
  if (has_rate && !(times.rate_hz >= kMinRate_hz && times.rate_hz <= kMaxRate_hz))
    throw InputError("--rate: expected pictures a second, 0.001 to 10000");
}

}  // namespace

const char* to_string(StampUnit unit) {
  switch (unit) {
    case StampUnit::kAuto:
      return "auto";
    case StampUnit::kSeconds:
      return "s";
    case StampUnit::kMilliseconds:
      return "ms";
    case StampUnit::kMicroseconds:
      return "us";
    case StampUnit::kNanoseconds:
      return "ns";
  }
  return "?";
}

bool name_less(const std::string& a, const std::string& b) {
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  // One number without its leading zeros; moves *at behind it.
  const auto number_at = [&](const std::string& text, std::size_t* at) {
    while (*at < text.size() && text[*at] == '0') ++*at;
    const std::size_t begin = *at;
    while (*at < text.size() && is_digit(text[*at])) ++*at;
    return std::string_view{text}.substr(begin, *at - begin);
  };
  std::size_t i = 0, k = 0;
  while (i < a.size() && k < b.size()) {
    if (is_digit(a[i]) && is_digit(b[k])) {
      const std::string_view x = number_at(a, &i), y = number_at(b, &k);
      if (x.size() != y.size()) return x.size() < y.size();
      if (x != y) return x < y;
    } else if (a[i] != b[k]) {
      return a[i] < b[k];
    } else {
      ++i;
      ++k;
    }
  }
  const bool ends = i == a.size(), other_ends = k == b.size();
  return ends == other_ends ? a < b : ends;  // img1 and img01: any order that is always the same
}

Recording read_images(const fs::path& folder, const fs::path& camera_file, const PictureTimes& times,
                      StampUnit* unit_used) {
  check_times(times);
  require_folder(folder, "pictures");
  Recording recording;
  add_camera(camera_file, "camera", &recording);
  const std::vector<fs::path> pictures = list_pictures(folder);
  if (times.stamps.empty()) {
    add_at_rate(pictures, times.rate_hz, &recording);
  } else {
    const std::vector<Stamp> stamps =
        times.stamps == "names" ? stamps_of_names(pictures) : stamps_of_file(times.stamps, folder, pictures);
    const StampUnit unit = times.unit == StampUnit::kAuto ? unit_of(stamps) : times.unit;
    if (unit_used != nullptr) *unit_used = unit;
    add_at_stamps(stamps, unit, &recording);
    if (stamps.size() < pictures.size())
      recording.notices.push_back(times.stamps + ": names " + std::to_string(stamps.size()) + " of " +
                                  std::to_string(pictures.size()) + " pictures, the others were left out");
  }
  if (recording.images.empty()) {
    throw InputError(times.stamps + ": none of the pictures that it names exists in " + folder.string());
  }
  complete_cameras(camera_file, &recording);
  return recording;
}

}  // namespace farpoint::tools
