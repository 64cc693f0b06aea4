// SPDX-License-Identifier: Apache-2.0
// One map of a YAML file, read key by key with bounds. A key that no call has read is refused.
#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace farpoint::tools::simulate {

class YamlSection {
 public:
  // `name` is the dotted way to the map, empty at the top.
  YamlSection(YAML::Node node, const std::filesystem::path& file, std::string name);

  // Each leaves *value unchanged for an absent key; bounds are inclusive. All throw InputError.
  void number(const std::string& key, double low, double high, const std::string& unit, double* value);
  void integer(const std::string& key, int low, int high, int* value);
  void flag(const std::string& key, bool* value);
  void degrees(const std::string& key, double low_deg, double high_deg, double* value_rad);
  // Reads one of the words and gives its index.
  void word(const std::string& key, const std::vector<std::string>& words, int* index);
  void text(const std::string& key, std::string* value);
  // A list of numbers, or of lists of `columns` numbers. Empty where the key is absent.
  [[nodiscard]] std::vector<double> numbers(const std::string& key);
  [[nodiscard]] std::vector<std::vector<double>> rows(const std::string& key, std::size_t columns);
  // The map under a key.
  [[nodiscard]] std::optional<YamlSection> section(const std::string& key);

  [[nodiscard]] bool has(const std::string& key) const;
  void require(const std::string& key) const;
  // Fails for a key that no call above has read.
  void finish() const;
  // Throws InputError at the line of a key (or of the map itself where it is absent).
  [[noreturn]] void fail(const std::string& key, const std::string& message) const;

 private:
  [[nodiscard]] YAML::Node find(const std::string& key);
  [[nodiscard]] double to_number(const YAML::Node& node, const std::string& key) const;
  [[noreturn]] void fail_at(const YAML::Node& node, const std::string& key, const std::string& message) const;

  YAML::Node node_;
  std::filesystem::path file_;
  std::string name_;
  std::vector<std::string> known_;
};

}  // namespace farpoint::tools::simulate
