// Odometry on the bus between the images: at its rate, with growing age, and never a stale number.
#include <gtest/gtest.h>
#include <linux/can.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <thread>

#include "daemon/output/can_sink.h"
#include "daemon/system/stage_clock.h"
#include "tests/ipc/dbc.h"
#include "tests/ipc/scratch.h"
#include "tests/support/paths.h"

namespace farpoint::daemon {
namespace {

class SteadyCan : public testing::Test {
 public:
  ~SteadyCan() override { close(bus_); }

 protected:
  SteadyCan()
      : sink_(CanPoseFrame::kOdom), dbc_(test::read_dbc(test::source_dir() + "/config/farpoint.dbc")) {
    std::array<int, 2> ends{};
    EXPECT_EQ(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK, 0, ends.data()), 0);
    sink_.send_on(std::make_unique<drivers::SocketCan>(ends[0], drivers::CanOptions{}));
    bus_ = ends[1];
    sink_.send_steadily(50.0, 0.1);
    frame_.valid = true;
    frame_.age_us = 10'000;
    frame_.result.has_pose = true;
    frame_.result.state = slam::State::kTracking;
    frame_.result.scale = slam::ScaleState::kMetric;
    frame_.result.velocity_body << 10, 0, 0, 0, 0, 0;
    frame_.result.covariance = slam::Matrix6d::Identity() * 1e-4;
  }

  // The epochs sent so far: each a value of every signal by "MESSAGE.SIGNAL".
  std::vector<std::map<std::string, double>> epochs() {
    can_frame in{};
    while (read(bus_, &in, sizeof in) == static_cast<ssize_t>(sizeof in)) {
      if (in.can_id == 0x300) all_.emplace_back();
      ipc::CanFrame frame{in.can_id, in.len, {}};
      std::copy_n(in.data, in.len, frame.data.begin());
      for (const auto& [name, signal] : dbc_.at(in.can_id).signals)
        all_.back()[dbc_.at(in.can_id).name + "." + name] = signal.value(frame);
    }
    return all_;
  }

