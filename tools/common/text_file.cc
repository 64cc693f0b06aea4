// SPDX-License-Identifier: Apache-2.0
#include "tools/common/text_file.h"

#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <limits>
#include <memory>
#include <optional>

#include "ipc/output_file.h"
#include "tools/common/errors.h"
#include "tools/common/numbers.h"

namespace farpoint::tools {
namespace {

constexpr double kMaxSeconds = static_cast<double>(kMaxUtime) / 1e6;

// Microseconds of a stamp that is a date in nanoseconds: of 1973 on. As seconds it would be beyond any clock.
std::optional<std::int64_t> date_in_nanoseconds(std::string_view text) {
  constexpr std::int64_t kFirst_ns = 100'000'000'000'000'000;
  const std::optional<std::int64_t> value = whole_number(text);
  if (!value || *value < kFirst_ns) return {};
  return microseconds_of(*value);
}

}  // namespace

FieldLine::FieldLine(const std::filesystem::path* file, int number, std::string text,
                     std::string_view separators)
    : file_(file), number_(number), text_(std::move(text)) {
  std::size_t begin = text_.find_first_not_of(separators);
  while (begin != std::string::npos) {
    const std::size_t end = std::min(text_.find_first_of(separators, begin), text_.size());
    fields_.emplace_back(begin, end - begin);
    begin = text_.find_first_not_of(separators, end);
  }
}

std::string_view FieldLine::text(std::size_t i) const {
  return std::string_view{text_}.substr(fields_.at(i).first, fields_.at(i).second);
}

void FieldLine::fail(const std::string& message) const {
  throw InputError(file_->string() + ":" + std::to_string(number_) + ": " + message);
}

void FieldLine::require_fields(std::size_t count, std::string_view layout) const {
  if (size() >= count) return;
  fail("expected " + std::to_string(count) + " fields (" + std::string(layout) + "), found " +
       std::to_string(size()));
}

double FieldLine::number_at(std::size_t i, std::string_view what) const {
  std::string_view field = text(i);
  if (field.starts_with('+')) field.remove_prefix(1);  // from_chars takes no plus sign
  double value = 0.0;
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  if (error != std::errc() || end != field.data() + field.size() || !std::isfinite(value)) {
    fail("expected a finite number for " + std::string(what) + ", found '" + std::string(field) + "'");
  }
  return value;
}

std::int64_t FieldLine::integer_at(std::size_t i, std::string_view what) const {
  const std::optional<std::int64_t> value = whole_number(text(i));
  if (!value) fail("expected an integer for " + std::string(what) + ", found '" + std::string(text(i)) + "'");
  return *value;
}

double FieldLine::seconds_at(std::size_t i, std::string_view what) const {
  const std::optional<std::int64_t> utime = date_in_nanoseconds(text(i));
  return utime ? static_cast<double>(*utime) * 1e-6 : number_at(i, what);
}

std::int64_t FieldLine::utime_from_seconds_at(std::size_t i, std::string_view what) const {
  if (const std::optional<std::int64_t> utime = date_in_nanoseconds(text(i))) return *utime;
  const double seconds = number_at(i, what);
  if (seconds < 0.0 || seconds > kMaxSeconds) {
    fail("expected " + std::string(what) + " of 0 to 9e9 seconds, found '" + std::string(text(i)) + "'");
  }
  return std::llround(seconds * 1e6);
}

std::int64_t FieldLine::utime_from_nanoseconds_at(std::size_t i, std::string_view what) const {
  const std::int64_t nanoseconds = integer_at(i, what);
  if (nanoseconds < 0)
    fail("expected " + std::string(what) + " >= 0 ns, found '" + std::string(text(i)) + "'");
  return microseconds_of(nanoseconds);
}

FieldFile::FieldFile(std::filesystem::path file, std::string_view separators) : path_(std::move(file)) {
  const std::string content = read_file(path_);
  int number = 0;
  for (std::size_t begin = 0; begin < content.size();) {
    const std::size_t end = std::min(content.find('\n', begin), content.size());
    std::string line = content.substr(begin, end - begin);
    begin = end + 1;
    ++number;
    if (line.ends_with('\r')) line.pop_back();
    const std::size_t first = line.find_first_not_of(separators);
    if (first == std::string::npos || line[first] == '#') continue;
    lines_.emplace_back(&path_, number, std::move(line), separators);
  }
}

std::string read_file(const std::filesystem::path& file) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) {
    throw InputError(file.string() + ": expected a file, found a folder");
  }
  errno = 0;
  std::ifstream stream(file, std::ios::binary | std::ios::ate);
  if (!stream) {
    throw InputError(file.string() + ": cannot be opened (" + std::strerror(errno ? errno : ENOENT) + ")");
  }
  const std::streamoff size = stream.tellg();
  std::string content(static_cast<std::size_t>(std::max<std::streamoff>(size, 0)), '\0');
  stream.seekg(0);
  stream.read(content.data(), static_cast<std::streamsize>(content.size()));
  if (!stream) throw InputError(file.string() + ": cannot be read to its end");
  return content;
}

void write_file(const std::string& file, const std::string& text) {
  const auto open = [&] {
    try {
      return std::make_unique<ipc::OutputFile>(file);
    } catch (const std::runtime_error& e) {
      throw InputError(e.what());
    }
  };
  const std::unique_ptr<ipc::OutputFile> output = open();
  std::fwrite(text.data(), 1, text.size(), output->stream());
  output->close();
}

}  // namespace farpoint::tools
