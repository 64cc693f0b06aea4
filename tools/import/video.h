// SPDX-License-Identifier: Apache-2.0
// Video files, decoded by ffmpeg as a child process: ffprobe names the frames' times, ffmpeg writes grey
// frames into a pipe. Neither is linked.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "tools/import/recording.h"

namespace farpoint::tools {

// Times are the video's own, or frame i is at i / rate_hz where rate_hz is not 0, which a raw MJPEG stream
// needs. Luma of limited range (16 to 235) becomes 0 to 255; grey video keeps its levels, since encoders name
// a range for it that it does not have. Frames are not turned, whatever the file says of its orientation.
// Throws InputError, also where ffprobe is not installed.
[[nodiscard]] Recording read_video(const std::filesystem::path& file,
                                   const std::filesystem::path& camera_file, double rate_hz);

// The frames of a video, one after another.
class VideoFrames {
 public:
  // `frames`: how many ffprobe counted.
  VideoFrames(std::filesystem::path file, int width_px, int height_px, std::int64_t frames);
  ~VideoFrames();
  VideoFrames(const VideoFrames&) = delete;
  VideoFrames& operator=(const VideoFrames&) = delete;

  // Frame `number` as a PNG file; earlier ones are skipped. Precondition: numbers rise. Throws InputError
  // with ffmpeg's complaint where the video has no such frame, and after the last where it has more.
  [[nodiscard]] std::string frame(std::int64_t number);

 private:
  struct Decoder;
  std::unique_ptr<Decoder> decoder_;
};

}  // namespace farpoint::tools
