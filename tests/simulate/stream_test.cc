// SPDX-License-Identifier: Apache-2.0
// Streaming a simulation: when things go out, what they carry, and what is said where they cannot.
#include <gtest/gtest.h>
#include <linux/can.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "drivers/can/wheel_reader.h"
#include "ipc/channels.h"
#include "ipc/log.h"
#include "tests/simulate/small_worlds.h"
#include "tests/tools/tool_support.h"
#include "tools/common/errors.h"
#include "tools/simulate/sensors/measurements.h"
#include "tools/simulate/stream/recorder.h"
#include "tools/simulate/stream/stream.h"

#ifdef FARPOINT_WITH_V4L2
#include "tests/drivers/v4l2/fake_v4l2_output.h"
#include "tests/support/paths.h"
#endif

namespace farpoint::tools::simulate {
namespace {

// Time passes only in sleeps, or by a call of the test.
class FakeClock final : public PaceClock {
 public:
  [[nodiscard]] std::int64_t now_us() override { return time_us; }
  void sleep_until(std::int64_t due_us) override { time_us = std::max(time_us, due_us + overslept_us); }
  std::int64_t time_us = 1'000'000'000, overslept_us = 0;
};

// Images of one pixel, each of which takes its time.
class FakeFrames final : public FrameSource {
 public:
  explicit FakeFrames(FakeClock* clock, std::map<std::int64_t, std::int64_t> takes_us = {})
      : clock_(*clock), takes_us_(std::move(takes_us)) {}
  [[nodiscard]] bool is_ahead() override { return true; }
  [[nodiscard]] bool next(FrameImages* images) override {
    if (const auto takes = takes_us_.find(number_); takes != takes_us_.end()) clock_.time_us += takes->second;
    image_t image{};
    image.sequence = number_++;
    *images = {image};
    return true;
  }

 private:
  FakeClock& clock_;
  std::map<std::int64_t, std::int64_t> takes_us_;
  std::int64_t number_ = 0;
};

// What went out, and when.
struct Seen {
  std::string kind;
  std::int64_t utime = 0, at_us = 0;
};

class SeeingSink final : public StreamSink {
 public:
  SeeingSink(PaceClock* clock, std::vector<Seen>* seen) : clock_(*clock), seen_(*seen) {}
  void take_calibration(const calibration_t& m) override { note("calibration", m.utime); }
  void take_imu(const imu_t& m) override { note("imu", m.utime); }
  void take_wheels(const wheels_t& m) override { note("wheels", m.utime); }
  void take_truth(const ground_truth_t& m) override { note("truth", m.utime); }
  [[nodiscard]] bool take_image(const image_t& m) override {
    note("image", m.utime);
    return true;
  }
  [[nodiscard]] std::string name() const override { return "seen"; }

 private:
  void note(const std::string& kind, std::int64_t utime) { seen_.push_back({kind, utime, clock_.now_us()}); }
  PaceClock& clock_;
  std::vector<Seen>& seen_;
};

class StreamTest : public testing::Test {
 protected:
  StreamTest() {
    options_.started = [this](std::int64_t start) { start_us_ = start; };
  }
  void run(FrameSource* frames) {
    sinks_.push_back(std::make_unique<SeeingSink>(&clock_, &seen_));
    result_ = stream(simulation_, frames, sinks_, &clock_, options_);
  }
  [[nodiscard]] std::vector<Seen> of(const std::string& kind) const {
    std::vector<Seen> some;
    for (const Seen& one : seen_)
      if (one.kind == kind) some.push_back(one);
    return some;
  }

