// SPDX-License-Identifier: Apache-2.0
// The thread of the MAVLink output, and an autopilot that the test plays on a UDP port.
#include "daemon/output/mavlink_output.h"

#include <gtest/gtest.h>

#include <cstring>
#include <functional>
#include <vector>

#include "daemon/system/stage_clock.h"
#include "tests/support/udp_peer.h"

namespace farpoint::daemon {
namespace {

namespace mav = ipc::mavlink;

constexpr double kPatience_s = 20;                     // a loaded machine
constexpr std::int64_t kAhead_ns = 5'000'000'000'000;  // the autopilot's clock

std::int64_t steady_ns() {
  return static_cast<std::int64_t>(1e9 * steady_s());
}

class Autopilot {
 public:
  // Takes what comes until `done`, and answers TIMESYNC requests where `answers` is set.
  void serve(const std::function<bool()>& done, bool answers) {
    const double end_s = steady_s() + kPatience_s;
    while (!done() && steady_s() < end_s) take(answers);
  }
  void send(const mav::Frame& frame) const { (void)peer_.answer(frame.bytes()); }

  [[nodiscard]] const std::string& link() const { return peer_.address(); }

  std::vector<std::vector<std::uint8_t>> odometry;  // payloads
  std::vector<mav::Timesync> answers;               // to the autopilot's own requests
  int heartbeats = 0, requests = 0;

 private:
  void take(bool answers_requests) {
    const std::vector<std::uint8_t> bytes = peer_.receive(20);
    if (bytes.empty()) return;
    mav::Parser parser;
    (void)parser.take(bytes);
    const auto received = parser.next();
    ASSERT_TRUE(received);
    if (received->id == mav::kHeartbeat.id) ++heartbeats;
    if (received->id == mav::kOdometry.id)
      odometry.emplace_back(received->payload.begin(), received->payload.end());
    if (received->id != mav::kTimesync.id) return;
    const mav::Timesync message = mav::decode_timesync(*received);
    if (message.tc1_ns != 0) return answers.push_back(message);
    ++requests;
    if (answers_requests)
      send(mav::encode(mav::Timesync{steady_ns() + kAhead_ns, message.ts1_ns, 0, 0}, {1, 1}, 0));
  }

  test::UdpPeer peer_;
};

template <typename T>
T read(const std::vector<std::uint8_t>& payload, std::size_t offset) {
  T value;
  std::memcpy(&value, payload.data() + offset, sizeof(T));
  return value;
}

class MavlinkOutputTest : public testing::Test {
 protected:
  void open(double rate_hz = 50) {
    MavlinkConfig config;
    config.enabled = true;
    config.link = autopilot.link();
    config.rate_hz = rate_hz;
    output = std::make_unique<MavlinkOutput>(config);
    output->start(RealtimeConfig{}, nullptr);
  }
  void show(slam::ScaleState scale, bool valid = true) {
    FrameOutput frame;
    frame.valid = valid;
    frame.result.state = slam::State::kTracking;
    frame.result.scale = scale;
    frame.result.T_odom_body.t = {1, 2, 3};
    frame.result.velocity_body[0] = 10;
    frame.age_at_s = steady_s();
    output->on_frame(frame);
  }
  // Shows frames until `done`.
  void drive(slam::ScaleState scale, const std::function<bool()>& done, bool answers = false,
             bool valid = true) {
    double next_s = 0;
    autopilot.serve(
        [&] {
          if (steady_s() > next_s) {
            show(scale, valid);
            next_s = steady_s() + 0.02;
          }
          return done();
        },
        answers);
  }

