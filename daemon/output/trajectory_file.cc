// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/trajectory_file.h"

#include "daemon/output/sound_frames.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

namespace farpoint::daemon {
namespace {

constexpr const char* kHeader = "# seconds tx ty tz qx qy qz qw (T_map_body)\n";

void put(std::FILE* stream, const std::string& text) {
  std::fwrite(text.data(), 1, text.size(), stream);
}

void write_frames(const std::string& path, std::span<const slam::PosedFrame> frames, const char* nothing,
                  double unit_scale) {
  ipc::OutputFile file(path);
  put(file.stream(), kHeader);
  if (frames.empty()) put(file.stream(), nothing);
  for (const slam::PosedFrame& frame : frames) {
    const slam::SE3 T{frame.T_map_body.q, frame.T_map_body.t * unit_scale};
    put(file.stream(), tum_line(frame.utime, T));
  }
  file.close();
}

// Removes the file of unsound frames that an earlier run left.
void write_one(const std::string& path, const slam::MapTrajectory& trajectory,
               std::span<const std::int64_t> live_utimes, double unit_scale,
               std::vector<std::string>* written) {
  const std::vector<std::uint8_t> is_sound = sound_frames(trajectory, live_utimes);
  std::vector<slam::PosedFrame> sound, unsound;
  for (std::size_t i = 0; i < is_sound.size(); ++i)
    (is_sound[i] != 0 ? sound : unsound).push_back(trajectory.frames[i]);
  write_frames(path, sound,
               unsound.empty() ? "# no frame has a pose: no map was made\n"
                               : "# no frame has a sound pose: no pose was valid\n",
               unit_scale);
  written->push_back(path);
  std::error_code ignored;
  // A device or pipe has no neighbour.
  if (path == "-" || !std::filesystem::is_regular_file(path, ignored)) return;
  const std::string beside = unsound_path(path);
  if (unsound.empty()) {
    std::filesystem::remove(beside, ignored);
    return;
  }
  write_frames(beside, unsound, "", unit_scale);
  written->push_back(beside);
}

}  // namespace

std::string tum_line(std::int64_t utime, const slam::SE3& T) {
  char line[kMaxTumLine];
  return {line, put_tum_line(utime, T, line)};
}

std::size_t put_tum_line(std::int64_t utime, const slam::SE3& T, std::span<char, kMaxTumLine> line) {
  const std::lldiv_t seconds = std::lldiv(utime, 1'000'000);
  const char* sign = utime < 0 ? "-" : "";
  const auto end = fmt::format_to_n(line.data(), line.size(),
                                    "{}{}.{:06d} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n", sign,
                                    std::llabs(seconds.quot), std::llabs(seconds.rem), T.t.x(), T.t.y(),
                                    T.t.z(), T.q.x(), T.q.y(), T.q.z(), T.q.w());
  return std::min(end.size, line.size());
}

LiveTrajectory::LiveTrajectory(FileWriter* files)
    : files_(files),
      file_number_(files->add_file([this](std::span<const std::uint8_t> line) { write(line); })) {}

void LiveTrajectory::open(const std::string& path) {
  auto file = std::make_unique<ipc::OutputFile>(path);
  put(file->stream(), kHeader);
  file_.set(std::move(file));
}

void LiveTrajectory::on_frame(const FrameOutput& frame) {
  if (!frame.valid) return;
  char text[kMaxTumLine];
  const std::size_t length = put_tum_line(frame.result.utime, frame.result.T_map_body, text);
  const std::span line(reinterpret_cast<const std::uint8_t*>(text), length);
  if (files_ != nullptr)
    (void)files_->push(file_number_, {line});
  else
    write(line);
}

void LiveTrajectory::write(std::span<const std::uint8_t> line) {
  if (ipc::OutputFile* file = file_.get()) std::fwrite(line.data(), 1, line.size(), file->stream());
}

void LiveTrajectory::close() {
  if (ipc::OutputFile* file = file_.get()) file->close();
}

std::string trajectory_path(const std::string& path, int map_number) {
  const std::filesystem::path p(path);
  return (p.parent_path() / fmt::format("{}.map{}{}", p.stem().string(), map_number, p.extension().string()))
      .string();
}

std::string unsound_path(const std::string& path) {
  const std::filesystem::path p(path);
  return (p.parent_path() / fmt::format("{}.unsound{}", p.stem().string(), p.extension().string())).string();
}

std::vector<std::string> write_final_trajectories(const std::string& path,
                                                  const std::vector<slam::MapTrajectory>& trajectories,
                                                  std::span<const std::int64_t> live_utimes,
                                                  double unit_scale) {
  std::vector<std::string> written;
  write_one(path, trajectories.empty() ? slam::MapTrajectory{} : trajectories.front(), live_utimes,
            unit_scale, &written);
  std::error_code ignored;
  // A device or pipe has no neighbours that could take the other maps.
  if (path == "-" || !std::filesystem::is_regular_file(path, ignored)) return written;
  int number = 2;
  for (std::size_t i = 1; i < trajectories.size(); ++i, ++number) {
    write_one(trajectory_path(path, number), trajectories[i], live_utimes, unit_scale, &written);
  }
  for (;; ++number) {
    const std::string stale = trajectory_path(path, number);
    std::filesystem::remove(unsound_path(stale), ignored);
    if (!std::filesystem::remove(stale, ignored)) break;
  }
  return written;
}

}  // namespace farpoint::daemon
