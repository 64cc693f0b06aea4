// SPDX-License-Identifier: Apache-2.0
#include "ipc/output_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <utility>

namespace farpoint::ipc {
namespace {

[[noreturn]] void fail(const std::string& what, const std::string& path, const std::string& why) {
  throw std::runtime_error(what + " " + path + ": " + why);
}

// A path that a rename may replace: absent or a regular file.
bool is_replaceable(const std::string& path) {
  struct stat info {};
  if (stat(path.c_str(), &info) != 0) return true;
  if (S_ISDIR(info.st_mode)) fail("cannot write", path, "is a folder, a file name was expected");
  return S_ISREG(info.st_mode);
}

}  // namespace

ReplacedPath::ReplacedPath(std::string target) : target_(std::move(target)) {
  if (target_ == "-") {
    writable_ = "/dev/stdout";
    return;
  }
  if (target_.empty()) fail("cannot write", "''", "a file name was expected");
  if (!is_replaceable(target_)) {
    writable_ = target_;
    return;
  }
  // A link is kept: the file behind it is replaced.
  std::error_code error;
  const std::filesystem::path resolved = std::filesystem::weakly_canonical(target_, error);
  if (!error) target_ = resolved.string();
  const std::filesystem::path folder = std::filesystem::path(target_).parent_path();
  if (!folder.empty() && !std::filesystem::is_directory(folder, error)) {
    fail("cannot write", target_, "the folder does not exist");
  }
  writable_ = target_ + ".part" + std::to_string(getpid());
}

ReplacedPath::~ReplacedPath() {
  if (!committed_ && has_temporary()) unlink(writable_.c_str());
}

std::string ReplacedPath::keep_as(const std::string& suffix) {
  if (committed_ || !has_temporary()) return {};
  std::string kept = target_ + suffix;
  if (std::rename(writable_.c_str(), kept.c_str()) != 0) return {};
  committed_ = true;
  return kept;
}

void ReplacedPath::commit() {
  if (committed_) return;
  if (writable_ != target_ && target_ != "-" && std::rename(writable_.c_str(), target_.c_str()) != 0) {
    fail("cannot rename to", target_, std::strerror(errno));
  }
  if (has_temporary()) sync_folder_of(target_);
  committed_ = true;
}

OutputFile::OutputFile(std::string target) : path_(std::move(target)) {
  stream_ = std::fopen(path_.writable().c_str(), "wb");
  if (stream_ == nullptr) fail("cannot write", path_.target(), std::strerror(errno));
}

OutputFile::~OutputFile() {
  if (stream_ != nullptr) std::fclose(stream_);
}

void OutputFile::close() {
  if (stream_ == nullptr) return;
  std::string error = flush_to_disk(stream_);
  if (std::fclose(std::exchange(stream_, nullptr)) != 0 && error.empty()) error = std::strerror(errno);
  if (!error.empty()) fail("cannot write", path_.target(), error);
  path_.commit();
}

void sync_folder_of(const std::string& path) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  const int fd = open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return;
  (void)fsync(fd);
  close(fd);
}

std::string flush_to_disk(std::FILE* stream) {
  if (std::fflush(stream) != 0) return std::strerror(errno);
  if (std::ferror(stream) != 0) return "an earlier write failed (disk full?)";
  // EINVAL and EROFS: a pipe or device, which cannot be synchronised.
  if (fsync(fileno(stream)) != 0 && errno != EINVAL && errno != EROFS) return std::strerror(errno);
  return {};
}

}  // namespace farpoint::ipc