  Autopilot autopilot;
  std::unique_ptr<MavlinkOutput> output;
};

TEST_F(MavlinkOutputTest, SendsOdometryHeartbeatsAndRequests) {
  open();
  drive(slam::ScaleState::kMetric, [this] {
    return autopilot.odometry.size() >= 20 && autopilot.heartbeats >= 2 && autopilot.requests >= 5;
  });
  ASSERT_GE(autopilot.odometry.size(), 20U);
  EXPECT_GE(autopilot.heartbeats, 2);
  EXPECT_GE(autopilot.requests, 5);
  EXPECT_GE(output->counts().sent, 20);
  EXPECT_TRUE(output->counts().is_open);
  // Predicted along the body's x axis by less than 0.25 s; y and z point right and down.
  const std::vector<std::uint8_t>& payload = autopilot.odometry.back();
  EXPECT_GE(read<float>(payload, 8), 1.0F);
  EXPECT_LE(read<float>(payload, 8), 3.6F);
  EXPECT_EQ(read<float>(payload, 12), -2.0F);
  EXPECT_EQ(read<float>(payload, 16), -3.0F);
}

TEST_F(MavlinkOutputTest, WithoutMetresOnlyHeartbeatsAndTimesyncGoOut) {
  open();
  drive(slam::ScaleState::kUnknown, [this] { return output->counts().without_scale >= 20; });
  EXPECT_GE(output->counts().without_scale, 20);
  EXPECT_TRUE(autopilot.odometry.empty());
  EXPECT_GE(autopilot.heartbeats, 1);
  EXPECT_EQ(output->counts().sent, 0);
}

TEST_F(MavlinkOutputTest, AnInvalidPoseIsNotSent) {
  open();
  drive(
      slam::ScaleState::kMetric, [this] { return output->counts().without_pose >= 20; }, false, false);
  EXPECT_GE(output->counts().without_pose, 20);
  EXPECT_TRUE(autopilot.odometry.empty());
}

// After the camera has fallen silent the last pose is sent for a while only.
TEST_F(MavlinkOutputTest, APoseIsSentForAQuarterSecondAtMost) {
  open(100);
  show(slam::ScaleState::kMetric);
  const double began_s = steady_s();
  autopilot.serve([began_s] { return steady_s() > began_s + 0.6; }, false);
  EXPECT_GE(autopilot.odometry.size(), 1U);
  EXPECT_LE(autopilot.odometry.size(), 26U);
  EXPECT_GE(output->counts().without_pose, 10);
}

TEST_F(MavlinkOutputTest, StampsAndAnswersAreInTheAutopilotsTimeOnceItIsKnown) {
  open();
  drive(
      slam::ScaleState::kMetric, [this] { return output->counts().round_trip_us >= 0; }, true);
  ASSERT_GE(output->counts().round_trip_us, 0);
  autopilot.odometry.clear();
  drive(
      slam::ScaleState::kMetric, [this] { return autopilot.odometry.size() >= 5; }, true);
  ASSERT_GE(autopilot.odometry.size(), 5U);
  const std::int64_t here_us = steady_ns() / 1000,
                     stamp_us = read<std::int64_t>(autopilot.odometry.back(), 0);
  EXPECT_NEAR(1e-6 * static_cast<double>(stamp_us - here_us), 1e-9 * kAhead_ns, 1.0);
  const std::int64_t before_ns = steady_ns();
  autopilot.send(mav::encode(mav::Timesync{0, 4711, 0, 0}, {1, 1}, 9));
  autopilot.serve([this] { return !autopilot.answers.empty(); }, true);
  ASSERT_FALSE(autopilot.answers.empty());
  EXPECT_EQ(autopilot.answers[0].ts1_ns, 4711);
  EXPECT_EQ(autopilot.answers[0].target_component, 1);
  EXPECT_NEAR(1e-9 * static_cast<double>(autopilot.answers[0].tc1_ns - before_ns), 1e-9 * kAhead_ns, 5.0);
}

TEST_F(MavlinkOutputTest, AnswersOfOtherComponentsSetNoClock) {
  open();
  // Another component answers each request with nonsense.
  for (int i = 0; i < 10; ++i) {
    const int before = autopilot.requests;
    autopilot.serve([&] { return autopilot.requests > before; }, false);
    autopilot.send(mav::encode(mav::Timesync{77, steady_ns(), 0, 0}, {1, 158}, 0));
  }
  EXPECT_EQ(output->counts().round_trip_us, -1);
}

TEST(MavlinkOutputWithoutDevice, IsSaidCountedAndTriedAgain) {
  MavlinkConfig config;
  config.enabled = true;
  config.link = "serial:/dev/no-such-device:57600";
  MavlinkOutput output(config);
  output.start(RealtimeConfig{}, nullptr);
  const double end_s = steady_s() + kPatience_s;
  while (output.counts().failed_openings < 2 && steady_s() < end_s) ::usleep(10'000);
  EXPECT_GE(output.counts().failed_openings, 2);
  EXPECT_FALSE(output.counts().is_open);
  EXPECT_GT(output.counts().send_errors, 0);
}

}  // namespace
}  // namespace farpoint::daemon
