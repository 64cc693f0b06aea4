// SPDX-License-Identifier: Apache-2.0
#include "tools/simulate/world/yaml_section.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "tools/common/errors.h"

namespace farpoint::tools::simulate {
namespace {

std::string shown(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

std::string found(const YAML::Node& node) {
  if (node.IsScalar()) return ", found '" + node.Scalar() + "'";
  return node.IsNull() ? ", found nothing" : node.IsMap() ? ", found a map" : ", found a list";
}

}  // namespace

YamlSection::YamlSection(YAML::Node node, const std::filesystem::path& file, std::string name)
    : node_(std::move(node)), file_(file), name_(std::move(name)) {
  if (!node_.IsMap()) {
    throw InputError(file_.string() + ":" + std::to_string(node_.Mark().line + 1) + ": " +
                     (name_.empty() ? "" : name_ + ": ") + "expected 'key: value' lines" + found(node_));
  }
}

bool YamlSection::has(const std::string& key) const {
  for (const auto& entry : node_) {
    if (entry.first.IsScalar() && entry.first.Scalar() == key) return true;
  }
  return false;
}

YAML::Node YamlSection::find(const std::string& key) {
  known_.push_back(key);
  for (const auto& entry : node_) {
    if (entry.first.IsScalar() && entry.first.Scalar() == key) return entry.second;
  }
  return YAML::Node(YAML::NodeType::Undefined);
}

void YamlSection::fail_at(const YAML::Node& node, const std::string& key, const std::string& message) const {
  throw InputError(file_.string() + ":" + std::to_string(node.Mark().line + 1) + ": " +
                   (name_.empty() ? "" : name_ + ".") + key + ": " + message);
}

void YamlSection::fail(const std::string& key, const std::string& message) const {
  for (const auto& entry : node_) {
    if (entry.first.IsScalar() && entry.first.Scalar() == key) fail_at(entry.first, key, message);
  }
  fail_at(node_, key, message);
}

void YamlSection::require(const std::string& key) const {
  if (!has(key)) fail(key, "is missing, expected in this map");
}

double YamlSection::to_number(const YAML::Node& node, const std::string& key) const {
  double value = 0.0;
  if (!node.IsScalar() || !YAML::convert<double>::decode(node, value) || !std::isfinite(value)) {
    fail_at(node, key, "expected a finite number" + found(node));
  }
  return value;
}

void YamlSection::number(const std::string& key, double low, double high, const std::string& unit,
                         double* value) {
  const YAML::Node node = find(key);
  if (!node.IsDefined()) return;
  const double given = to_number(node, key);
  if (given < low || given > high) {
    fail_at(node, key,
            "expected " + shown(low) + " to " + shown(high) + (unit.empty() ? "" : " " + unit) + found(node));
  }
  *value = given;
}

void YamlSection::integer(const std::string& key, int low, int high, int* value) {
  const YAML::Node node = find(key);
  if (!node.IsDefined()) return;
  int given = 0;
  if (!node.IsScalar() || !YAML::convert<int>::decode(node, given) || given < low || given > high) {
    fail_at(
        node, key,
        "expected a whole number from " + std::to_string(low) + " to " + std::to_string(high) + found(node));
  }
  *value = given;
}

void YamlSection::flag(const std::string& key, bool* value) {
  const YAML::Node node = find(key);
  if (!node.IsDefined()) return;
  if (!node.IsScalar() || !YAML::convert<bool>::decode(node, *value))
    fail_at(node, key, "expected true or false" + found(node));
}

void YamlSection::degrees(const std::string& key, double low_deg, double high_deg, double* value_rad) {
  double degrees = *value_rad * 180.0 / std::numbers::pi;
  number(key, low_deg, high_deg, "degrees", &degrees);
  if (has(key)) *value_rad = degrees * std::numbers::pi / 180.0;
}

void YamlSection::word(const std::string& key, const std::vector<std::string>& words, int* index) {
  const YAML::Node node = find(key);
  if (!node.IsDefined()) return;
  const auto at = node.IsScalar() ? std::find(words.begin(), words.end(), node.Scalar()) : words.end();
  if (at == words.end()) {
    std::string known;
    for (const std::string& word : words) known += (known.empty() ? "" : ", ") + word;
    fail_at(node, key, "expected one of: " + known + found(node));
  }
  *index = static_cast<int>(at - words.begin());
}

void YamlSection::text(const std::string& key, std::string* value) {
  const YAML::Node node = find(key);
  if (!node.IsDefined()) return;
  if (!node.IsScalar()) fail_at(node, key, "expected a text" + found(node));
  *value = node.Scalar();
}

std::vector<double> YamlSection::numbers(const std::string& key) {
  const YAML::Node node = find(key);
  std::vector<double> values;
  if (!node.IsDefined()) return values;
  if (!node.IsSequence()) fail_at(node, key, "expected a list of numbers" + found(node));
  for (const YAML::Node& item : node) values.push_back(to_number(item, key));
  return values;
}

std::vector<std::vector<double>> YamlSection::rows(const std::string& key, std::size_t columns) {
  const YAML::Node node = find(key);
  std::vector<std::vector<double>> result;
  if (!node.IsDefined()) return result;
  const std::string wanted = "lists of " + std::to_string(columns) + " numbers";
  if (!node.IsSequence()) fail_at(node, key, "expected a list of " + wanted + found(node));
  for (const YAML::Node& row : node) {
    if (!row.IsSequence() || row.size() != columns) fail_at(row, key, "expected " + wanted + found(row));
    std::vector<double> values;
    for (const YAML::Node& item : row) values.push_back(to_number(item, key));
    result.push_back(std::move(values));
  }
  return result;
}

std::optional<YamlSection> YamlSection::section(const std::string& key) {
  const YAML::Node node = find(key);
  if (!node.IsDefined()) return std::nullopt;
  return YamlSection(node, file_, (name_.empty() ? "" : name_ + ".") + key);
}

void YamlSection::finish() const {
  std::set<std::string> seen;
  for (const auto& entry : node_) {
    const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "?";
    if (!seen.insert(key).second) fail_at(entry.first, key, "is given twice, expected once");
    if (std::find(known_.begin(), known_.end(), key) != known_.end()) continue;
    std::string known;
    for (const std::string& k : known_) known += (known.empty() ? "" : ", ") + k;
    fail_at(entry.first, key, "unknown key, expected one of: " + known);
  }
}

}  // namespace farpoint::tools::simulate
