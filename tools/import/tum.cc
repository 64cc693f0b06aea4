// SPDX-License-Identifier: Apache-2.0
#include "tools/import/tum.h"

#include "tools/common/errors.h"
#include "tools/common/text_file.h"
#include "tools/trajectory/trajectory.h"

namespace farpoint::tools {
namespace {

namespace fs = std::filesystem;

void read_images(const fs::path& folder, Recording* recording) {
  const FieldFile text(folder / "rgb.txt", kBlanks);
  std::int64_t last_utime = -1;
  std::int64_t sequence = 0;
  for (const FieldLine& line : text.lines()) {
    line.require_fields(2, "timestamp filename");
    const std::int64_t utime = line.utime_from_seconds_at(0, "the timestamp");
    if (utime <= last_utime)
      line.fail("expected a timestamp after the one above, found " + std::string(line.text(0)));
    last_utime = utime;
    const fs::path file = folder / std::string(line.text(1));
    if (fs::exists(file)) {
      recording->images.push_back({utime, sequence, 0, file});
    } else {
      ++recording->missing_images;
    }
    ++sequence;
  }
  if (recording->images.empty()) {
    throw InputError((folder / "rgb.txt").string() +
                     ": lists no image that exists, expected lines 'timestamp filename'");
  }
}

void read_truth(const fs::path& file, Recording* recording) {
  const slam::SE3 T_camera_body = recording->cameras[0].T_body_camera.inverse();
  const Trajectory truth = read_tum(file);
  recording->truth_has_orientation = truth.has_orientation;
  for (const TimedPose& p : truth.poses) {
    const slam::SE3 T_world_body = truth.has_orientation ? p.pose * T_camera_body : p.pose;
    recording->truth.push_back({std::llround(p.time_s * 1e6), T_world_body});
  }
}

}  // namespace

Recording read_tum_rgbd(const fs::path& folder, const fs::path& camera_file, Damaged damaged) {
  require_folder(folder, "rgb.txt");
  Recording recording;
  add_camera(camera_file, "rgb", &recording);
  read_images(folder, &recording);
  const fs::path truth = folder / "groundtruth.txt";
  if (fs::exists(truth))
    read_sensor(
        damaged, [&] { read_truth(truth, &recording); }, &recording.truth, &recording);
  complete_cameras(camera_file, &recording);
  return recording;
}

}  // namespace farpoint::tools
