// SPDX-License-Identifier: Apache-2.0
// Strict YAML files: every error names file and line.
#pragma once

#include <yaml-cpp/yaml.h>

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "slam/config.h"

namespace farpoint::daemon {

// Longer YAML files are refused before they are parsed.
inline constexpr std::size_t kMaxYamlBytes = std::size_t{1} << 20;

class YamlFile {
 public:
  // Throws InputError if the file cannot be read, is longer than kMaxYamlBytes, is no YAML, or its top is no
  // map. Every error is one line.
  explicit YamlFile(const std::filesystem::path& file);
  // Reads a file's content; `file` names it in errors.
  YamlFile(std::filesystem::path file, const std::string& content);

  [[nodiscard]] const YAML::Node& root() const { return root_; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

  // All of these throw InputError; `key` is a key of the top map.
  [[nodiscard]] bool has(const std::string& key) const { return root_[key].IsDefined(); }
  [[nodiscard]] YAML::Node require(const std::string& key) const;
  [[nodiscard]] std::string text(const std::string& key) const;
  [[nodiscard]] double number(const std::string& key) const;
  [[nodiscard]] double number_or(const std::string& key, double fallback) const;
  [[nodiscard]] int integer(const std::string& key) const;
  // A list of finite numbers, of one of the given lengths.
  [[nodiscard]] std::vector<double> numbers(const std::string& key,
                                            const std::vector<std::size_t>& lengths) const;
  // A node as one finite number, and as a list of them of any length; `name` is for the error.
  [[nodiscard]] double number_in(const YAML::Node& node, const std::string& name) const;
  [[nodiscard]] std::vector<double> numbers_in(const YAML::Node& node, const std::string& name) const;
  // Reads 16 numbers by rows into a rigid motion; `name` is for the error.
  [[nodiscard]] slam::SE3 rigid_motion(const YAML::Node& list, const std::string& name) const;
  // Fails for a key that is none of these.
  void allow_only(const std::vector<std::string>& keys) const;

  [[noreturn]] void fail(const YAML::Node& node, const std::string& message) const;

 private:
  std::filesystem::path path_;
  YAML::Node root_;
};

// The content of a file, at most one byte more than kMaxYamlBytes of it. Throws InputError if it cannot be
// read.
[[nodiscard]] std::string read_short_file(const std::filesystem::path& file);

// Returns the nearest rigid motion of a 3x3 or 3x4 matrix by rows; false if it differs by more than
// `tolerance`.
[[nodiscard]] bool to_rigid_motion(const Eigen::Matrix<double, 3, 4>& matrix, slam::SE3* motion);

}  // namespace farpoint::daemon
