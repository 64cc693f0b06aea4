// SPDX-License-Identifier: Apache-2.0
#include "tools/import/video.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <vector>

#include "ipc/file_kind.h"
#include "ipc/image_codec.h"
#include "ipc/image_encoder.h"
#include "tools/common/child_process.h"
#include "tools/common/errors.h"
#include "tools/import/byte_file.h"

namespace farpoint::tools {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxProbeBytes = std::size_t{64} << 20;  // some 2 million frames
constexpr double kMinRate_hz = 1e-3, kMaxRate_hz = 10'000.0, kMaxTime_s = 9e9;

// As an address of a local file, whatever characters the name has: not as an option, a list or a network
// stream.
std::string address_of(const fs::path& file) {
  return "file:" + fs::absolute(file).string();
}

struct Probe {
  int width_px = 0, height_px = 0;
  std::vector<double> times_s;  // NaN: unknown
};

void take_line(std::string_view line, Probe* probe) {
  const std::size_t equals = line.find('=');
  if (equals == std::string_view::npos) return;
  const std::string_view key = line.substr(0, equals), text = line.substr(equals + 1);
  const auto parse = [&](auto* value) {
    return std::from_chars(text.data(), text.data() + text.size(), *value).ec == std::errc();
  };
  if (key == "width" && !parse(&probe->width_px)) probe->width_px = 0;
  if (key == "height" && !parse(&probe->height_px)) probe->height_px = 0;
  if (key != "best_effort_timestamp_time") return;
  double time_s = 0.0;
  probe->times_s.push_back(parse(&time_s) ? time_s : std::nan(""));
}

[[noreturn]] void refuse(const fs::path& file, const ChildProcess& child, const std::string& what) {
  const std::string said = child.complaint();
  throw InputError(file.string() + ": " + what + (said.empty() ? "" : " (" + said + ")"));
}

// Containers of one file. Others, such as playlists, name further files.
constexpr const char* kFormats =
    "mov,matroska,webm,avi,mpegts,mpeg,mpegvideo,h264,hevc,m4v,mjpeg,flv,asf,ogg,ivf,obu,yuv4mpegpipe";

// JPEG pictures one after another (MJPEG): no container, and no times.
bool is_raw_jpeg(const fs::path& file) {
  constexpr std::string_view kJpeg = "\xff\xd8\xff";
  const ByteFile content(file);
  return content.size() >= kJpeg.size() && content.read(0, kJpeg.size()) == kJpeg;
}

using Arguments = std::vector<std::string>;

// `program` with the options of its input: what it may open and how it reads that.
Arguments begin_of(const char* program, const char* protocols, const fs::path& file) {
  Arguments arguments = {program, "-v", "error", "-protocol_whitelist", protocols, "-format_whitelist",
                         kFormats};
  if (is_raw_jpeg(file)) arguments.insert(arguments.end(), {"-f", "mjpeg"});
  return arguments;
}

Arguments probe_arguments(const fs::path& file) {
  Arguments arguments = begin_of("ffprobe", "file", file);
  arguments.insert(arguments.end(), {"-select_streams", "v:0", "-show_entries",
                                     "stream=width,height:frame=best_effort_timestamp_time", "-of",
                                     "default=nw=1", address_of(file)});
  return arguments;
}

Arguments decoder_arguments(const fs::path& file) {
  Arguments arguments = begin_of("ffmpeg", "file,pipe", file);
  arguments.insert(arguments.end(), {"-nostdin", "-noautorotate", "-i", address_of(file), "-map", "0:v:0",
                                     "-vf", "scale=out_range=full", "-fps_mode", "passthrough", "-f",
                                     "rawvideo", "-pix_fmt", "gray", "pipe:1"});
  return arguments;
}

Probe probe_video(const fs::path& file) {
  ChildProcess child(probe_arguments(file), "ffmpeg");
  Probe probe;
  std::string rest;
  std::vector<char> buffer(1 << 16);
  std::size_t total = 0;
  for (std::size_t got = child.read(buffer); got > 0; got = child.read(buffer)) {
    total += got;
    if (total > kMaxProbeBytes) refuse(file, child, "more than two million frames, expected a shorter video");
    rest.append(buffer.data(), got);
    std::size_t begin = 0;
    for (std::size_t end = rest.find('\n'); end != std::string::npos; end = rest.find('\n', begin)) {
      take_line(std::string_view{rest}.substr(begin, end - begin), &probe);
      begin = end + 1;
    }
    rest.erase(0, begin);
  }
  if (child.wait() != 0 || probe.times_s.empty()) refuse(file, child, "expected a video that ffprobe reads");
  const auto pixels = std::int64_t{probe.width_px} * probe.height_px;
  if (probe.width_px < 1 || probe.height_px < 1 || probe.width_px > ipc::kMaxImageSide_px ||
      probe.height_px > ipc::kMaxImageSide_px || pixels > ipc::kMaxImagePixels)
    refuse(file, child,
           "frames of " + std::to_string(probe.width_px) + "x" + std::to_string(probe.height_px) +
               " pixels, expected at most 16384 a side and 64 million");
  return probe;
}

std::int64_t utime_of(const fs::path& file, const Probe& probe, std::size_t i, double rate_hz) {
  if (rate_hz != 0.0) return std::llround(static_cast<double>(i) * 1e6 / rate_hz);
  const double time_s = probe.times_s[i];
  if (!(time_s >= 0.0 && time_s <= kMaxTime_s))
    throw InputError(file.string() + ": frame " + std::to_string(i) +
                     (std::isnan(time_s) ? " has no time" : " is at " + std::to_string(time_s) + " s") +
                     ", expected --rate HZ");
  return std::llround(time_s * 1e6);
}

void add_frames(const fs::path& file, const Probe& probe, double rate_hz, Recording* recording) {
  std::int64_t last_utime = -1;
  for (std::size_t i = 0; i < probe.times_s.size(); ++i) {
    RecordingImage image;
    image.utime = utime_of(file, probe, i, rate_hz);
    if (image.utime <= last_utime)
      throw InputError(file.string() + ": frame " + std::to_string(i) +
                       " is not after the one before, expected --rate HZ");
    last_utime = image.utime;
    image.sequence = static_cast<std::int64_t>(i);
    image.file = file;
    recording->images.push_back(image);
  }
}

void check_file(const fs::path& file, double rate_hz) {
  if (!fs::exists(file)) throw InputError(file.string() + ": no such file, expected a video");
  if (fs::is_directory(file)) throw InputError(file.string() + ": is a folder, expected a video file");
  if (!fs::is_regular_file(file))
    throw InputError(file.string() + ": is a pipe or a device, expected a video file, which is read twice");
  const std::string wrong = ipc::wrong_kind(file.string(), "a video");
  if (wrong.empty() || wrong.find(" video, expected") != std::string::npos) return;
  if (!is_raw_jpeg(file)) throw InputError(wrong);
  if (rate_hz == 0.0)
    throw InputError(file.string() +
                     ": JPEG without a container, which has no times, expected --rate HZ with a stream of "
                     "pictures; 'farpoint import images' takes a folder of them");
}

// A JPEG file alone is a picture.
void refuse_picture(const fs::path& file, const Probe& probe) {
  if (probe.times_s.size() == 1 && is_raw_jpeg(file))
    throw InputError(ipc::wrong_kind(file.string(), "a video"));
}

}  // namespace

