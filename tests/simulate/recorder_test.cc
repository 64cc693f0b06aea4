// SPDX-License-Identifier: Apache-2.0
// Simulated logs: the same bytes from the same seed, readable after every kind of ending.
#include <gtest/gtest.h>

#include <map>

#include "ipc/channels.h"
#include "ipc/image_codec.h"
#include "ipc/log.h"
#include "tests/simulate/small_worlds.h"
#include "tests/support/paths.h"
#include "tests/tools/tool_support.h"
#include "tools/common/errors.h"
#include "tools/simulate/stream/recorder.h"

namespace farpoint::tools::simulate {
namespace {

namespace fs = std::filesystem;

std::string recorded(const fs::path& file, const SimulationRequest& request,
                     ImageFormat format = ImageFormat::kGrey) {
  Simulation simulation(request);
  RecorderOptions options;
  options.output = file.string();
  options.format = format;
  record(&simulation, options);
  return get(file);
}

std::map<std::string, int> events_of(const fs::path& file, ipc::LogDamage* damage = nullptr) {
  std::map<std::string, int> counts;
  ipc::LogReader reader(file.string());
  ipc::LogEvent event;
  while (reader.next(&event)) ++counts[std::string(event.channel)];
  if (damage != nullptr) *damage = reader.damage();
  return counts;
}

// The decoded images of camera 0.
std::vector<ipc::GreyImage> images_of(const fs::path& file) {
  std::vector<ipc::GreyImage> images;
  ipc::LogReader reader(file.string());
  ipc::LogEvent event;
  ipc::ImageDecoder decoder;
  while (reader.next(&event)) {
    if (event.channel != "CAMERA_0") continue;
    image_t message;
    EXPECT_TRUE(ipc::decode(event.data, &message));
    EXPECT_EQ(decoder.decode(message, &images.emplace_back()), ipc::ImageStatus::kOk);
  }
  return images;
}

double mean_difference(const ipc::GreyImage& a, const ipc::GreyImage& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) sum += std::abs(a.pixels[i] - b.pixels[i]);
  return sum / static_cast<double>(a.pixels.size());
}

TEST(Recorder, TheSameSeedGivesTheSameBytesAndAnotherSeedAnotherWorld) {
  const ScratchFolder folder;
  SimulationRequest request = request_for("town", 96, 48, 0.3);
  const std::string first = recorded(folder / "a.lcm", request), again = recorded(folder / "b.lcm", request);
  EXPECT_TRUE(first == again);
  request.seed = 2;
  EXPECT_FALSE(first == recorded(folder / "c.lcm", request));

  // Not only other noise: the pictures have little in common.
  const std::vector<ipc::GreyImage> one = images_of(folder / "a.lcm"), other = images_of(folder / "c.lcm");
  ASSERT_EQ(one.size(), 3U);
  ASSERT_EQ(other.size(), 3U);
  EXPECT_GT(mean_difference(one[2], other[2]), 15.0);
}

TEST(Recorder, AWorldLooksTheSameWhereverTheVehicleCameFrom) {
  // The same place, looked at by one simulation that drove there and one that starts looking there.
  Simulation drove(request_for("endless", 96, 72, 60.0)), jumped(request_for("endless", 96, 72, 60.0));
  for (std::int64_t frame = 0; frame < 500; frame += 50) (void)drove.look(frame, 0, {{48, 36}});
  std::vector<Eigen::Vector2d> pixels;
  for (int y = 2; y < 70; y += 5) {
    for (int x = 2; x < 94; x += 5) pixels.emplace_back(x, y);
  }
  const std::vector<SeenPoint> a = drove.look(500, 0, pixels), b = jumped.look(500, 0, pixels);
  for (std::size_t i = 0; i < pixels.size(); ++i) EXPECT_EQ(a[i].distance_m, b[i].distance_m);
}

TEST(Recorder, HoldsEveryChannelAtItsRate) {
  const ScratchFolder folder;
  SimulationRequest request = request_for("town", 96, 48, 2.0);
  request.stereo = true;
  recorded(folder / "run.lcm", request);
  ipc::LogDamage damage;
  const std::map<std::string, int> events = events_of(folder / "run.lcm", &damage);
  EXPECT_EQ(damage.places, 0U);
  EXPECT_EQ(events.at("CALIBRATION"), 1);
  EXPECT_EQ(events.at("SIMULATION"), 1);
  EXPECT_EQ(events.at("CAMERA_0"), 20);
  EXPECT_EQ(events.at("CAMERA_1"), 20);
  EXPECT_EQ(events.at("GROUND_TRUTH"), 20);
  EXPECT_EQ(events.at("IMU"), 381);  // up to the last frame, at 1.9 s
  EXPECT_EQ(events.at("WHEELS"), 96);
}

TEST(Recorder, WritesMjpegOfTheSamePicture) {
  const ScratchFolder folder;
  const SimulationRequest request = request_for("town", 160, 64, 0.2);
  const std::string grey = recorded(folder / "grey.lcm", request),
                    jpeg = recorded(folder / "jpeg.lcm", request, ImageFormat::kMjpeg);
  EXPECT_LT(jpeg.size(), grey.size());
  const std::vector<ipc::GreyImage> plain = images_of(folder / "grey.lcm"),
                                    packed = images_of(folder / "jpeg.lcm");
  ASSERT_EQ(plain.size(), packed.size());
  EXPECT_LT(mean_difference(plain[0], packed[0]), 4.0);
}

std::string simulate_command(const fs::path& output, const std::string& rest = "") {
  return test::binary_dir() + "/bin/farpoint simulate town --size 160x64 -o " + output.string() + " " + rest;
}

TEST(SimulateProgram, AFullDiskIsAnErrorThatNamesTheLogAndKeepsWhatWasWritten) {
  const ScratchFolder folder;
  put(folder / "run.lcm", "before");
  // A limit of 200 blocks of 1024 bytes: some frames fit.
  const ProgramResult result = run_shell("bash -c 'ulimit -f 200; exec " +
                                         simulate_command(folder / "run.lcm", "--duration 10") + "'");
  EXPECT_EQ(result.status, kExitFailed) << result.err;
  EXPECT_NE(result.err.find("run.lcm: "), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("run.lcm.incomplete"), std::string::npos) << result.err;
  EXPECT_EQ(get(folder / "run.lcm"), "before") << "the file that was there stays";
  const std::map<std::string, int> events = events_of(folder / "run.lcm.incomplete");
  EXPECT_GE(events.at("CAMERA_0"), 5);
  EXPECT_EQ(events.at("CALIBRATION"), 1);
}

TEST(SimulateProgram, AFullDeviceIsAnError) {
  const ProgramResult result = run_shell(simulate_command("/dev/full", "--duration 2"));
  EXPECT_EQ(result.status, kExitFailed);
  EXPECT_NE(result.err.find("/dev/full: No space left on device after 0 frames"), std::string::npos)
      << result.err;
}

TEST(SimulateProgram, AReaderThatGoesAwayIsAnError) {
  std::string script = "(";
  script += simulate_command("-", "--duration 20");
  script += "; echo status=$? >&2) | head -c 100000 >/dev/null";
  const ProgramResult result = run_shell(script);
  EXPECT_NE(result.err.find("Broken pipe"), std::string::npos) << result.err;
  EXPECT_NE(result.err.find("status=1"), std::string::npos) << result.err;
}

// Ends a run by a signal once some frames are in its log, which may take its time on a busy machine.
ProgramResult run_until_signalled(const fs::path& folder, const std::string& signal) {
  constexpr int kSomeFrames_bytes = 40'000;
  std::string script = simulate_command(folder / "run.lcm", "--duration 600");
  script += " & pid=$!; i=0; while [ $i -lt 600 ] && [ $(cat ";
  script += folder.string();
  script += "/run.lcm* 2>/dev/null | wc -c) -lt ";
  script += std::to_string(kSomeFrames_bytes);
  script += " ]; do sleep 0.1; i=$((i + 1)); done; kill -";
  script += signal;
  script += " $pid; wait $pid";
  return run_shell(script);
}

TEST(SimulateProgram, ATerminatedRunKeepsItsLog) {
  const ScratchFolder folder;
  const ProgramResult result = run_until_signalled(folder.path(), "TERM");
  EXPECT_EQ(result.status, kExitFailed);
  EXPECT_NE(result.err.find("stopped by signal 15"), std::string::npos) << result.err;
  ipc::LogDamage damage;
  EXPECT_GE(events_of(folder / "run.lcm.incomplete", &damage).at("CAMERA_0"), 3);
  EXPECT_EQ(damage.places, 0U);
}

TEST(SimulateProgram, AKilledRunLeavesALogThatReplays) {
  const ScratchFolder folder;
  (void)run_until_signalled(folder.path(), "KILL");
  EXPECT_FALSE(fs::exists(folder / "run.lcm"));
  std::vector<fs::path> logs;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder.path())) logs.push_back(entry.path());
  ASSERT_EQ(logs.size(), 1U);
  EXPECT_TRUE(logs[0].filename().string().starts_with("run.lcm.part")) << logs[0];
  EXPECT_GE(events_of(logs[0]).at("CAMERA_0"), 3);
  const ProgramResult replay =
      run_shell(test::binary_dir() + "/bin/farpointd --replay " + logs[0].string() + " --lockstep");
  EXPECT_EQ(replay.status, kExitDone) << replay.err;
}

