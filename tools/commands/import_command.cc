// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>
#include <memory>

#include "ipc/printable.h"
#include "tools/commands/commands.h"
#include "tools/common/errors.h"
#include "tools/import/bag.h"
#include "tools/import/euroc.h"
#include "tools/import/images.h"
#include "tools/import/kaist.h"
#include "tools/import/kitti.h"
#include "tools/import/recording_log.h"
#include "tools/import/tum.h"
#include "tools/import/video.h"
#include "tools/import/zurich.h"

namespace farpoint::tools {
namespace {

struct ImportOptions {
  std::string folder, sequence, camera_file, output;
  std::int64_t first = 0, frames = 0;
  PictureTimes times;
  BagChoice bag;
  bool list = false, strict = false;

  [[nodiscard]] Damaged damaged() const { return strict ? Damaged::kRefused : Damaged::kLeftOut; }
};

void print_summary(const Recording& recording, const std::string& output) {
  const double seconds =
      static_cast<double>(recording.images.back().utime - recording.images.front().utime) * 1e-6;
  std::printf("%s: %zu camera%s, %zu images (%zu missing), %.1f s, %zu IMU samples, %zu truth %s\n",
              output.c_str(), recording.cameras.size(), recording.cameras.size() == 1 ? "" : "s",
              recording.images.size(), recording.missing_images, seconds, recording.imu.size(),
              recording.truth.size(), recording.truth_has_orientation ? "poses" : "positions");
}

int write_and_report(Recording recording, const ImportOptions& options, const ImageSource& source = {}) {
  if (options.first != 0 || options.frames != 0)
    keep_part(options.first, options.frames, options.folder, &recording);
  write_recording(recording, options.output, source);
  print_summary(recording, options.output);
  for (const std::string& notice : recording.notices)
    std::fprintf(stderr, "farpoint: %s\n", ipc::printable(notice).c_str());
  return kExitDone;
}

// The options of every layout except the name of what is read and --output.
CLI::App* add_part(CLI::App* layout, ImportOptions* options) {
  layout->add_option("--first", options->first, "Start at this frame, counted from 0")->capture_default_str();
  layout->add_option("--frames", options->frames, "Number of frames; 0: all that follow")
      ->capture_default_str();
  return layout;
}

CLI::App* add_layout(CLI::App* import, const char* name, const char* description, ImportOptions* options) {
  CLI::App* layout = import->add_subcommand(name, description);
  layout->add_option("DIR", options->folder, "Folder of the recording")->required();
  layout->add_option("-o,--output", options->output, "LCM log to write; an existing one is replaced")
      ->required();
  return add_part(layout, options);
}

// Of the layouts with sensors beside the images.
void add_strict(CLI::App* layout, ImportOptions* options) {
  layout->add_flag("--strict", options->strict,
                   "Refuse a damaged file of IMU or truth (default: warn, and import without that sensor)");
}

int import_images(const ImportOptions& options) {
  StampUnit unit = StampUnit::kAuto;
  Recording recording = read_images(options.folder, options.camera_file, options.times, &unit);
  const bool chosen = options.times.unit == StampUnit::kAuto && unit != StampUnit::kAuto;
  const double rate_hz = median_rate_hz(recording, 0);  // the camera file may name another
  const int status = write_and_report(std::move(recording), options);
  if (chosen)
    std::printf("stamps were read as %s (%.4g pictures a second); --unit chooses another unit\n",
                to_string(unit), rate_hz);
  return status;
}

void add_images_command(CLI::App* import, const std::shared_ptr<ImportOptions>& options, Action* action) {
  CLI::App* images =
      add_layout(import, "images", "A folder of PNG or JPEG pictures of one camera", options.get());
  images
      ->add_option("--camera", options->camera_file,
                   "Camera file (config/cameras), or a calibration of ROS, Kalibr or OpenCV")
      ->required();
  CLI::Option* rate = images->add_option("--rate", options->times.rate_hz, "Pictures a second");
  images
      ->add_option(
          "--times", options->times.stamps,
          "Text file with one stamp for each picture, or lines 'stamp name'; 'names': the files' names "
          "are the stamps")
      ->excludes(rate);
  static const std::map<std::string, StampUnit> kUnits = {{"auto", StampUnit::kAuto},
                                                          {"s", StampUnit::kSeconds},
                                                          {"ms", StampUnit::kMilliseconds},
                                                          {"us", StampUnit::kMicroseconds},
                                                          {"ns", StampUnit::kNanoseconds}};
  images
      ->add_option("--unit", options->times.unit, "Unit of the stamps: auto, s, ms, us or ns (default auto)")
      ->transform(CLI::CheckedTransformer(kUnits).description(""));
  images->footer(
      "Pictures are taken in the order of their names; numbers compare as numbers (9 before 10). Other "
      "files\n"
      "are skipped. 'auto' takes the unit in which pictures are 2 ms to 2 s apart, and prints it.\n"
      "Examples:\n"
      "  farpoint import images /data/drive --rate 30 --camera front.yaml -o drive.lcm\n"
      "  farpoint import images /data/drive --times names --camera front.yaml -o drive.lcm");
  images->callback([=] { *action = [=] { return import_images(*options); }; });
}

void add_urban_commands(CLI::App* import, const std::shared_ptr<ImportOptions>& options, Action* action) {
  CLI::App* kaist =
      add_layout(import, "kaist", "KAIST Urban: DIR holds image, sensor_data and calibration", options.get());
  add_strict(kaist, options.get());
  kaist->footer(
      "Reads image/stereo_left and stereo_right with calibration/left.yaml, right.yaml and "
      "Vehicle2Stereo.txt, and where\n"
      "there are any sensor_data/xsens_imu.csv, encoder.csv and global_pose.csv. Bayer patterns become grey "
      "PNG images.\n"
      "Example: farpoint import kaist /data/kaist/urban28 -o urban28.lcm");
  kaist->callback([=] {
    *action = [=] {
      return write_and_report(read_kaist(options->folder, options->damaged()), *options, read_kaist_image);
    };
  });

  CLI::App* zurich =
      add_layout(import, "zurich", "Zurich Urban MAV: DIR holds 'MAV Images' and 'Log Files'", options.get());
  zurich
      ->add_option("--camera", options->camera_file,
                   "Camera file (config/cameras), or a calibration of ROS, Kalibr or OpenCV")
      ->required();
  add_strict(zurich, options.get());
  zurich->footer(
      "Reads the images with their times from OnboardGPS.csv, RawGyro.csv and RawAccel.csv, and positions "
      "from "
      "GroundTruthAGL.csv.\n"
      "calibration_data.npz is not read: write its numbers into a camera file.\n"
      "Example: farpoint import zurich /data/AGZ --camera agz.yaml -o agz.lcm");
  zurich->callback([=] {
    *action = [=] {
      return write_and_report(read_zurich(options->folder, options->camera_file, options->damaged()),
                              *options);
    };
  });
}

int list_topics(const std::string& file) {
  for (const BagTopic& topic : list_bag(file))
    std::printf("%8llu  %-32s  %s\n", static_cast<unsigned long long>(topic.messages),
                ipc::printable(topic.type).c_str(), ipc::printable(topic.name).c_str());
  return kExitDone;
}

int import_bag(const ImportOptions& options) {
  if (options.list) return list_topics(options.folder);
  if (options.output.empty()) throw InputError("import bag: expected --output FILE, or --list");
  BagChoice choice = options.bag;
  choice.camera_file = options.camera_file;
  return write_and_report(read_bag(options.folder, choice), options);
}

void add_bag_command(CLI::App* import, const std::shared_ptr<ImportOptions>& options, Action* action) {
  CLI::App* bag = import->add_subcommand(
      "bag", "A recording of ROS: a ROS 1 bag, MCAP, or a ROS 2 bag (.db3 or its folder)");
  bag->add_option("FILE", options->folder, "The bag")->required();
  bag->add_option("-o,--output", options->output, "LCM log to write; an existing one is replaced");
  bag->add_flag("--list", options->list,
                "Print the topics with type and number of messages, and write nothing");
  bag->add_option("--image", options->bag.image, "Topic of the images (default: the only one)");
  bag->add_option("--second-image", options->bag.second_image,
                  "Topic of a second camera's images, which become CAMERA_1");
  bag->add_option("--camera", options->camera_file,
                  "Camera file or calibration (default: the topic camera_info beside the images)");
  bag->add_option("--second-camera", options->bag.second_camera_file,
                  "The same for the second camera; both files name T_body_camera");
  bag->add_option("--imu", options->bag.imu, "Topic of the IMU, or 'none' (default: the only one)");
  bag->add_option(
      "--wheels", options->bag.wheels,
      "Topic of odometry or twist whose forward speed and yaw rate become WHEELS (default: none)");
  bag->add_option("--truth", options->bag.truth,
                  "Topic of odometry, pose, transform or point that becomes GROUND_TRUTH (default: none)");
  add_part(bag, options.get());
  bag->footer(
      "Images of sensor_msgs/Image are stored as grey, those of CompressedImage as they are (PNG or JPEG).\n"
      "A message's time is its header's. Chunks may be compressed (bz2, lz4, zstd). Without --second-camera "
      "the\n"
      "second camera's place follows from R and P of camera_info, as stereo calibrations have them. Images "
      "up "
      "to\n"
      "5 ms apart are a pair.\n"
      "Examples:\n"
      "  farpoint import bag drive.bag --list\n"
      "  farpoint import bag drive.bag --image /cam0/image_raw -o drive.lcm\n"
      "  farpoint import bag drive.db3 --image /left/image_raw --second-image /right/image_raw \\\n"
      "    --camera camchain.yaml#cam0 --second-camera camchain.yaml#cam1 --truth /vicon/body -o drive.lcm");
  bag->callback([=] { *action = [=] { return import_bag(*options); }; });
}

int import_video(const ImportOptions& options) {
  Recording recording = read_video(options.folder, options.camera_file, options.times.rate_hz);
  const slam::Camera::Parameters& camera = recording.cameras[0].parameters;
  VideoFrames frames(options.folder, camera.width_px, camera.height_px,
                     static_cast<std::int64_t>(recording.images.size()));
  return write_and_report(std::move(recording), options,
                          [&](const RecordingImage& image) { return frames.frame(image.sequence); });
}

void add_video_command(CLI::App* import, const std::shared_ptr<ImportOptions>& options, Action* action) {
  CLI::App* video =
      import->add_subcommand("video", "A video file, decoded by the programs of the package ffmpeg");
  video->add_option("FILE", options->folder, "The video")->required();
  video->add_option("-o,--output", options->output, "LCM log to write; an existing one is replaced")
      ->required();
  video
      ->add_option("--camera", options->camera_file,
                   "Camera file (config/cameras), or a calibration of ROS, Kalibr or OpenCV")
      ->required();
  video->add_option("--rate", options->times.rate_hz, "Frames a second (default: the video's own times)");
  add_part(video, options.get());
  video->footer(
      "Frames become grey PNG images of the size in the file, whatever orientation the file asks for. Levels "
      "of\n"
      "colour video go from 0 to 255, also where the file has 16 to 235; those of grey video stay as they "
      "are.\n"
      "A raw MJPEG stream has no times and needs --rate.\n"
      "Example: farpoint import video drive.mp4 --camera front.yaml -o drive.lcm");
  video->callback([=] { *action = [=] { return import_video(*options); }; });
}

}  // namespace

void add_import_command(CLI::App* app, Action* action) {
  CLI::App* import = app->add_subcommand("import", "Turn a recording into an LCM log");
  import->require_subcommand(1);
  import->footer(
      "The log holds CALIBRATION first, then IMU, GROUND_TRUTH and CAMERA_N in the order of their times; "
      "image files\n"
      "are copied as they are (PNG or JPEG). utime is the data set's own time in microseconds.\n"
      "KITTI and TUM name no body: it stands at camera 0, x forward, y left, z up. Truth is of the body, in "
      "the data\n"
      "set's own world.\n"
      "Examples:\n"
      "  farpoint import kitti /data/kitti 03 -o kitti03.lcm\n"
      "  farpoint import euroc /data/euroc/MH_01_easy -o mh01.lcm\n"
      "  farpoint import tum /data/tum/freiburg1_rpy --camera config/cameras/tum-freiburg1.yaml -o rpy.lcm\n"
      "  farpoint import images /data/drive --rate 30 --camera front.yaml -o drive.lcm");

  const auto options = std::make_shared<ImportOptions>();
  CLI::App* kitti = add_layout(import, "kitti", "KITTI odometry: DIR/sequences/SEQUENCE", options.get());
  kitti->add_option("SEQUENCE", options->sequence, "Name of the sequence, like 03")->required();
  add_strict(kitti, options.get());
  kitti->footer(
      "Reads calib.txt, times.txt (absent: 0.1 s apart), image_0, image_1 where there is one, and truth "
      "from\n"
      "DIR/poses/SEQUENCE.txt or, for positions only, gps_xy.txt in the sequence ('seconds east north').\n"
      "wheels.csv in the sequence ('#seconds,speed_mps,yaw_rate_rad_per_s') becomes WHEELS.");
  kitti->callback([=] {
    *action = [=] {
      return write_and_report(read_kitti(options->folder, options->sequence, options->damaged()), *options);
    };
  });

  CLI::App* euroc = add_layout(import, "euroc", "EuRoC (ASL): DIR holds mav0, or is it", options.get());
  add_strict(euroc, options.get());
  euroc->footer(
      "Reads cam0, cam1 and imu0 where there are any, and state_groundtruth_estimate0. Images missing on one "
      "side are\n"
      "counted and left out.");
  euroc->callback([=] {
    *action = [=] { return write_and_report(read_euroc(options->folder, options->damaged()), *options); };
  });

  CLI::App* tum = add_layout(import, "tum", "TUM RGB-D: DIR holds rgb.txt", options.get());
  tum->add_option("--camera", options->camera_file,
                  "Camera file (config/cameras), or a calibration of ROS, Kalibr or OpenCV")
      ->required();
  add_strict(tum, options.get());
  tum->footer("Reads rgb.txt and groundtruth.txt where there is one. Depth is not read.");
  tum->callback([=] {
    *action = [=] {
      return write_and_report(read_tum_rgbd(options->folder, options->camera_file, options->damaged()),
                              *options);
    };
  });

  add_urban_commands(import, options, action);
  add_images_command(import, options, action);
  add_bag_command(import, options, action);
  add_video_command(import, options, action);
}

}  // namespace farpoint::tools