  Simulation simulation_{request_for("yard", 64, 48, 2.0)};  // 20 frames a second, wheels 50, IMU 200
  FakeClock clock_;
  StreamOptions options_;
  StreamSinks sinks_;
  std::vector<Seen> seen_;
  StreamResult result_;
  std::int64_t start_us_ = 0;
};

TEST_F(StreamTest, EverythingGoesOutWhenItIsDueAndSaysSo) {
  FakeFrames frames(&clock_);
  run(&frames);
  EXPECT_EQ(result_.frames, 40);
  EXPECT_EQ(result_.late, 0);
  EXPECT_EQ(result_.latest_us, 0);
  EXPECT_EQ(result_.reached, 1.0);
  for (const Seen& one : seen_) ASSERT_EQ(one.at_us, one.utime) << one.kind;
  const std::vector<Seen> images = of("image"), truth = of("truth"), imu = of("imu"), wheels = of("wheels");
  ASSERT_EQ(images.size(), 40U);
  ASSERT_EQ(truth.size(), 40U);
  ASSERT_EQ(imu.size(), 391U);  // up to the last frame, at 1.95 s
  ASSERT_EQ(wheels.size(), 98U);
  for (std::int64_t i = 0; i < 40; ++i) {
    EXPECT_EQ(images[static_cast<std::size_t>(i)].utime, start_us_ + 50'000 * i);
    EXPECT_EQ(truth[static_cast<std::size_t>(i)].utime, images[static_cast<std::size_t>(i)].utime);
  }
  EXPECT_EQ(imu[3].utime, start_us_ + 15'000);
  EXPECT_EQ(wheels[2].utime, start_us_ + 40'000);
  EXPECT_EQ(of("calibration").size(), 2U) << "each second";
}

TEST_F(StreamTest, ThePaceStretchesTheTimes) {
  FakeFrames frames(&clock_);
  options_.pace = 0.25;
  run(&frames);
  const std::vector<Seen> images = of("image"), wheels = of("wheels");
  EXPECT_EQ(images[3].utime, start_us_ + 600'000);
  EXPECT_EQ(images[3].at_us, images[3].utime);
  EXPECT_EQ(wheels[3].utime, start_us_ + 240'000);
  EXPECT_EQ(of("calibration").size(), 8U);
}

TEST_F(StreamTest, ASlowFrameIsLateAndKeepsItsStamp) {
  FakeFrames frames(&clock_, {{10, 130'000}});
  run(&frames);
  const std::vector<Seen> images = of("image");
  ASSERT_EQ(images.size(), 40U);
  for (std::int64_t i = 0; i < 40; ++i)
    EXPECT_EQ(images[static_cast<std::size_t>(i)].utime, start_us_ + 50'000 * i) << "stamps have no jitter";
  // Rendered from 0.5 s, when the samples before it were out, to 0.63 s; frames 11 and 12 wait behind it.
  EXPECT_EQ(images[10].at_us, images[10].utime + 130'000);
  EXPECT_EQ(images[11].at_us, images[11].utime + 80'000);
  EXPECT_EQ(images[12].at_us, images[12].utime + 30'000);
  EXPECT_EQ(images[13].at_us, images[13].utime);
  EXPECT_EQ(result_.late, 3);
  EXPECT_EQ(result_.latest_us, 130'000);
  EXPECT_EQ(result_.reached, 1.0) << "caught up";
}

TEST_F(StreamTest, ARendererThatIsTooSlowIsSaidToBe) {
  std::map<std::int64_t, std::int64_t> takes;
  for (std::int64_t i = 0; i < 40; ++i) takes[i] = 100'000;  // twice the period
  FakeFrames frames(&clock_, takes);
  run(&frames);
  EXPECT_EQ(result_.frames, 40);
  EXPECT_EQ(result_.late, 40);
  EXPECT_NEAR(result_.reached, 0.5, 0.02);
  EXPECT_EQ(of("image").back().utime, start_us_ + 50'000 * 39);
}

TEST_F(StreamTest, WakingALittleLateIsNotCounted) {
  FakeFrames frames(&clock_);
  clock_.overslept_us = kLate_us - 1;
  run(&frames);
  EXPECT_EQ(result_.late, 0);
  EXPECT_EQ(result_.latest_us, kLate_us - 1);
}

TEST_F(StreamTest, AStopEndsItBetweenTwoFrames) {
  FakeFrames frames(&clock_);
  options_.stop = [this] { return start_us_ > 0 && clock_.time_us >= start_us_ + 480'000; };
  run(&frames);
  EXPECT_EQ(result_.frames, 10);
  EXPECT_EQ(of("truth").size(), 10U);
}

// --- rendering ahead

TEST(FramesAhead, RendersNoMoreThanSoManyFramesAhead) {
  constexpr std::size_t kAhead = 3;
  std::atomic<std::int64_t> rendered = 0;
  FramesAhead frames(
      [&](std::int64_t frame) {
        ++rendered;
        image_t image{};
        image.sequence = frame;
        return FrameImages{image};
      },
      20, kAhead);
  for (std::int64_t taken = 0; taken < 20; ++taken) {
    for (int i = 0; i < 100 && !frames.is_ahead(); ++i) continue;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));  // what it would do too much
    EXPECT_EQ(rendered, std::min<std::int64_t>(taken + static_cast<std::int64_t>(kAhead), 20));
    FrameImages images;
    ASSERT_TRUE(frames.next(&images));
    EXPECT_EQ(images.at(0).sequence, taken);
  }
}

TEST(FramesAhead, WhatRenderingThrowsComesAfterTheFramesBefore) {
  FramesAhead frames(
      [](std::int64_t frame) {
        if (frame == 2) throw std::runtime_error("no paint");
        return FrameImages(1);
      },
      20, 4);
  FrameImages images;
  EXPECT_TRUE(frames.next(&images));
  EXPECT_TRUE(frames.next(&images));
  EXPECT_THROW((void)frames.next(&images), std::runtime_error);
}

TEST(FramesAhead, WhereNotOneIsRenderedWaitingForThemSaysWhy) {
  FramesAhead frames([](std::int64_t) -> FrameImages { throw std::runtime_error("no paint"); }, 20, 4);
  EXPECT_THROW((void)frames.is_ahead(), std::runtime_error);
}

TEST(LogSink, SaysWhatItLeavesWhereTheStreamIsAbandoned) {
  const ScratchFolder folder;
  const std::string log = (folder / "run.lcm").string();
  LogSink sink(log);
  sink.take_truth(ground_truth_t{});
  EXPECT_EQ(sink.abandon(), "; the log so far is kept as " + log + ".incomplete");
  EXPECT_EQ(sink.abandon(), "");
  EXPECT_TRUE(std::filesystem::exists(log + ".incomplete"));
  EXPECT_FALSE(std::filesystem::exists(log));
}

TEST(FramesAhead, IsGivenUpWhileItWaits) {
  FramesAhead frames([](std::int64_t) { return FrameImages(1); }, std::numeric_limits<std::int64_t>::max(),
                     2);
  for (int i = 0; i < 100 && !frames.is_ahead(); ++i) continue;
}

// --- sinks

#ifdef FARPOINT_WITH_V4L2
std::vector<std::vector<std::uint8_t>> recorded_images(const SimulationRequest& request,
                                                       const std::string& channel) {
  const ScratchFolder folder;
  Simulation simulation(request);
  RecorderOptions options;
  options.output = (folder / "run.lcm").string();
  record(&simulation, options);
  std::vector<std::vector<std::uint8_t>> images;
  ipc::LogReader reader(options.output);
  ipc::LogEvent event;
  while (reader.next(&event)) {
    if (event.channel != channel) continue;
    image_t message;
    EXPECT_TRUE(ipc::decode(event.data, &message));
    images.push_back(message.data);
  }
  return images;
}

TEST_F(StreamTest, DevicesGetTheImagesThatALogHasStampedAsMessagesAre) {
  SimulationRequest request = request_for("yard", 64, 48, 0.6);
  request.stereo = true;
  Simulation simulation(request);
  std::array<test::FakeOutput, 2> devices;
  StreamSinks sinks;  // ends before the devices that it holds
  for (int i = 0; i < 2; ++i)
    sinks.push_back(std::make_unique<VideoSink>(i, "/dev/video1" + std::to_string(i),
                                                drivers::OutputFormat{64, 48, 20.0},
                                                devices.at(static_cast<std::size_t>(i)).make_system()));
  sinks.push_back(std::make_unique<SeeingSink>(&clock_, &seen_));
  FramesAhead frames(renderer_of(&simulation), simulation.frames(), 3);
  result_ = stream(simulation, &frames, sinks, &clock_, options_);
  const std::vector<Seen> truth = of("truth");
  for (std::size_t camera = 0; camera < 2; ++camera) {
    const auto expected = recorded_images(request, "CAMERA_" + std::to_string(camera));
    const auto& came = devices.at(camera).images;
    ASSERT_EQ(came.size(), 12U);
    ASSERT_EQ(expected.size(), 12U);
    for (std::size_t i = 0; i < came.size(); ++i) {
      EXPECT_TRUE(came[i].bytes == expected[i]) << "camera " << camera << ", frame " << i;
      EXPECT_EQ(came[i].stamp_us, truth[i].utime);
    }
  }
  EXPECT_FALSE(devices[0].images[5].bytes == devices[1].images[5].bytes);
}

// The complaint that a device's fault ends a stream with.
std::string complaint_with(
    test::FakeOutput* device, const std::function<void()>& during = [] {}, double pace = 1.0) {
  Simulation simulation(request_for("yard", 64, 48, 2.0));
  FakeClock clock;
  StreamSinks sinks;
  sinks.push_back(std::make_unique<VideoSink>(0, "/dev/video10", drivers::OutputFormat{64, 48, 20.0},
                                              device->make_system()));
  StreamOptions options;
  options.pace = pace;
  options.progress = [&](std::int64_t frames) {
    if (frames == 6) during();
  };
  FramesAhead frames(renderer_of(&simulation), simulation.frames(), 3);
  try {
    stream(simulation, &frames, sinks, &clock, options);
  } catch (const RunError& error) {
    return error.what();
  }
  return "";
}

TEST(StreamVideo, ADeviceThatIsUnpluggedEndsTheStream) {
  test::FakeOutput device;
  device.unplugged_after = 5;
  EXPECT_EQ(complaint_with(&device), "/dev/video10: was unplugged while streaming");
  EXPECT_EQ(device.images.size(), 5U);
}

TEST(StreamVideo, ADeviceThatKeepsItsBuffersIsGivenUp) {
  test::FakeOutput device;
  EXPECT_EQ(complaint_with(&device, [&] { device.held = 1; }),
            "/dev/video10: has held all of its buffers for 1 s, expected it to give one back");
  EXPECT_EQ(device.images.size(), 6U);
}

TEST(StreamVideo, ASlowStreamWaitsForABufferAsLongAsThreeOfItsImagesTake) {
  test::FakeOutput device;  // 20 images a second at a hundredth of the pace: 5 s each
  EXPECT_EQ(complaint_with(
                &device, [&] { device.held = 1; }, 0.01),
            "/dev/video10: has held all of its buffers for 15 s, expected it to give one back");
}
#endif

// The other end of the socket stands for the bus.
TEST_F(StreamTest, TheDaemonsReaderHearsTheWheelsOnTheBus) {
  const ScratchFolder folder;
  const std::string dbc = (folder / "car.dbc").string(), names = "F.L,F.R,R.L,R.R";
  std::ofstream(dbc) << "BO_ 291 F: 8 ABS\n SG_ L : 7|16@0- (0.01,0) [-300|300] \"km/h\" X\n"
                        " SG_ R : 23|16@0- (0.01,0) [-300|300] \"km/h\" X\n"
                        "BO_ 292 R: 8 ABS\n SG_ L : 0|16@1- (0.01,0) [-300|300] \"km/h\" X\n"
                        " SG_ R : 16|16@1- (0.01,0) [-300|300] \"km/h\" X\n";
  std::array<int, 2> ends{};
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK, 0, ends.data()), 0);
  Simulation brief(request_for("yard", 64, 48, 1.0));
  sinks_.push_back(
      std::make_unique<CanSink>("can0", drivers::WheelWriter(dbc, names),
                                std::make_unique<drivers::SocketCan>(ends[0], drivers::CanOptions{})));
  FakeFrames frames(&clock_);
  result_ = stream(brief, &frames, sinks_, &clock_, options_);
  EXPECT_EQ(sinks_[0]->losses(), "");

  drivers::WheelReader reader(dbc, names);
  MotionMeasurements motion(brief);
  int heard = 0;
  can_frame in{};
  while (read(ends[1], &in, sizeof in) == static_cast<ssize_t>(sizeof in)) {
    ipc::CanFrame frame;
    frame.id = in.can_id;
    frame.size = in.len;
    std::copy_n(in.data, in.len, frame.data.begin());
    wheels_t message{};
    if (!reader.take(frame, 0, &message)) continue;
    std::optional<MotionSample> sample = motion.next(1e9);
    while (!std::holds_alternative<wheels_t>(sample->message)) sample = motion.next(1e9);
    for (std::size_t i = 0; i < 4; ++i)
      EXPECT_NEAR(message.wheel_speed[i], std::get<wheels_t>(sample->message).wheel_speed[i],
                  0.005 / 3.6 + 1e-9);
    ++heard;
  }
  close(ends[1]);
  EXPECT_EQ(heard, 48);  // 50 a second, up to the last frame at 0.95 s
}

// --- the program

struct Utimes {
  std::map<std::string, std::vector<std::int64_t>> of;
};

Utimes utimes_of(const std::filesystem::path& file) {
  Utimes found;
  ipc::LogReader reader(file.string());
  ipc::LogEvent event;
  while (reader.next(&event)) {
    std::int64_t utime = 0;  // the first member of each, behind the fingerprint
    for (std::size_t i = 8; i < 16; ++i) utime = utime << 8 | event.data[i];
    found.of[std::string(event.channel)].push_back(utime);
  }
  return found;
}

TEST(StreamProgram, LcmAndTheLogCarryTheSameTimesAndTheLastLineSaysHowItWent) {
  const ScratchFolder folder;
  const std::filesystem::path lcm = folder / "lcm.log", log = folder / "run.lcm";
  const ProgramResult result =
      run_farpoint_program("simulate yard --size 64x48 --duration 0.5 --stream -o " + log.string() +
                           " --lcm-url 'file://" + lcm.string() + "?mode=w'");
  EXPECT_EQ(result.status, kExitDone) << result.err;
  EXPECT_NE(result.out.find("10 of 10 frames of 64x48"), std::string::npos) << result.out;
  EXPECT_NE(result.out.find("of the pace reached"), std::string::npos) << result.out;
  Utimes sent = utimes_of(lcm), kept = utimes_of(log);
  EXPECT_EQ(sent.of.count("CAMERA_0"), 0U) << "no images over the network";
  EXPECT_EQ(kept.of.count("SIMULATION"), 0U);
  ASSERT_EQ(kept.of["CAMERA_0"].size(), 10U);
  EXPECT_EQ(kept.of["CAMERA_0"], sent.of["GROUND_TRUTH"]);
  for (const char* channel : {"IMU", "WHEELS", "GROUND_TRUTH", "CALIBRATION"}) {
    EXPECT_FALSE(sent.of[channel].empty()) << channel;
    EXPECT_EQ(kept.of[channel], sent.of[channel]) << channel;
  }
  const std::string first = std::to_string(sent.of["GROUND_TRUTH"].at(0));
  EXPECT_NE(result.out.find("frame 0 at " + first + " us"), std::string::npos) << result.out;
}

TEST(StreamProgram, ASignalEndsItInOrder) {
  const ScratchFolder folder;
  const std::string log = (folder / "run.lcm").string(), out = (folder / "out").string();
  const ProgramResult result =
      run_shell(test::binary_dir() +
                "/bin/farpoint simulate yard --size 64x48 --duration 600 --stream --lcm-url "
                "'file://" +
                (folder / "lcm.log").string() + "?mode=w' -o " + log + " > " + out +
                " & pid=$!; i=0; "
                "while [ $i -lt 600 ] && ! grep -q 'frame 0' " +
                out +
                "; do sleep 0.1; i=$((i + 1)); done; sleep 0.5; "
                "kill -TERM $pid; wait $pid");
  EXPECT_EQ(result.status, kExitDone) << result.err;
  EXPECT_NE(get(out).find("stopped by signal 15"), std::string::npos) << get(out);
  EXPECT_FALSE(utimes_of(log).of["IMU"].empty());
}

// liblcm adds a line of its own for an unknown provider.
std::int64_t lines_of_farpoint(const std::string& err) {
  std::istringstream lines(err);
  std::int64_t count = 0;
  for (std::string line; std::getline(lines, line);) count += line.starts_with("farpoint: ") ? 1 : 0;
  return count;
}

TEST(StreamProgram, BadDevicesAreOneLine) {
  const ScratchFolder folder;
  put(folder / "car.dbc", "BO_ 291 F: 8 ABS\n SG_ L : 7|16@0- (0.01,0) [-300|300] \"km/h\" X\n");
  const std::string wheels = " --wheels-dbc " + (folder / "car.dbc").string() + " --wheel-signals ";
  struct Case {
    std::string arguments;
    int status;
    std::string says;
  };
  std::vector<Case> cases = {
      {"--stream", kExitMisused, "expected where to"},
      {"--video /dev/video10", kExitMisused, "--stream"},
      {"--stream --can can0", kExitMisused, "--wheels-dbc"},
      {"--stream --can nocan0" + wheels + "F.R", kExitMisused, "no signal R"},
      {"--stream --can nocan0" + wheels + "F.L", kExitFailed, "cannot use CAN interface nocan0"},
      {"--stream --lcm-url --pictures .", kExitMisused, "--pictures"},
      {"--stream --lcm-url nonsense://", kExitFailed, "cannot publish on 'nonsense://'"},
      {"--stream --video /dev/video10 --second-video /dev/video11", kExitMisused, "--stereo"},
      {"--stream --lcm-url --every 5", kExitMisused, "--pictures"},
      {"--stream --lcm-url --pace 0", kExitMisused, "--pace"}};
#ifdef FARPOINT_WITH_V4L2
  cases.push_back({"--stream --video /dev/null", kExitFailed, "/dev/null: is no video device"});
  cases.push_back({"--stream --video /no/such/device", kExitFailed, "/no/such/device: cannot be opened"});
#endif
  for (const Case& one : cases) {
    const ProgramResult result =
        run_farpoint_program("simulate yard --size 64x48 --duration 0.2 " + one.arguments);
    EXPECT_EQ(result.status, one.status) << one.arguments;
    EXPECT_NE(result.err.find(one.says), std::string::npos) << one.arguments << ": " << result.err;
    EXPECT_EQ(lines_of_farpoint(result.err), 1) << result.err;
  }
}

}  // namespace
}  // namespace farpoint::tools::simulate
