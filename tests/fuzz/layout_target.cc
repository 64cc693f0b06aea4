// SPDX-License-Identifier: Apache-2.0
// Text files of recorded data sets. Each input replaces one file of a small recording of one layout.
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>

#include "daemon/config/errors.h"
#include "ipc/image_encoder.h"
#include "tests/fuzz/targets.h"
#include "tools/import/euroc.h"
#include "tools/import/kaist.h"
#include "tools/import/kitti.h"
#include "tools/import/tum.h"
#include "tools/import/zurich.h"

namespace farpoint::fuzz {
namespace {

namespace fs = std::filesystem;
using tools::Damaged;
using tools::Recording;

struct TextFile {
  const char* name;
  const char* content;
};

struct Layout {
  std::vector<TextFile> files;
  std::vector<const char*> images;
  std::function<Recording(const fs::path&, Damaged)> read;
};

constexpr const char* kSensor =
    "T_BS:\n  data: [0, -1, 0, 0.1, 1, 0, 0, 0.2, 0, 0, 1, 0.3, 0, 0, 0, 1]\nrate_hz: 20\n"
    "resolution: [64, 48]\nintrinsics: [50, 51, 31, 23]\ndistortion_model: radial-tangential\n"
    "distortion_coefficients: [-0.28, 0.07, 0.0002, 0.00002]\n";
constexpr const char* kCamera =
    "model: pinhole-radtan\nwidth_px: 64\nheight_px: 48\nfx_px: 50\nfy_px: 50\ncx_px: 31\ncy_px: 23\n"
    "distortion: []\n";

Layout kitti() {
  return {{{"sequences/07/calib.txt", "P0: 50 0 31 0 0 51 23 0 0 0 1 0\nP1: 50 0 31 -25 0 51 23 0 0 0 1 0\n"},
           {"sequences/07/times.txt", "0.0\n0.1\n"},
           {"poses/07.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 0.5\n"},
           {"sequences/07/wheels.csv", "#seconds,speed_mps,yaw_rate_rad_per_s\n0.0,5.1,0.01\n0.1,5.2,nan\n"}},
          {"sequences/07/image_0/000000.png", "sequences/07/image_0/000001.png"},
          [](const fs::path& root, Damaged damaged) { return read_kitti(root, "07", damaged); }};
}

Layout euroc() {
  return {
      {{"mav0/cam0/data.csv", "#timestamp [ns],filename\r\n1403636579763555584,1403636579763555584.png\r\n"},
       {"mav0/cam0/sensor.yaml", kSensor},
       {"mav0/imu0/data.csv", "#t,w,w,w,a,a,a\n1403636579763555584,0.1,0.2,0.3,9.8,0.5,-0.5\n"},
       {"mav0/imu0/sensor.yaml",
        "T_BS:\n  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\nrate_hz: 200\n"
        "gyroscope_noise_density: 1.7e-4\ngyroscope_random_walk: 1.9e-5\n"
        "accelerometer_noise_density: 2.0e-3\naccelerometer_random_walk: 3.0e-3\n"},
       {"mav0/state_groundtruth_estimate0/data.csv",
        "#t,p,p,p,q,q,q,q,v,v,v\n1403636579763555584,1,2,3,0.6,0.8,0,0,0,0,0\n"}},
      {"mav0/cam0/data/1403636579763555584.png"},
      [](const fs::path& root, Damaged damaged) { return read_euroc(root, damaged); }};
}

Layout tum() {
  return {{{"rgb.txt", "# timestamp filename\n1305031229.528748 rgb/1.png\n1305031229.561748 rgb/2.png\n"},
           {"groundtruth.txt", "# timestamp tx ty tz qx qy qz qw\n1305031229.5 1 2 3 0.6 0 0 0.8\n"},
           {"camera.yaml", kCamera}},
          {"rgb/1.png", "rgb/2.png"},
          [](const fs::path& root, Damaged damaged) {
            return read_tum_rgbd(root, root / "camera.yaml", damaged);
          }};
}

Layout kaist() {
  return {
      {{"sensor_data/stereo_stamp.csv", "1544582648735081000\n1544582648835081000\n"},
       {"sensor_data/xsens_imu.csv", "1544582648735081000,0,0,0,1,1,2,3,0.1,0.2,0.3,9.7,0.5,-0.5,7,8,9\n"},
       {"sensor_data/encoder.csv", "1544582648735081000,1000,2000\n1544582648835081000,1100,2110\n"},
       {"global_pose.csv", "1544582648735081000,0,-1,0,353000.5,1,0,0,4026000,0,0,1,20\n"},
       {"calibration/left.yaml",
        "%YAML:1.0\n---\nimage_width: 64\nimage_height: 48\ncamera_matrix: !!opencv-matrix\n   rows: 3\n"
        "   cols: 3\n   dt: d\n   data: [ 50., 0., 31., 0., 51., 23., 0., 0., 1. ]\n"
        "distortion_model: plumb_bob\ndistortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 5\n"
        "   dt: d\n   data: [ -0.05, 0.12, 0., 0., 0. ]\n"},
       {"calibration/Vehicle2Stereo.txt", "R: 0 0 1 -1 0 0 0 -1 0\nT: 1.6 0.25 1.5\n"},
       {"calibration/Vehicle2IMU.txt", "R: 1 0 0 0 1 0 0 0 1\nT: -0.07 0 1.7\n"},
       {"calibration/EncoderParameter.txt",
        "Encoder calibrated parameter\nEncoder resolution: 4096\nEncoder left wheel diameter: 0.62\n"
        "Encoder right wheel diameter: 0.64\nEncoder wheel base: 1.5\n"}},
      {"image/stereo_left/1544582648735081000.png", "image/stereo_left/1544582648835081000.png"},
      [](const fs::path& root, Damaged damaged) { return read_kaist(root, damaged); }};
}

Layout zurich() {
  return {
      {{"Log Files/OnboardGPS.csv",
        "Timpstemp, imgid, lat, lon, alt\n7000000, 1, 473844060, 85453410, 455000\n7033333, 2, 1, 2, 3\n"},
       {"Log Files/GroundTruthAGL.csv", "imgid, x_gt, y_gt, z_gt\n1, 465671.5, 5247976.25, 460\n"},
       {"Log Files/RawGyro.csv", "Timpstemp, Error_count, x, y, z, temperature\n7000000, 0, 1, 2, 3, 40\n"},
       {"Log Files/RawAccel.csv", "Timpstemp, Error_count, x, y, z, temperature\n7000001, 0, 1, 2, 3, 40\n"},
       {"camera.yaml", kCamera}},
      {"MAV Images/00001.jpg", "MAV Images/00002.jpg"},
      [](const fs::path& root, Damaged damaged) { return read_zurich(root, root / "camera.yaml", damaged); }};
}

const std::vector<Layout>& layouts() {
  static const std::vector<Layout> all = {kitti(), euroc(), tum(), kaist(), zurich()};
  return all;
}

void put(const fs::path& file, ByteView content) {
  fs::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary | std::ios::trunc)
      .write(reinterpret_cast<const char*>(content.data()), static_cast<std::streamsize>(content.size()));
}

// One folder a layout, made once a process.
const std::vector<fs::path>& folders() {
  static const std::vector<fs::path> made = [] {
    std::string name = (fs::temp_directory_path() / "farpoint_fuzz_XXXXXX").string();
    require(mkdtemp(name.data()) != nullptr, "mkdtemp");
    const std::vector<std::uint8_t> png =
        ipc::encode_png({64, 48, std::vector<std::uint8_t>(std::size_t{64} * 48, 90)});
    std::vector<fs::path> all;
    for (const Layout& layout : layouts()) {
      all.push_back(fs::path(name) / std::to_string(all.size()));
      for (const TextFile& file : layout.files) put(all.back() / file.name, bytes_of(file.content));
      for (const char* image : layout.images) put(all.back() / image, png);
    }
    return all;
  }();
  return made;
}

// Which file of which layout an input replaces.
struct Place {
  std::size_t layout = 0, file = 0;
};

Place place_of(std::size_t number) {
  std::size_t all = 0;
  for (const Layout& layout : layouts()) all += layout.files.size();
  number %= std::max<std::size_t>(all, 1);
  Place place;
  while (number >= layouts()[place.layout].files.size()) number -= layouts()[place.layout++].files.size();
  place.file = number;
  return place;
}

void check(const Recording& recording, const fs::path& folder) {
  require(!recording.images.empty() && !recording.cameras.empty(), "a recording has images and a camera");
  std::int64_t last = recording.images.front().utime;
  for (const tools::RecordingImage& image : recording.images) {
    require(image.utime >= last, "times of images rise");
    last = image.utime;
    require(image.file.string().starts_with(folder.string() + "/"), "images lie in the folder");
  }
  for (const tools::RecordingImu& sample : recording.imu)
    require(sample.acceleration_mps2.allFinite() && sample.angular_velocity_radps.allFinite(),
            "samples are finite");
  for (const tools::RecordingTruth& truth : recording.truth)
    require(truth.T_world_body.t.allFinite(), "truth is finite");
}

}  // namespace

void run_layout(ByteView input) {
  if (input.empty()) return;
  const Place place = place_of(input[0]);
  const Layout& layout = layouts()[place.layout];
  const TextFile& text = layout.files[place.file];
  const fs::path& folder = folders()[place.layout];
  put(folder / text.name, input.subspan(1));
  for (const Damaged damaged : {Damaged::kRefused, Damaged::kLeftOut}) {
    try {
      check(layout.read(folder, damaged), folder);
    } catch (const daemon::InputError&) {  // refused; the program escapes what it prints
    }
  }
  put(folder / text.name, bytes_of(text.content));
}

std::vector<Bytes> seeds_of_layout() {
  std::vector<Bytes> seeds;
  for (const Layout& layout : layouts()) {
    for (const TextFile& file : layout.files) {
      Bytes seed = {static_cast<std::uint8_t>(seeds.size())};
      const Bytes content = bytes_of(file.content);
      seed.insert(seed.end(), content.begin(), content.end());
      seeds.push_back(seed);
    }
  }
  return seeds;
}

}  // namespace farpoint::fuzz
