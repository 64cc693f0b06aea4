// SPDX-License-Identifier: Apache-2.0
#include "daemon/config/yaml_file.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>

#include "daemon/config/errors.h"
#include "ipc/printable.h"

namespace farpoint::daemon {
namespace {

[[noreturn]] void refuse_length(const std::filesystem::path& file) {
  throw InputError(ipc::printable(file.string()) + ": longer than 1 MiB, expected a short YAML file");
}

}  // namespace

std::string read_short_file(const std::filesystem::path& file) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored))
    throw InputError(file.string() + ": expected a file, found a folder");
  errno = 0;
  std::ifstream stream(file, std::ios::binary);
  if (!stream)
    throw InputError(file.string() + ": cannot be opened (" + std::strerror(errno ? errno : ENOENT) + ")");
  std::string content(kMaxYamlBytes + 1, '\0');
  stream.read(content.data(), static_cast<std::streamsize>(content.size()));
  if (stream.bad()) throw InputError(file.string() + ": cannot be read to its end");
  content.resize(static_cast<std::size_t>(stream.gcount()));
  return content;
}

YamlFile::YamlFile(const std::filesystem::path& file) : YamlFile(file, read_short_file(file)) {}

YamlFile::YamlFile(std::filesystem::path file, const std::string& content) : path_(std::move(file)) {
  if (content.size() > kMaxYamlBytes) refuse_length(path_);
  try {
    root_ = YAML::Load(content);
  } catch (const YAML::Exception& e) {
    throw InputError(ipc::printable(path_.string() + ":" + std::to_string(e.mark.line + 1) +
                                    ": not valid YAML: " + e.msg));
  }
  if (!root_.IsMap()) throw InputError(path_.string() + ":1: expected 'key: value' lines");
}

void YamlFile::fail(const YAML::Node& node, const std::string& message) const {
  throw InputError(
      ipc::printable(path_.string() + ":" + std::to_string(node.Mark().line + 1) + ": " + message));
}

YAML::Node YamlFile::require(const std::string& key) const {
  const YAML::Node node = root_[key];
  if (!node.IsDefined() || node.IsNull()) throw InputError(path_.string() + ": key '" + key + "' is missing");
  return node;
}

std::string YamlFile::text(const std::string& key) const {
  const YAML::Node node = require(key);
  if (!node.IsScalar()) fail(node, "expected a word for '" + key + "'");
  return node.Scalar();
}

double YamlFile::number_in(const YAML::Node& node, const std::string& name) const {
  double value = 0.0;
  const bool is_number = node.IsScalar() && YAML::convert<double>::decode(node, value);
  if (!is_number || !std::isfinite(value)) {
    fail(node, "expected a finite number for '" + name + "'" +
                   (node.IsScalar() ? ", found '" + node.Scalar() + "'" : std::string()));
  }
  return value;
}

double YamlFile::number(const std::string& key) const {
  return number_in(require(key), key);
}

double YamlFile::number_or(const std::string& key, double fallback) const {
  return has(key) ? number(key) : fallback;
}

int YamlFile::integer(const std::string& key) const {
  const YAML::Node node = require(key);
  int value = 0;
  if (!node.IsScalar() || !YAML::convert<int>::decode(node, value)) {
    fail(node, "expected an integer for '" + key + "'");
  }
  return value;
}

std::vector<double> YamlFile::numbers(const std::string& key, const std::vector<std::size_t>& lengths) const {
  const YAML::Node node = require(key);
  std::vector<double> values;
  if (node.IsSequence()) {
    for (const YAML::Node& item : node) values.push_back(number_in(item, key));
  }
  if (!node.IsSequence() || std::find(lengths.begin(), lengths.end(), values.size()) == lengths.end()) {
    std::string wanted;
    for (const std::size_t length : lengths)
      wanted += (wanted.empty() ? "" : " or ") + std::to_string(length);
    fail(node, "expected a list of " + wanted + " numbers for '" + key + "', found " +
                   std::to_string(values.size()));
  }
  return values;
}

std::vector<double> YamlFile::numbers_in(const YAML::Node& node, const std::string& name) const {
  if (!node.IsSequence()) fail(node, "expected a list of numbers for '" + name + "'");
  std::vector<double> values;
  for (const YAML::Node& item : node) values.push_back(number_in(item, name));
  return values;
}

slam::SE3 YamlFile::rigid_motion(const YAML::Node& list, const std::string& name) const {
  if (!list.IsDefined() || !list.IsSequence() || list.size() != 16) {
    fail(list.IsDefined() ? list : root_, "expected 16 numbers (a 4x4 matrix by rows) for '" + name + "'");
  }
  Eigen::Matrix4d matrix;
  for (int i = 0; i < 16; ++i) matrix(i / 4, i % 4) = number_in(list[static_cast<std::size_t>(i)], name);
  slam::SE3 motion;
  if (matrix.row(3) != Eigen::RowVector4d(0, 0, 0, 1) || !to_rigid_motion(matrix.topRows<3>(), &motion)) {
    fail(list, "expected a rigid motion for '" + name +
                   "': a rotation (orthonormal, determinant +1), last row 0 0 0 1");
  }
  return motion;
}

void YamlFile::allow_only(const std::vector<std::string>& keys) const {
  for (const auto& entry : root_) {
    const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : "?";
    if (std::find(keys.begin(), keys.end(), key) != keys.end()) continue;
    std::string known;
    for (const std::string& k : keys) known += (known.empty() ? "" : ", ") + k;
    fail(entry.first, "unknown key '" + key + "', expected one of: " + known);
  }
}

bool to_rigid_motion(const Eigen::Matrix<double, 3, 4>& matrix, slam::SE3* motion) {
  constexpr double kTolerance = 1e-3;  // matrices written with 4 or more digits
  const Eigen::Matrix3d rotation = matrix.leftCols<3>();
  if (!matrix.allFinite() || !(rotation.transpose() * rotation).isIdentity(kTolerance)) return false;
  if (rotation.determinant() < 0.0) return false;
  motion->q = Eigen::Quaterniond(rotation).normalized();
  motion->t = matrix.col(3);
  return true;
}

}  // namespace farpoint::daemon