  CanSink sink_;
  const std::map<std::uint32_t, test::DbcMessage> dbc_;
  int bus_ = -1;
  FrameOutput frame_;
  wheels_t wheels_{};
  std::vector<std::map<std::string, double>> all_;
};

TEST_F(SteadyCan, BetweenTwoImagesAtTheRateWithGrowingAgeAndSigma) {
  sink_.on_frame(frame_);
  const double began_s = steady_s();
  for (double now_s = began_s; now_s < began_s + 0.1; now_s += 0.001)
    EXPECT_FALSE(sink_.tick(now_s, &wheels_));
  const auto sent = epochs();
  ASSERT_GE(sent.size(), 5U);  // the image's own, and after 20, 40, 60, 80 ms
  ASSERT_LE(sent.size(), 6U);
  for (std::size_t i = 1; i < sent.size(); ++i) {
    EXPECT_NEAR(sent[i].at("FARPOINT_STATUS.Age"), 0.010 + 0.020 * static_cast<double>(i), 0.003) << i;
    EXPECT_NEAR(sent[i].at("FARPOINT_POSITION_XY.PositionX"), 0.2 * static_cast<double>(i), 0.04) << i;
    EXPECT_EQ(sent[i].at("FARPOINT_STATUS.Counter"), static_cast<double>(i));
  }
  EXPECT_GT(sent.back().at("FARPOINT_POSITION_SIGMA.SigmaPositionX"),
            sent.front().at("FARPOINT_POSITION_SIGMA.SigmaPositionX"));
}

TEST_F(SteadyCan, IsDueAPeriodAfterTheImageAndThenEveryPeriod) {
  EXPECT_EQ(sink_.next_due_s(), std::numeric_limits<double>::infinity());  // nothing to carry on yet
  frame_.age_at_s = steady_s();
  sink_.on_frame(frame_);
  EXPECT_DOUBLE_EQ(sink_.next_due_s(), frame_.age_at_s + 0.020);
  EXPECT_FALSE(sink_.tick(frame_.age_at_s + 0.0199, &wheels_));
  EXPECT_EQ(epochs().size(), 1U);
  // Looked at a little late, it does not drift.
  EXPECT_FALSE(sink_.tick(frame_.age_at_s + 0.0205, &wheels_));
  EXPECT_EQ(epochs().size(), 2U);
  EXPECT_DOUBLE_EQ(sink_.next_due_s(), frame_.age_at_s + 0.040);
}

TEST_F(SteadyCan, WithoutARateNothingIsDue) {
  sink_.send_steadily(0.0, 0.1);
  sink_.on_frame(frame_);
  EXPECT_EQ(sink_.next_due_s(), std::numeric_limits<double>::infinity());
  EXPECT_FALSE(sink_.tick(steady_s() + 1.0, &wheels_));
  EXPECT_EQ(epochs().size(), 1U);
}

TEST_F(SteadyCan, TimeThatSendingTookIsInTheAge) {
  // Its age was 10 ms, but it took 30 ms until it was sent.
  frame_.age_at_s = steady_s() - 0.030;
  sink_.on_frame(frame_);
  const double now_s = steady_s();
  EXPECT_FALSE(sink_.tick(now_s, &wheels_));
  const auto sent = epochs();
  ASSERT_EQ(sent.size(), 2U);
  EXPECT_NEAR(sent[1].at("FARPOINT_STATUS.Age"), 0.010 + now_s - frame_.age_at_s, 0.0002);
}

TEST_F(SteadyCan, AfterAQuarterOfASecondNothingIsClaimedAnyMore) {
  sink_.on_frame(frame_);
  const double began_s = steady_s();
  for (double now_s = began_s; now_s < began_s + 0.4; now_s += 0.001)
    EXPECT_FALSE(sink_.tick(now_s, &wheels_));
  const auto sent = epochs();
  ASSERT_GE(sent.size(), 18U);
  EXPECT_EQ(sent[5].at("FARPOINT_STATUS.PoseValid"), 1.0);
  EXPECT_EQ(sent.back().at("FARPOINT_STATUS.PoseValid"), 0.0);
  EXPECT_TRUE(std::isnan(sent.back().at("FARPOINT_POSITION_XY.PositionX")));
  EXPECT_TRUE(std::isnan(sent.back().at("FARPOINT_VELOCITY.VelocityX")));
  EXPECT_GT(sent.back().at("FARPOINT_STATUS.Age"), 0.38);  // the age goes on
}

TEST_F(SteadyCan, WheelSpeedsComeIn) {
  const test::Scratch scratch;
  std::ofstream(scratch.path("a.dbc")) << "BO_ 291 W: 8 ABS\n SG_ L : 0|16@1+ (0.01,0) [0|600] \"km/h\"  X\n";
  sink_.read_wheels(std::make_unique<drivers::WheelReader>(scratch.path("a.dbc"), "W.L"));
  EXPECT_FALSE(sink_.tick(1.0, &wheels_));
  can_frame out{};
  out.can_id = 291;
  out.len = 8;
  out.data[0] = 0x10;
  out.data[1] = 0x0E;  // 36 km/h
  ASSERT_EQ(write(bus_, &out, sizeof out), static_cast<ssize_t>(sizeof out));
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  ASSERT_TRUE(sink_.tick(2.0, &wheels_));
  EXPECT_NEAR(wheels_.speed, 10.0, 1e-9);
  EXPECT_LE(wheels_.utime, 1'980'000);  // it arrived 20 ms before it was looked for
  EXPECT_GT(wheels_.utime, 1'000'000);
  EXPECT_FALSE(sink_.tick(2.1, &wheels_));
}

}  // namespace
}  // namespace farpoint::daemon
