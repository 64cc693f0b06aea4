// SPDX-License-Identifier: Apache-2.0
// Line-oriented text files of the data sets. Fields carry file and line, which every error names.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace farpoint::tools {

// One line that is neither blank nor a comment ('#' first), split into fields.
class FieldLine {
 public:
  FieldLine(const std::filesystem::path* file, int number, std::string text, std::string_view separators);

  [[nodiscard]] std::size_t size() const { return fields_.size(); }
  [[nodiscard]] int number() const { return number_; }
  [[nodiscard]] std::string_view text(std::size_t i) const;

  // Field i as a finite number, as an integer, as seconds, as seconds turned into microseconds, as
  // nanoseconds turned into microseconds (both rounded to nearest). Whole numbers of 1e17 and more are taken
  // for nanoseconds since 1970 where seconds are asked for. `what` names the value in the error. Throw
  // InputError.
  [[nodiscard]] double number_at(std::size_t i, std::string_view what) const;
  [[nodiscard]] std::int64_t integer_at(std::size_t i, std::string_view what) const;
  [[nodiscard]] double seconds_at(std::size_t i, std::string_view what) const;
  [[nodiscard]] std::int64_t utime_from_seconds_at(std::size_t i, std::string_view what) const;
  [[nodiscard]] std::int64_t utime_from_nanoseconds_at(std::size_t i, std::string_view what) const;

  // Throws InputError unless the line has at least `count` fields.
  void require_fields(std::size_t count, std::string_view layout) const;
  // Throws InputError "FILE:LINE: message".
  [[noreturn]] void fail(const std::string& message) const;

 private:
  const std::filesystem::path* file_;  // owned by the FieldFile
  int number_;
  std::string text_;
  std::vector<std::pair<std::size_t, std::size_t>> fields_;  // offset and length in text_
};

// A text file read whole. Windows line ends and a missing last line end are accepted.
class FieldFile {
 public:
  // Throws InputError if the file cannot be read.
  FieldFile(std::filesystem::path file, std::string_view separators);
  FieldFile(const FieldFile&) = delete;
  FieldFile& operator=(const FieldFile&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] const std::vector<FieldLine>& lines() const { return lines_; }

 private:
  std::filesystem::path path_;
  std::vector<FieldLine> lines_;
};

inline constexpr std::string_view kBlanks = " \t";
inline constexpr std::string_view kCommaAndBlanks = ", \t";

// The whole file as bytes. Throws InputError.
[[nodiscard]] std::string read_file(const std::filesystem::path& file);
// Replaces the file by the text, through a temporary file; "-" is standard output. Throws InputError if the
// file cannot be opened, std::runtime_error if it cannot be written.
void write_file(const std::string& file, const std::string& text);

}  // namespace farpoint::tools
