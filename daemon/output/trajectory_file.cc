// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/trajectory_file.h"

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

void write_one(const std::string& path, const slam::MapTrajectory& trajectory, double unit_scale) {
  ipc::OutputFile file(path);
  put(file.stream(), kHeader);
  if (trajectory.frames.empty()) put(file.stream(), "# no frame has a pose: no map was made\n");
  for (const slam::PosedFrame& frame : trajectory.frames) {
    const slam::SE3 T{frame.T_map_body.q, frame.T_map_body.t * unit_scale};
    put(file.stream(), tum_line(frame.utime, T));
  }
  file.close();
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

std::vector<std::string> write_final_trajectories(const std::string& path,
                                                  const std::vector<slam::MapTrajectory>& trajectories,
                                                  double unit_scale) {
  write_one(path, trajectories.empty() ? slam::MapTrajectory{} : trajectories.front(), unit_scale);
  std::vector<std::string> written{path};
  std::error_code ignored;
  // A device or pipe has no neighbours that could take the other maps.
  if (path == "-" || !std::filesystem::is_regular_file(path, ignored)) return written;
  int number = 2;
  for (std::size_t i = 1; i < trajectories.size(); ++i, ++number) {
    written.push_back(trajectory_path(path, number));
    write_one(written.back(), trajectories[i], unit_scale);
  }
  while (std::filesystem::remove(trajectory_path(path, number), ignored)) ++number;
  return written;
}

}  // namespace farpoint::daemon
