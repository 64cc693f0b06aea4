// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/tool_support.h"

#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <vector>

#include "ipc/image_encoder.h"
#include "slam/geometry/se3.h"
#include "tests/support/paths.h"
#include "tools/common/errors.h"

namespace farpoint::tools {

namespace fs = std::filesystem;

ScratchFolder::ScratchFolder() {
  std::string name = (fs::temp_directory_path() / "farpoint_tools_XXXXXX").string();
  path_ = ::mkdtemp(name.data());
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

void put(const fs::path& file, const std::string& content) {
  fs::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << content;
}

std::string get(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void replace_in(const fs::path& file, const std::string& from, const std::string& to) {
  std::string content = get(file);
  const std::size_t at = content.find(from);
  ASSERT_NE(at, std::string::npos) << "'" << from << "' is not in " << file;
  put(file, content.replace(at, from.size(), to));
}

std::string make_image(const std::string& extension, int width_px, int height_px, int shade) {
  std::vector<unsigned char> pixels;
  for (int y = 0; y < height_px; ++y)
    for (int x = 0; x < width_px; ++x) pixels.push_back(static_cast<unsigned char>(x + y + shade));
  constexpr int kQuality = 95;
  const ipc::GreyPixels image{width_px, height_px, pixels};
  const auto bytes = extension == ".png" ? ipc::encode_png(image) : ipc::encode_jpeg(image, kQuality);
  return {bytes.begin(), bytes.end()};
}

std::string complaint_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const InputError& e) {
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << "more than one line";
    return e.what();
  }
  ADD_FAILURE() << "no InputError";
  return "";
}

bool passes_or_says_one_line(const std::function<void()>& action) {
  try {
    action();
    return true;
  } catch (const std::exception& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    return false;
  }
}

void expect_all_in(const std::string& message, const std::vector<std::string>& parts) {
  for (const std::string& part : parts)
    EXPECT_NE(message.find(part), std::string::npos) << "'" << part << "' in: " << message;
}

ProgramResult run_shell(const std::string& command) {
  const ScratchFolder scratch;
  const std::string out = (scratch / "out").string(), err = (scratch / "err").string();
  const int status = std::system(("(" + command + ") >" + out + " 2>" + err + " </dev/null").c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128, get(out), get(err)};
}

std::string program() {
  return test::binary_dir() + "/bin/farpoint";
}

ProgramResult run_farpoint_program(const std::string& arguments) {
  return run_shell(program() + " " + arguments);
}

void make_kitti(const fs::path& root) {
  const fs::path folder = root / "sequences" / "07";
  std::string times, poses;
  for (int i = 0; i < 5; ++i) {
    const std::string name = "00000" + std::to_string(i);
    put(folder / "image_0" / (name + ".png"), make_image(".png", 64, 48, i));
    put(folder / "image_1" / (name + ".png"), make_image(".png", 64, 48, 10 + i));
    times += "0." + std::to_string(i) + "25\n";
    // Straight ahead (camera z), 0.5 m a frame, turned by 180 degrees about the optical axis in the last one.
    const std::string flip = i == 4 ? "-1" : "1";
    poses += flip + " 0 0 0 0 " + flip + " 0 0 0 0 1 " + std::to_string(0.5 * i) + "\n";
  }
  put(folder / "times.txt", times);
  put(root / "poses" / "07.txt", poses);
  put(folder / "calib.txt",
      "P0: 50 0 31.5 0 0 51 23.5 0 0 0 1 0\n"
      "P1: 50 0 31.5 -25 0 51 23.5 0 0 0 1 0\n"
      "Tr: 1 0 0 0 0 1 0 0 0 0 1 0\n");
}

void make_euroc(const fs::path& root) {
  const fs::path mav0 = root / "mav0";
  std::string list = "#timestamp [ns],filename\r\n", imu = "#timestamp [ns],w,w,w,a,a,a\n";
  std::string truth = "#timestamp, p, p, p, q, q, q, q, v, v, v\n";
  for (int i = 0; i < 5; ++i) {
    const std::string stamp = "140363657976355" + std::to_string(5 + i) + "584";
    list += stamp + "," + stamp + ".png\r\n";  // the data set's own lists have Windows line ends
    put(mav0 / "cam0" / "data" / (stamp + ".png"), make_image(".png", 64, 48, i));
    if (i != 2) put(mav0 / "cam1" / "data" / (stamp + ".png"), make_image(".png", 64, 48, 9 + i));
    imu += stamp + ",0.1,0.2,0.3,9.8,0.5,-0.5\n";
    truth += stamp + "," + std::to_string(i) + ",2,3,0.6,0.8,0,0,0,0,0\n";
  }
  for (const char* camera : {"cam0", "cam1"}) {
    put(mav0 / camera / "data.csv", list);
    put(mav0 / camera / "sensor.yaml",
        "sensor_type: camera\n"
        "T_BS:\n  cols: 4\n  rows: 4\n"
        "  data: [0.0, -1.0, 0.0, 0.1,\n         1.0, 0.0, 0.0, 0.2,\n         0.0, 0.0, 1.0, 0.3,\n"
        "         0.0, 0.0, 0.0, 1.0]\n"
        "rate_hz: 20\nresolution: [64, 48]\ncamera_model: pinhole\nintrinsics: [50, 51, 31.5, 23.5]\n"
        "distortion_model: radial-tangential\ndistortion_coefficients: [-0.28, 0.07, 0.0002, 0.00002]\n");
  }
  put(mav0 / "imu0" / "data.csv", imu);
  put(mav0 / "imu0" / "sensor.yaml",
      "T_BS:\n  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\nrate_hz: 200\n"
      "gyroscope_noise_density: 1.7e-4\ngyroscope_random_walk: 1.9e-5\n"
      "accelerometer_noise_density: 2.0e-3\naccelerometer_random_walk: 3.0e-3\n");
  put(mav0 / "state_groundtruth_estimate0" / "data.csv", truth);
}

void make_tum(const fs::path& root) {
  std::string list = "# timestamp filename\n", truth = "# timestamp tx ty tz qx qy qz qw\n";
  for (int i = 0; i < 5; ++i) {
    const std::string stamp = "1305031229." + std::to_string(528748 + 33000 * i);
    list += stamp + " rgb/" + stamp + ".jpg\n";
    truth += stamp + " 1 2 " + std::to_string(i) + " 0.6 0 0 0.8\n";
    put(root / "rgb" / (stamp + ".jpg"), make_image(".jpg", 64, 48, i));
  }
  put(root / "rgb.txt", list);
  put(root / "groundtruth.txt", truth);
  put(root / "camera.yaml",
      "model: pinhole-radtan\nwidth_px: 64\nheight_px: 48\nfx_px: 50\nfy_px: 51\ncx_px: 31.5\ncy_px: 23.5\n"
      "distortion: [0.2, -0.9, -0.005, 0.002, 1.1]\n");
}

Trajectory random_path(std::mt19937_64* random, int n, double rate_hz, double start_s) {
  std::normal_distribution<double> normal;
  Trajectory path;
  slam::SE3 pose;
  slam::Vector6d step;
  step << 0.8, 0.0, 0.0, 0.0, 0.0, 0.0;  // forward
  for (int i = 0; i < n; ++i) {
    path.poses.push_back({start_s + i / rate_hz, pose, 0});
    for (int k = 3; k < 6; ++k) step[k] = 0.9 * step[k] + 0.01 * normal(*random);
    pose = pose.boxplus(step);
  }
  return path;
}

Trajectory disturbed(const Trajectory& path, double scale, double noise_m, std::mt19937_64* random) {
  std::normal_distribution<double> normal;
  const auto draw = [&] { return Eigen::Vector3d(normal(*random), normal(*random), normal(*random)); };
  const slam::Sim3 S_map_world{scale, slam::so3_exp(draw()), 20.0 * draw()};
  Trajectory result = path;
  for (TimedPose& p : result.poses) {
    p.pose = S_map_world * p.pose;
    p.pose.t += scale * noise_m * draw();
  }
  return result;
}

fs::path shared_folder() {
  const fs::path folder = fs::path(test::source_dir()) / ".." / "shared";
  return fs::is_directory(folder / "data") ? folder : fs::path();
}

std::string value_of(const std::string& line, const std::string& key) {
  const std::size_t at = (" " + line).find(" " + key + "=");
  if (at == std::string::npos) {
    ADD_FAILURE() << "no " << key << " in: " << line;
    return "";
  }
  const std::size_t begin = at + key.size() + 1;
  return line.substr(begin, line.find_first_of(" \n", begin) - begin);
}

}  // namespace farpoint::tools