TEST(SimulateProgram, WrongUseIsOneLineAndStatus2) {
  const ScratchFolder folder;
  const std::string log = (folder / "run.lcm").string();
  const std::vector<std::string> misuses = {
      "simulate no-such-world -o " + log,
      "simulate town -o " + log + " --size 12",
      "simulate town -o " + log + " --seed -4",
      "simulate town -o /no/such/folder/run.lcm --duration 1 --size 64x48",
      std::string("simulate town"),
      "simulate town -o " + log + " --camera /no/such/camera.yaml"};
  for (const std::string& arguments : misuses) {
    const ProgramResult result = run_farpoint_program(arguments);
    EXPECT_EQ(result.status, kExitMisused) << arguments;
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
    EXPECT_FALSE(fs::exists(log));
  }
}

TEST(SimulateProgram, TakesACameraFile) {
  const ScratchFolder folder;
  const std::string camera = test::source_dir() + "/config/cameras/tum-freiburg1.yaml";
  const ProgramResult result = run_farpoint_program("simulate yard --duration 0.2 --camera " + camera +
                                                    " -o " + (folder / "run.lcm").string());
  EXPECT_EQ(result.status, kExitDone) << result.err;
  EXPECT_NE(result.out.find("640x480"), std::string::npos) << result.out;
}

}  // namespace
}  // namespace farpoint::tools::simulate
