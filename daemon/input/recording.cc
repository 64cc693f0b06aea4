// SPDX-License-Identifier: Apache-2.0
#include "daemon/input/recording.h"

#include <fcntl.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include "daemon/system/stage_clock.h"
#include "ipc/channels.h"
#include "ipc/log.h"

namespace farpoint::daemon {
namespace {

constexpr std::uint64_t kMegabyte = 1'000'000, kGigabyte = 1'000'000'000;
constexpr double kMinute_us = 60e6;
constexpr double kTryAgainAfter_s = 0.5;
constexpr int kEventsASlice = 2000;

// A path that a recording may split and finish: absent or a regular file.
bool is_file(const std::string& target) {
  if (target == "-") return false;
  struct stat info {};
  return stat(target.c_str(), &info) != 0 || S_ISREG(info.st_mode);
}

bool has_limit(const RecordConfig& limits) {
  return limits.max_size_mb > 0 || limits.max_minutes > 0.0 || limits.min_free_share > 0.0;
}

// Zero-padded numbers of one length are in the order of their texts.
bool is_before(const std::string& a, const std::string& b) {
  return a.size() != b.size() ? a.size() < b.size() : a < b;
}

void sync_file(const std::string& path) {
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return;
  (void)fsync(fd);
  close(fd);
}

}  // namespace

Recording::Recording(const std::string& target, const RecordConfig& limits, const calibration_t& calibration)
    : target_(target),
      limits_(limits),
      is_ring_(has_limit(limits) && is_file(target)),
      folder_(target),
      free_share_([this] { return folder_.free_share(); }),
      calibration_utime_(calibration.utime) {
  ipc::encode(calibration, &calibration_);
  if (is_file(target)) {
    folder_.set_aside(target + ".part" + std::to_string(getpid()));
    for (std::string& path : folder_.orphans()) orphans_.push_back(std::move(path));
    next_number_ = folder_.next_number();
  }
  if (is_ring_)
    for (const RecordingFolder::NumberedFile& file : folder_.numbered_files())
      finished_.push_back({file.path, file.bytes, 0, false, false});
  begin_file();
}

Recording::~Recording() {
  (void)close();
}

// --- writing

void Recording::begin_file() {
  const std::string path = is_ring_ ? folder_.numbered_path(next_number_) : target_;
  const auto throw_failure = [&path](const char* why) {
    throw std::runtime_error("cannot write log " + path + ": " + why);
  };
  std::unique_ptr<Present> file;
  try {
    file = std::make_unique<Present>(path);
  } catch (const std::runtime_error& error) {
    throw_failure(error.what());
  }
  const int error = file->events.append(ipc::kCalibrationChannel, calibration_utime_, calibration_);
  if (error != 0) throw_failure(std::strerror(error));
  present_ = std::move(file);
  ++next_number_;
}

bool Recording::write(std::string_view channel, std::int64_t utime, std::span<const std::uint8_t> data) {
  if (closed_ || steady_s() < next_try_s_) return false;
  const std::uint64_t bytes = ipc::EventFile::event_bytes(channel, data);
  if (present_ && is_full(bytes, utime)) finish_file();
  if (is_ring_ && !make_room(bytes, utime))
    return fail("less of the disk is free than record.min_free_share");
  try {
    if (!present_) begin_file();
  } catch (const std::runtime_error& error) {
    return fail(error.what());
  }
  int error = present_->events.append(channel, utime, data);
  if ((error == ENOSPC || error == EDQUOT) && remove_oldest())
    error = present_->events.append(channel, utime, data);
  if (error != 0) return fail(std::strerror(error));
  if (!present_->first_utime) present_->first_utime = utime;
  present_->last_utime = utime;
  return true;
}

bool Recording::fail(const std::string& what) {
  problem_ = what;
  next_try_s_ = steady_s() + kTryAgainAfter_s;
  return false;
}

bool Recording::is_full(std::uint64_t more_bytes, std::int64_t utime) const {
  if (!is_ring_ || !present_->first_utime) return false;
  const std::uint64_t bytes = present_->events.bytes() + more_bytes;
  if (limits_.max_size_mb > 0 &&
      bytes * kFilesOfALimit > static_cast<std::uint64_t>(limits_.max_size_mb) * kMegabyte)
    return true;
  if (limits_.min_free_share > 0.0 && bytes > kGigabyte) return true;
  const auto duration_us = static_cast<double>(utime - *present_->first_utime);
  return limits_.max_minutes > 0.0 && duration_us * kFilesOfALimit > limits_.max_minutes * kMinute_us;
}

// --- the ring

bool Recording::make_room(std::uint64_t more_bytes, std::int64_t utime) {
  const auto is_beyond_limit = [&] {
    std::uint64_t bytes = more_bytes + (present_ ? present_->events.bytes() : 0);
    double duration_us = present_ ? static_cast<double>(present_->duration_us(utime)) : 0.0;
    for (const Finished& file : finished_) {
      bytes += file.bytes;
      duration_us += static_cast<double>(file.duration_us);
    }
    const bool too_large =
        limits_.max_size_mb > 0 && bytes > static_cast<std::uint64_t>(limits_.max_size_mb) * kMegabyte;
    return too_large || (limits_.max_minutes > 0.0 && duration_us > limits_.max_minutes * kMinute_us);
  };
  while (is_beyond_limit())
    if (!remove_oldest()) break;
  // One file an event: some file systems report freed space later.
  return limits_.min_free_share <= 0.0 || free_share_() >= limits_.min_free_share || remove_oldest();
}

bool Recording::remove_oldest() {
  if (!is_ring_ || finished_.empty()) return false;
  const std::string& path = finished_.front().path;
  if (unlink(path.c_str()) != 0 && errno != ENOENT)
    spdlog::warn("{}: cannot be removed: {}", path, std::strerror(errno));
  finished_.pop_front();
  return true;
}

// --- finishing

void Recording::finish_file() {
  const std::unique_ptr<Present> file = std::move(present_);
  if (is_ring_ && !file->first_utime) return;  // holds no image: not kept
  if (const int error = file->events.sync(); error != 0) (void)fail(std::strerror(error));
  const std::uint64_t bytes = file->events.bytes();
  file->events.close();
  try {
    file->path.commit();
    finished_.push_back({file->path.target(), bytes, file->duration_us(file->last_utime), true, true});
  } catch (const std::runtime_error& error) {
    file->path.leave();
    (void)fail(error.what());
  }
}

std::string Recording::close() {
  if (!closed_ && present_) finish_file();
  closed_ = true;
  return problem_;
}

std::vector<std::string> Recording::files() const {
  std::vector<std::string> paths;
  for (const Finished& file : finished_)
    if (file.of_this_run) paths.push_back(file.path);
  return paths;
}

// --- what earlier runs left

bool Recording::tidy() {
  if (!orphans_.empty()) return finish_one_part();
  return limits_.max_minutes > 0.0 && measure_one();
}

bool Recording::finish_one_part() {
  const std::string part = orphans_.front();
  if (!walk_) walk_ = std::make_unique<ipc::EventWalk>(part);
  if (walk_->step(kEventsASlice)) return true;
  const std::unique_ptr<ipc::EventWalk> walk = std::move(walk_);
  orphans_.pop_front();
  if (walk->events() <= 1) {  // at most the calibration
    (void)unlink(part.c_str());
    spdlog::info("{}: holds no image, removed", part);
    return true;
  }
  // A longer rest is damage within the file, which readers pass over.
  const std::uint64_t rest = walk->file_bytes() - walk->end();
  if (rest > 0 && rest < ipc::LogReader::kMaxDataBytes)
    if (truncate(part.c_str(), static_cast<off_t>(walk->end())) != 0)
      spdlog::warn("{}: cannot be cut after its last whole event: {}", part, std::strerror(errno));
  sync_file(part);
  const std::string path = folder_.finish(part, is_ring_ ? std::string() : target_);
  if (path.empty()) {
    spdlog::warn("{}: cannot be renamed: {}", part, std::strerror(errno));
    return true;
  }
  ipc::sync_folder_of(path);
  spdlog::warn("{}: recording of a run that was killed, kept as {} ({} events, {} bytes cut off)", part, path,
               walk->events(), rest);
  for (const RecordingFolder::NumberedFile& file : folder_.numbered_files()) {
    if (!is_ring_ || file.path != path) continue;
    const auto at = std::find_if(finished_.begin(), finished_.end(),
                                 [&path](const Finished& f) { return is_before(path, f.path); });
    finished_.insert(at, {path, file.bytes, walk->duration_us(), false, true});
  }
  return true;
}

bool Recording::measure_one() {
  const auto file =
      std::find_if(finished_.begin(), finished_.end(), [](const Finished& f) { return !f.measured; });
  if (file == finished_.end()) return false;
  if (!walk_) walk_ = std::make_unique<ipc::EventWalk>(file->path);
  if (walk_->step(kEventsASlice)) return true;
  file->duration_us = walk_->duration_us();
  file->measured = true;
  walk_.reset();
  return true;
}

}  // namespace farpoint::daemon
