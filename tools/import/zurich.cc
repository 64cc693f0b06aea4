// SPDX-License-Identifier: Apache-2.0
#include "tools/import/zurich.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <span>
#include <utility>

#include "tools/common/errors.h"
#include "tools/common/numbers.h"
#include "tools/common/text_file.h"

namespace farpoint::tools {
namespace {

namespace fs = std::filesystem;

// The lines of a log after its heading. Columns are taken in the published order, whatever the heading says.
class LogFile {
 public:
  explicit LogFile(const fs::path& file) : text_(file, kCommaAndBlanks) {}
  [[nodiscard]] std::span<const FieldLine> lines() const {
    const std::span<const FieldLine> all(text_.lines());
    const bool heading = !all.empty() && std::isalpha(static_cast<unsigned char>(all[0].text(0)[0])) != 0;
    return heading ? all.subspan(1) : all;
  }

 private:
  FieldFile text_;
};

std::int64_t utime_of(const FieldLine& line) {
  const std::int64_t utime = line.integer_at(0, "the stamp [us]");
  if (utime < 0 || utime > kMaxUtime)
    line.fail("expected a stamp of 0 to 9e15 us, found '" + std::string(line.text(0)) + "'");
  return utime;
}

// Image number -> time, of the first line that names it.
std::map<std::int64_t, std::int64_t> read_image_times(const fs::path& file) {
  const LogFile log(file);
  std::map<std::int64_t, std::int64_t> utimes;
  for (const FieldLine& line : log.lines()) {
    line.require_fields(2, "stamp [us],imgid,lat,lon,alt,...");
    const std::int64_t utime = utime_of(line), number = line.integer_at(1, "the image's number");
    const auto next = utimes.lower_bound(number);
    if (next != utimes.end() && next->first == number) continue;
    if (next != utimes.end() || (!utimes.empty() && utime <= utimes.rbegin()->second))
      line.fail("expected number and stamp after those above, found " + std::string(line.text(1)) + " at " +
                std::string(line.text(0)));
    utimes.emplace_hint(next, number, utime);
  }
  return utimes;
}

// Number of 00123.jpg; negative for other names.
std::int64_t number_of(const fs::path& file) {
  return file.extension() == ".jpg" ? whole_number(file.stem().string()).value_or(-1) : -1;
}

void read_images(const fs::path& folder, const fs::path& log, Recording* recording) {
  const std::map<std::int64_t, std::int64_t> utimes = read_image_times(log);
  std::size_t unnamed = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::int64_t number = number_of(entry.path());
    const auto found = utimes.find(number);
    if (found != utimes.end()) {
      recording->images.push_back({found->second, number, 0, entry.path()});
    } else if (number >= 0) {
      ++unnamed;
    }
  }
  if (recording->images.empty())
    throw InputError(log.string() + ": none of its image numbers is a file in " + folder.string());
  std::sort(recording->images.begin(), recording->images.end(),
            [](const RecordingImage& a, const RecordingImage& b) { return a.utime < b.utime; });
  if (unnamed > 0)
    recording->notices.push_back(log.string() + ": has no time of " + std::to_string(unnamed) +
                                 " images, which were left out");
}

std::vector<std::pair<std::int64_t, Eigen::Vector3d>> read_axes(const fs::path& file) {
  const LogFile log(file);
  std::vector<std::pair<std::int64_t, Eigen::Vector3d>> samples;
  for (const FieldLine& line : log.lines()) {
    line.require_fields(5, "stamp [us],error count,x,y,z,...");
    const std::int64_t utime = utime_of(line);
    if (!samples.empty() && utime <= samples.back().first) continue;  // logged twice
    samples.emplace_back(
        utime, Eigen::Vector3d(line.number_at(2, "x"), line.number_at(3, "y"), line.number_at(4, "z")));
  }
  return samples;
}

void read_imu(const fs::path& logs, Recording* recording) {
  const auto gyro = read_axes(logs / "RawGyro.csv"), accel = read_axes(logs / "RawAccel.csv");
  std::size_t last = 0;
  for (const auto& [utime, acceleration] : accel) {
    while (last + 1 < gyro.size() && gyro[last + 1].first <= utime) ++last;
    if (last >= gyro.size() || gyro[last].first > utime) continue;
    recording->imu.push_back({utime, gyro[last].second, acceleration});
  }
}

void read_truth(const fs::path& file, Recording* recording) {
  std::map<std::int64_t, std::int64_t> utimes;
  for (const RecordingImage& image : recording->images) utimes[image.sequence] = image.utime;
  const LogFile log(file);
  recording->truth_has_orientation = false;
  for (const FieldLine& line : log.lines()) {
    line.require_fields(4, "imgid,x,y,z,...");
    const auto found = utimes.find(line.integer_at(0, "the image's number"));
    if (found == utimes.end()) continue;
    RecordingTruth truth;
    truth.utime = found->second;
    truth.T_world_body.t = {line.number_at(1, "x"), line.number_at(2, "y"), line.number_at(3, "z")};
    recording->truth.push_back(truth);
  }
  std::sort(recording->truth.begin(), recording->truth.end(),
            [](const RecordingTruth& a, const RecordingTruth& b) { return a.utime < b.utime; });
}

}  // namespace

Recording read_zurich(const fs::path& root, const fs::path& camera_file, Damaged damaged) {
  require_folder(root, "'MAV Images' and 'Log Files', the Zurich Urban MAV recording");
  const fs::path images = root / "MAV Images", logs = root / "Log Files";
  if (!fs::is_directory(images))
    throw InputError(images.string() + ": no such folder, expected that of the Zurich Urban MAV recording");
  Recording recording;
  add_camera(camera_file, "camera", &recording);
  read_images(images, logs / "OnboardGPS.csv", &recording);
  if (fs::exists(logs / "RawGyro.csv") && fs::exists(logs / "RawAccel.csv"))
    read_sensor(
        damaged, [&] { read_imu(logs, &recording); }, &recording.imu, &recording);
  const fs::path truth = logs / "GroundTruthAGL.csv";
  if (fs::exists(truth))
    read_sensor(
        damaged, [&] { read_truth(truth, &recording); }, &recording.truth, &recording);
  complete_cameras(camera_file, &recording);
  return recording;
}

}  // namespace farpoint::tools
