// SPDX-License-Identifier: Apache-2.0
// One camera and wheels, through the programs: metres, in figures of the whole path (se3, no scale is
// fitted).
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <regex>
#include <string>
#include <vector>

#include "tests/ipc/scratch.h"
#include "tests/replay/recordings.h"

namespace farpoint::test {
namespace {

namespace fs = std::filesystem;

// RMS of the final trajectory's positions, metres; a large number where there is none.
double error_m(const std::string& run_log, const std::string& truth, const Scratch& work) {
  const std::string json = work.path("figures.json");
  if (run((kBin / "farpoint").string() + " evaluate " + run_log + " --truth " + truth +
          " --align se3 --json > " + json) != 0)
    return 1e9;
  std::ifstream file(json);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  std::smatch found;
  const std::regex final_error(R"re("final"[^}]*?"ate_rmse_m": ?([0-9.eE+-]+))re");
  return std::regex_search(text, found, final_error) ? std::stod(found[1]) : 1e9;
}

int replay(const std::string& log, const std::string& out, const std::string& settings) {
  return run((kBin / "farpointd").string() + " --replay " + log + " --lockstep --output " + out +
             " --set camera.use=one " + settings);
}

// The wheels' stand-in is an INS behind the camera, left of it and below: in the bend it drives another way.
TEST(RecordedWheels, OneCameraOfTheKittiRawPartIsMetric) {
  if (!fs::exists(kData / "kitti_raw")) GTEST_SKIP() << "no recording " << (kData / "kitti_raw");
  const Scratch work;
  const std::string log = work.path("recording.lcm"), out = work.path("out.lcm");
  const std::string truth = (kData / ".." / "check" / "truth" / "kitti_raw0039_camera.tum").string();
  if (!fs::exists(truth)) GTEST_SKIP() << "no truth " << truth;
  ASSERT_TRUE(import_recording("kitti {}/kitti_raw 0039", log));
  ASSERT_EQ(replay(log, out, "--set wheels.x_m=-1.08 --set wheels.y_m=0.32 --set wheels.z_m=-0.72"), 0);
  constexpr double kPath_m = 168.0;
  EXPECT_LE(error_m(out, truth, work), 0.0035 * kPath_m);
}

struct Sample {
  double time_s = 0, speed_mps = 0, yaw_rate_radps = 0;
};

// Wheels of KITTI 03 from its poses: 50 Hz, one percent too fast, 2 cm/s of noise, three spins of 3 s, a gap
// of 1 s.
class WheelsOfTruth {
 public:
  explicit WheelsOfTruth(const fs::path& poses, double frame_s) : frame_s_(frame_s) {
    std::ifstream file(poses);
    for (std::vector<double> m(12); read(file, &m);) {
      places_.emplace_back(m[3], m[7], m[11]);
      yaws_.push_back(std::atan2(-m[2], m[10]));
    }
  }
  void write(const fs::path& csv) const {
    std::ofstream file(csv);
    std::mt19937_64 random(5);
    const double end_s = frame_s_ * static_cast<double>(places_.size() - 2);
    for (double t = 0.0; t < end_s; t += 0.02) {
      const double speed_noise = 0.02 * normal(&random), yaw_noise = 0.005 * normal(&random);
      if (t > 15.0 && t < 16.0) continue;
      file << fmt::format("{:.6f},{:.6f},{:.6f}\n", t, 1.01 * slip(t) * speed(t) + speed_noise,
                          yaw_rate(t) + yaw_noise);
    }
  }

 private:
  static bool read(std::ifstream& file, std::vector<double>* matrix) {
    for (double& value : *matrix)
      if (!(file >> value)) return false;
    return true;
  }
  static double normal(std::mt19937_64* random) {
    double sum = -6.0;
    for (int i = 0; i < 12; ++i) sum += static_cast<double>((*random)() >> 11) * 0x1p-53;
    return sum;
  }
  static double slip(double t) {
    if (t > 8.0 && t < 11.0) return 1.12;
    if (t > 20.0 && t < 23.0) return 1.25;
    return t > 32.0 && t < 35.0 ? 1.2 : 1.0;
  }
  // Rates between frames hold in their middle, and are interpolated.
  [[nodiscard]] double between(double t, const std::vector<double>& rates) const {
    const double at = std::max(t / frame_s_ - 0.5, 0.0);
    const auto i = std::min(static_cast<std::size_t>(at), rates.size() - 2);
    return rates[i] + (at - static_cast<double>(i)) * (rates[i + 1] - rates[i]);
  }
  [[nodiscard]] double speed(double t) const {
    std::vector<double> rates;
    for (std::size_t i = 1; i < places_.size(); ++i)
      rates.push_back((places_[i] - places_[i - 1]).norm() / frame_s_);
    return between(t, rates);
  }
  [[nodiscard]] double yaw_rate(double t) const {
    std::vector<double> rates;
    for (std::size_t i = 1; i < yaws_.size(); ++i)
      rates.push_back(std::remainder(yaws_[i] - yaws_[i - 1], 6.283185307179586) / frame_s_);
    return between(t, rates);
  }

  double frame_s_;
  std::vector<Eigen::Vector3d> places_;
  std::vector<double> yaws_;
};

TEST(RecordedWheels, SlipsOfTheWheelsAreLeftOutByWhatTheImagesShow) {
  const fs::path data = kData / "kitti", original = data / "sequences" / "03";
  if (!fs::exists(original)) GTEST_SKIP() << "no recording " << original;
  const Scratch work;
  const fs::path changed = work.path("kitti"), copy = changed / "sequences" / "03";
  fs::create_directories(copy);
  fs::create_directory_symlink(data / "poses", changed / "poses");
  fs::create_directory_symlink(original / "image_0", copy / "image_0");
  for (const char* name : {"times.txt", "calib.txt"}) fs::create_symlink(original / name, copy / name);
  WheelsOfTruth(data / "poses" / "03.txt", 0.1036).write(copy / "wheels.csv");
  const std::string log = work.path("recording.lcm"), gated = work.path("gated.lcm"),
                    open = work.path("open.lcm");
  ASSERT_EQ(run((kBin / "farpoint").string() + " import kitti " + changed.string() + " 03 -o " + log), 0);
  ASSERT_EQ(replay(log, gated, ""), 0);
  ASSERT_EQ(replay(log, open, "--set wheels.gate_sigmas=0"), 0);
  constexpr double kPath_m = 284.0;
  const double gated_m = error_m(gated, log, work), open_m = error_m(open, log, work);
  EXPECT_LE(gated_m, 0.004 * kPath_m);
  EXPECT_GE(open_m, 1.5 * gated_m);
}

}  // namespace
}  // namespace farpoint::test
