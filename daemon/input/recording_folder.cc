// SPDX-License-Identifier: Apache-2.0
#include "daemon/input/recording_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <filesystem>
#include <string_view>

namespace farpoint::daemon {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPart = ".part";
constexpr std::size_t kDigits = 6;

bool is_digits(std::string_view text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
}

// Name of the file that NAME.partPID becomes; empty for another name.
std::string name_of_part(const std::string& name) {
  const std::size_t at = name.rfind(kPart);
  const std::string_view whole = name;
  if (at == std::string::npos || !is_digits(whole.substr(at + kPart.size()))) return {};
  return name.substr(0, at);
}

// A process that writes a part holds its lock.
bool is_in_use(const std::string& path) {
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd < 0) return true;
  const bool locked = flock(fd, LOCK_EX | LOCK_NB) != 0;
  close(fd);
  return locked;
}

// False where the target exists or the rename fails.
bool rename_to_free(const std::string& from, const std::string& to) {
  if (renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return true;
  if (errno != EINVAL && errno != ENOSYS) return false;
  // A file system without that flag: a link does not replace either.
  return link(from.c_str(), to.c_str()) == 0 && unlink(from.c_str()) == 0;
}

}  // namespace

RecordingFolder::RecordingFolder(const std::string& target) {
  const fs::path path(target);
  folder_ = path.parent_path().empty() ? "." : path.parent_path().string();
  stem_ = path.stem().string();
  extension_ = path.extension().string();
}

std::string RecordingFolder::path_of(const std::string& name) const {
  return (fs::path(folder_) / name).string();
}

std::string RecordingFolder::numbered_path(std::int64_t number) const {
  std::string digits = std::to_string(number);
  if (digits.size() < kDigits) digits.insert(0, kDigits - digits.size(), '0');
  return path_of(stem_ + "-" + digits + extension_);
}

std::optional<std::int64_t> RecordingFolder::number_of(const std::string& name) const {
  const std::string head = stem_ + "-";
  if (!name.starts_with(head) || !name.ends_with(extension_)) return std::nullopt;
  if (name.size() < head.size() + kDigits + extension_.size()) return std::nullopt;
  const std::string_view whole_name = name;
  const std::string_view digits =
      whole_name.substr(head.size(), name.size() - head.size() - extension_.size());
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  const bool whole = is_digits(digits) && error == std::errc{} && end == digits.data() + digits.size();
  return whole ? std::optional(number) : std::nullopt;
}

bool RecordingFolder::is_ours(const std::string& name) const {
  return name == stem_ + extension_ || number_of(name).has_value();
}

std::vector<std::string> RecordingFolder::names() const {
  std::vector<std::string> found;
  std::error_code error;
  fs::directory_iterator entries(folder_, error);
  for (; !error && entries != fs::directory_iterator(); entries.increment(error)) {
    std::error_code ignored;
    if (entries->is_regular_file(ignored) && !entries->is_symlink(ignored))
      found.push_back(entries->path().filename().string());
  }
  std::sort(found.begin(), found.end());
  return found;
}

std::vector<RecordingFolder::NumberedFile> RecordingFolder::numbered_files() const {
  std::vector<NumberedFile> files;
  for (const std::string& name : names()) {
    const auto number = number_of(name);
    if (!number) continue;
    std::error_code error;
    const std::uintmax_t bytes = fs::file_size(path_of(name), error);
    files.push_back({*number, path_of(name), error ? 0 : bytes});
  }
  std::sort(files.begin(), files.end(), [](const auto& a, const auto& b) { return a.number < b.number; });
  return files;
}

std::int64_t RecordingFolder::next_number() const {
  std::int64_t next = 1;
  for (const std::string& name : names()) {
    const std::string part_of = name_of_part(name);
    if (const auto number = number_of(part_of.empty() ? name : part_of)) next = std::max(next, *number + 1);
  }
  return next;
}

std::vector<std::string> RecordingFolder::orphans() const {
  std::vector<std::string> found;
  for (const std::string& name : names()) {
    const std::string part_of = name_of_part(name);
    if (!part_of.empty() && is_ours(part_of) && !is_in_use(path_of(name))) found.push_back(path_of(name));
  }
  return found;
}

void RecordingFolder::set_aside(const std::string& part) const {
  constexpr int kMostNames = 100'000;
  const std::string name = part.substr(0, part.rfind(kPart) + kPart.size());
  for (int i = 1; i <= kMostNames && access(part.c_str(), F_OK) == 0; ++i)
    if (rename_to_free(part, name + std::to_string(i))) return;
}

std::string RecordingFolder::finish(const std::string& part, const std::string& reserved) const {
  constexpr int kMostNames = 100'000;
  std::string path = path_of(name_of_part(fs::path(part).filename().string()));
  const auto is_reserved = [&reserved](const std::string& name) {
    std::error_code error;
    return fs::weakly_canonical(name, error) == fs::weakly_canonical(reserved, error);
  };
  if (!is_reserved(path) && rename_to_free(part, path)) return path;
  for (int i = 1; i <= kMostNames; ++i) {
    path = path_of(stem_ + "-recovered-" + std::to_string(i) + extension_);
    std::error_code error;
    if (fs::exists(path, error)) continue;
    if (rename_to_free(part, path)) return path;
    if (errno != EEXIST) return {};
  }
  return {};
}

double RecordingFolder::free_share() const {
  struct statvfs info {};
  if (statvfs(folder_.c_str(), &info) != 0 || info.f_blocks == 0) return 1.0;
  return static_cast<double>(info.f_bavail) / static_cast<double>(info.f_blocks);
}

}  // namespace farpoint::daemon