Recording read_video(const fs::path& file, const fs::path& camera_file, double rate_hz) {
  if (rate_hz != 0.0 && !(rate_hz >= kMinRate_hz && rate_hz <= kMaxRate_hz))
    throw InputError("--rate: expected frames a second, 0.001 to 10000");
  check_file(file, rate_hz);
  Recording recording;
  add_camera(camera_file, "camera", &recording);
  const Probe probe = probe_video(file);
  refuse_picture(file, probe);
  const slam::Camera::Parameters& camera = recording.cameras[0].parameters;
  if (probe.width_px != camera.width_px || probe.height_px != camera.height_px) {
    throw InputError(file.string() + ": frames of " + std::to_string(probe.width_px) + "x" +
                     std::to_string(probe.height_px) + " pixels, expected " +
                     std::to_string(camera.width_px) + "x" + std::to_string(camera.height_px) + " as in " +
                     camera_file.string());
  }
  add_frames(file, probe, rate_hz, &recording);
  complete_cameras(camera_file, &recording);
  return recording;
}

struct VideoFrames::Decoder {
  Decoder(fs::path video, int width, int height, std::int64_t frame_count)
      : file(std::move(video)),
        width_px(width),
        height_px(height),
        frames(frame_count),
        pixels(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)),
        child(decoder_arguments(file), "ffmpeg") {}

  void read_frame() {
    const std::span buffer(reinterpret_cast<char*>(pixels.data()), pixels.size());
    if (child.read(buffer) == pixels.size()) return;
    (void)child.wait();
    refuse(file, child, "ends before frame " + std::to_string(next) + ", expected what ffprobe counted");
  }

  // With a frame more, each frame's time could be that of another.
  void require_end() {
    char more = 0;
    if (child.read({&more, 1}) != 0)
      refuse(file, child, "more frames than the " + std::to_string(frames) + " that ffprobe counted");
  }

  fs::path file;
  int width_px, height_px;
  std::int64_t frames;  // that ffprobe counted
  std::vector<std::uint8_t> pixels;
  std::int64_t next = 0;  // number of the frame that comes next
  ChildProcess child;
};

VideoFrames::VideoFrames(fs::path file, int width_px, int height_px, std::int64_t frames)
    : decoder_(std::make_unique<Decoder>(std::move(file), width_px, height_px, frames)) {}

VideoFrames::~VideoFrames() = default;

std::string VideoFrames::frame(std::int64_t number) {
  Decoder& d = *decoder_;
  for (; d.next <= number; ++d.next) d.read_frame();
  if (d.next == d.frames) d.require_end();
  const std::vector<std::uint8_t> png = ipc::encode_png({d.width_px, d.height_px, d.pixels});
  return {png.begin(), png.end()};
}

}  // namespace farpoint::tools
