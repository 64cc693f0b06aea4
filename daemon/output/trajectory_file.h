// SPDX-License-Identifier: Apache-2.0
// Trajectories as files in TUM format: "seconds tx ty tz qx qy qz qw", T_map_body.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "daemon/output/file_writer.h"
#include "daemon/output/pose_sink.h"
#include "daemon/system/late_opened.h"
#include "ipc/output_file.h"
#include "slam/inspection.h"

namespace farpoint::daemon {

// One line with its newline. Seconds are utime / 1e6 with 6 decimals, exact; metres or map units with 9.
[[nodiscard]] std::string tum_line(std::int64_t utime, const slam::SE3& T_map_body);

// The same into a buffer, without the heap; returns its length. Long enough for any seven doubles.
inline constexpr std::size_t kMaxTumLine = 2560;
std::size_t put_tum_line(std::int64_t utime, const slam::SE3& T_map_body, std::span<char, kMaxTumLine> line);

// Each valid pose as published.
class LiveTrajectory final : public PoseSink {
 public:
  // Writes at once. Throws std::runtime_error if the file cannot be written.
  explicit LiveTrajectory(const std::string& path) { open(path); }
  // Writes at once, after open().
  LiveTrajectory() = default;
  // Writes on the thread of `files`, which outlives this object. Poses before open() are dropped.
  explicit LiveTrajectory(FileWriter* files);
  // Once, any thread. Throws std::runtime_error if the file cannot be written.
  void open(const std::string& path);
  [[nodiscard]] bool is_open() const { return file_.get() != nullptr; }
  void on_frame(const FrameOutput& frame) override;
  // Throws std::runtime_error if anything was not stored.
  void close();

 private:
  void write(std::span<const std::uint8_t> line);

  FileWriter* files_ = nullptr;
  std::uint32_t file_number_ = 0;
  LateOpened<ipc::OutputFile> file_;
};

// "dir/NAME.map2.tum" for dir/NAME.tum and 2.
[[nodiscard]] std::string trajectory_path(const std::string& path, int map_number);

// "dir/NAME.unsound.tum" for dir/NAME.tum.
[[nodiscard]] std::string unsound_path(const std::string& path);

// Writes the first trajectory to `path`, the others to NAME.map2.tum and so on. Frames whose map was never
// sound near them (sound_frames.h) go to unsound_path() of that file instead, where there are any. Without
// other frames, the file holds a comment only. Removes further such files of an earlier run. Positions are
// multiplied by unit_scale. `live_utimes`: of valid poses, ascending. Returns the written paths. Throws
// std::runtime_error.
std::vector<std::string> write_final_trajectories(const std::string& path,
                                                  const std::vector<slam::MapTrajectory>& trajectories,
                                                  std::span<const std::int64_t> live_utimes,
                                                  double unit_scale);

}  // namespace farpoint::daemon
