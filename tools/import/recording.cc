// SPDX-License-Identifier: Apache-2.0
#include "tools/import/recording.h"

#include <algorithm>
#include <iterator>
#include <set>
#include <span>

#include "daemon/config/camera_file.h"
#include "ipc/file_kind.h"
#include "ipc/image_codec.h"
#include "ipc/log.h"
#include "slam/geometry/rig.h"
#include "tools/common/errors.h"
#include "tools/common/text_file.h"
#include "tools/evaluate/statistics.h"

namespace farpoint::tools {
namespace {

const RecordingImage& first_image_of(const Recording& recording, int camera) {
  const auto found = std::find_if(recording.images.begin(), recording.images.end(),
                                  [camera](const RecordingImage& image) { return image.camera == camera; });
  return *found;  // the importers drop cameras without an image
}

}  // namespace

double median_rate_hz(const Recording& recording, int camera) {
  std::vector<double> intervals_s;
  std::int64_t last_utime = -1;
  for (const RecordingImage& image : recording.images) {
    if (image.camera != camera) continue;
    if (last_utime >= 0) intervals_s.push_back(static_cast<double>(image.utime - last_utime) * 1e-6);
    last_utime = image.utime;
  }
  return intervals_s.empty() ? 0.0 : 1.0 / percentile(std::move(intervals_s), 50.0);
}

std::size_t bytes_a_pixel(RawEncoding encoding) {
  switch (encoding) {
    case RawEncoding::kRgb8:
    case RawEncoding::kBgr8:
      return 3;
    case RawEncoding::kRgba8:
    case RawEncoding::kBgra8:
      return 4;
    case RawEncoding::kUyvy8:
    case RawEncoding::kYuyv8:
      return 2;
    case RawEncoding::kNone:
    case RawEncoding::kGrey8:
      break;
  }
  return 1;
}

void require_folder(const std::filesystem::path& folder, const std::string& wanted) {
  if (std::filesystem::is_directory(folder)) return;
  if (!std::filesystem::exists(folder))
    throw InputError(folder.string() + ": no such folder, expected one that holds " + wanted);
  const std::string wrong = ipc::wrong_kind(folder.string(), "a folder that holds " + wanted);
  throw InputError(!wrong.empty() ? wrong
                                  : folder.string() + ": is a file, expected a folder that holds " + wanted);
}

void add_camera(const std::filesystem::path& camera_file, const std::string& name, Recording* recording) {
  add_camera(daemon::read_camera_file(camera_file), camera_file.string(), name, recording);
}

void add_camera(const daemon::CameraFile& content, const std::string& origin, const std::string& name,
                Recording* recording) {
  RecordingCamera camera;
  camera.name = name;
  camera.parameters = content.parameters;
  camera.T_body_camera = content.T_body_camera.value_or(forward_looking_T_body_camera());
  camera.rate_hz = content.rate_hz;
  camera.row_time_s = content.row_time_s;
  if (content.T_body_camera) recording->body_name = "body";
  for (const std::string& notice : content.notices) recording->notices.push_back(origin + ": " + notice);
  recording->cameras.push_back(std::move(camera));
}

std::string read_image_file(const std::filesystem::path& file) {
  constexpr std::uintmax_t kMostBytes = ipc::LogReader::kMaxDataBytes - 1024;  // the message's other fields
  std::error_code absent;
  const std::uintmax_t bytes = std::filesystem::file_size(file, absent);
  if (!absent && bytes > kMostBytes) {
    throw InputError(file.string() + ": " + std::to_string(bytes >> 20) +
                     " MiB, expected an image file of less than 64 MiB");
  }
  return read_file(file);
}

ipc::ImageInfo probe_image_file(const std::string& bytes, const std::filesystem::path& file) {
  const std::span data(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  const std::optional<ipc::ImageInfo> info = ipc::probe_image(data);
  if (!info)
    throw InputError(file.string() + ": expected a PNG or JPEG image, found neither or a damaged one");
  return *info;
}

slam::SE3 forward_looking_T_body_camera() {
  return {slam::q_body_forward_camera(), Eigen::Vector3d::Zero()};
}

void complete_cameras(const std::filesystem::path& calibration, Recording* recording) {
  for (std::size_t c = 0; c < recording->cameras.size(); ++c) {
    RecordingCamera& camera = recording->cameras[c];
    const int index = static_cast<int>(c);
    if (camera.parameters.width_px == 0) {
      const std::filesystem::path& file = first_image_of(*recording, index).file;
      const ipc::ImageInfo info = probe_image_file(read_image_file(file), file);
      camera.parameters.width_px = info.width_px;
      camera.parameters.height_px = info.height_px;
    }
    const std::string complaint = slam::Camera::check(camera.parameters);
    if (!complaint.empty())
      throw InputError(calibration.string() + ": camera " + camera.name + ": " + complaint);
    if (camera.rate_hz == 0.0) camera.rate_hz = median_rate_hz(*recording, index);
  }
}

void keep_part(std::int64_t first, std::int64_t frames, const std::string& recording_name,
               Recording* recording) {
  std::set<std::int64_t> numbers;  // of instants; a pair of images may be some milliseconds apart
  for (const RecordingImage& image : recording->images) numbers.insert(image.sequence);
  const auto count = static_cast<std::int64_t>(numbers.size());
  if (first < 0 || first >= count || frames < 0) {
    throw InputError(recording_name + ": --first " + std::to_string(first) + " --frames " +
                     std::to_string(frames) + ": expected a part of its " + std::to_string(count) +
                     " frames, 0 to " + std::to_string(count - 1));
  }
  const std::int64_t left_out = frames == 0 ? 0 : std::max<std::int64_t>(count - first - frames, 0);
  const std::int64_t first_number = *std::next(numbers.begin(), first),
                     last_number = *std::next(numbers.rbegin(), left_out);
  std::erase_if(recording->images, [=](const RecordingImage& image) {
    return image.sequence < first_number || image.sequence > last_number;
  });
  const std::int64_t from = recording->images.front().utime, to = recording->images.back().utime;
  // So that truth can be interpolated at the first and last image.
  constexpr std::int64_t kMargin_us = 500'000;
  const auto outside = [=](const auto& sample) {
    return sample.utime < from - kMargin_us || sample.utime > to + kMargin_us;
  };
  std::erase_if(recording->imu, outside);
  std::erase_if(recording->wheels, outside);
  std::erase_if(recording->truth, outside);
}

}  // namespace farpoint::tools
