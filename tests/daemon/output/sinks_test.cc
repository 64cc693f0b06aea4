// SPDX-License-Identifier: Apache-2.0
// The ways out, decoded by what a receiver has: the DBC file, and LCM's own log reader.
#include <gtest/gtest.h>
#include <lcm/eventlog.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <random>

#include "daemon/output/can_replay.h"
#include "daemon/output/publisher.h"
#include "tests/ipc/dbc.h"
#include "tests/ipc/scratch.h"
#include "tests/support/paths.h"

namespace farpoint::daemon {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

slam::FrameResult result_at(std::int64_t utime, std::mt19937_64* random) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  slam::FrameResult r;
  r.utime = utime;
  r.state = slam::State::kTracking;
  r.has_pose = true;
  r.T_map_body = {slam::so3_exp({unit(*random), unit(*random), 3.0 * unit(*random)}),
                  {5000.0 * unit(*random), 5000.0 * unit(*random), 100.0 * unit(*random)}};
  r.T_odom_body = {slam::so3_exp({0.0, 0.0, unit(*random)}), {unit(*random), unit(*random), unit(*random)}};
  for (int i = 0; i < 6; ++i) r.velocity_body[i] = unit(*random);
  r.covariance.setIdentity();
  r.covariance *= 1e-4;
  r.velocity_covariance = r.covariance;
  r.quality = 90;
  return r;
}

// All signals of all epochs of a candump file, by what the DBC file says.
using Epoch = std::map<std::string, double>;
std::vector<std::pair<std::int64_t, Epoch>> decode_can_log(const std::string& path) {
  const auto dbc = test::read_dbc(test::source_dir() + "/config/farpoint.dbc");
  std::vector<std::pair<std::int64_t, Epoch>> epochs;
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) {
    ipc::CandumpLine parsed;
    EXPECT_TRUE(ipc::parse_candump_line(line, &parsed)) << line;
    const auto message = dbc.find(parsed.frame.id);
    EXPECT_NE(message, dbc.end()) << line;
    if (message == dbc.end()) continue;
    if (message->second.name == "FARPOINT_STATUS") epochs.emplace_back(parsed.utime, Epoch{});
    EXPECT_EQ(epochs.back().first, parsed.utime);
    for (const auto& [name, signal] : message->second.signals) {
      // Of the counters that of the status frame.
      if (name == "Counter" && message->second.name != "FARPOINT_STATUS") continue;
      epochs.back().second[name] = signal.value(parsed.frame);
    }
  }
  return epochs;
}

std::string can_log_of(const std::string& path, const std::vector<FrameOutput>& frames,
                       CanPoseFrame pose_frame) {
  EpochOptions options;
  options.pose_frame = pose_frame;
  CanReplay sink(ipc::CanLayout{}, options);
  sink.log_to(std::make_unique<ipc::CandumpWriter>(path, "can0"));
  for (const FrameOutput& frame : frames) sink.on_frame(frame);
  EXPECT_EQ(sink.errors(), 0);
  sink.close();
  return path;
}

TEST(CanReplay, ReceiverWithTheDbcGetsThePoseBackWithinAUnit) {
  const test::Scratch scratch;
  std::mt19937_64 random(1);
  constexpr int kFrames = 200;
  std::vector<FrameOutput> frames;
  frames.reserve(kFrames);
  for (int i = 0; i < kFrames; ++i) frames.push_back(make_frame_output(result_at(i * 100'000, &random), 1.0));
  const auto epochs = decode_can_log(can_log_of(scratch.path("a.candump"), frames, CanPoseFrame::kMap));
  ASSERT_EQ(epochs.size(), 5 * (frames.size() - 1) + 2);  // between the frames too, and the farewell
  for (std::size_t i = 0; i < frames.size(); ++i) {
    auto [utime, e] = epochs[5 * i];
    const slam::FrameResult& r = frames[i].result;
    ASSERT_EQ(utime, r.utime);
    EXPECT_NEAR(e["PositionX"], r.T_map_body.t.x(), 0.0051);
    EXPECT_NEAR(e["PositionY"], r.T_map_body.t.y(), 0.0051);
    EXPECT_NEAR(e["PositionZ"], r.T_map_body.t.z(), 0.0051);
    const Eigen::Quaterniond q = Eigen::AngleAxisd(e["Heading"] * kDegree, Eigen::Vector3d::UnitZ()) *
                                 Eigen::AngleAxisd(e["Pitch"] * kDegree, Eigen::Vector3d::UnitY()) *
                                 Eigen::AngleAxisd(e["Roll"] * kDegree, Eigen::Vector3d::UnitX());
    EXPECT_LE(q.angularDistance(r.T_map_body.q) / kDegree, 0.01);
    EXPECT_NEAR(e["VelocityY"], r.velocity_body[1], 0.0026);
    EXPECT_NEAR(e["YawRate"] * kDegree, r.velocity_body[5], 0.026 * kDegree);
    EXPECT_EQ(e["Frame"], 1.0);
    EXPECT_EQ(e["ScaleState"], 1.0);
    EXPECT_EQ(e["PoseValid"], 1.0);
    EXPECT_EQ(e["State"], 3.0);
    EXPECT_EQ(e["BootCounter"], 0.0);
    EXPECT_EQ(e["Predicted"], 0.0);
    EXPECT_EQ(e["Age"], 0.0);
  }
}

TEST(CanReplay, OdomFrameOnRequest) {
  const test::Scratch scratch;
  std::mt19937_64 random(2);
  const FrameOutput frame = make_frame_output(result_at(0, &random), 1.0);
  auto epochs = decode_can_log(can_log_of(scratch.path("a.candump"), {frame}, CanPoseFrame::kOdom));
  ASSERT_EQ(epochs.size(), 2u);
  EXPECT_NEAR(epochs[0].second["PositionX"], frame.result.T_odom_body.t.x(), 0.0051);
  EXPECT_EQ(epochs[0].second["Frame"], 0.0);
}

TEST(CanReplay, WithoutAScalePositionAndVelocityAreNotAvailable) {
  const test::Scratch scratch;
  std::mt19937_64 random(3);
  const FrameOutput frame = make_frame_output(result_at(0, &random), 0.0);
  auto epochs = decode_can_log(can_log_of(scratch.path("a.candump"), {frame}, CanPoseFrame::kMap));
  ASSERT_EQ(epochs.size(), 2u);
  Epoch& e = epochs[0].second;
  for (const char* name : {"PositionX", "PositionY", "PositionZ", "VelocityX", "VelocityY", "VelocityZ"}) {
    EXPECT_TRUE(std::isnan(e[name])) << name;
  }
  EXPECT_FALSE(std::isnan(e["Heading"]));  // angles need no scale
  EXPECT_FALSE(std::isnan(e["YawRate"]));
  EXPECT_EQ(e["ScaleState"], 0.0);
}

TEST(CanReplay, LossIsSaidInTheNextEpochAndLeavesNoNumber) {
  const test::Scratch scratch;
  std::mt19937_64 random(4);
  std::vector<FrameOutput> frames{make_frame_output(result_at(0, &random), 1.0)};
  slam::FrameResult lost = result_at(100'000, &random);  // an estimate is there, but the state says lost
  lost.state = slam::State::kLost;
  frames.push_back(make_frame_output(lost, 1.0));
  auto epochs = decode_can_log(can_log_of(scratch.path("a.candump"), frames, CanPoseFrame::kMap));
  ASSERT_EQ(epochs.size(), 7u);
  Epoch& e = epochs[5].second;
  EXPECT_EQ(e["State"], 5.0);
  EXPECT_EQ(e["Reason"], 6.0);
  EXPECT_EQ(e["PoseValid"], 0.0);
  for (const char* name : {"PositionX", "PositionZ", "Heading", "Roll", "Pitch", "VelocityX", "YawRate"}) {
    EXPECT_TRUE(std::isnan(e[name])) << name;
  }
}

TEST(CanReplay, TheClockIsTheRecordingsAndBridgesGaps) {
  const test::Scratch scratch;
  std::mt19937_64 random(8);
  std::vector<FrameOutput> frames;
  for (const std::int64_t utime : {0, 100'000, 200'000, 1'400'000})
    frames.push_back(make_frame_output(result_at(utime, &random), 1.0));
  auto epochs = decode_can_log(can_log_of(scratch.path("a.candump"), frames, CanPoseFrame::kOdom));
  ASSERT_EQ(epochs.size(), 72u);
  for (std::size_t i = 0; i < epochs.size(); ++i) {
    EXPECT_EQ(epochs[i].first, static_cast<std::int64_t>(20'000 * i));
    EXPECT_EQ(epochs[i].second["Counter"], static_cast<double>(i % 15));
  }
  EXPECT_EQ(epochs[22].second["PoseValid"], 1.0);  // 0.24 s after the image
  EXPECT_EQ(epochs[23].second["PoseValid"], 0.0);
  EXPECT_EQ(epochs[23].second["State"], 5.0);
  EXPECT_EQ(epochs[70].second["PoseValid"], 1.0);
  EXPECT_EQ(epochs[71].second["State"], 8.0);
  EXPECT_TRUE(std::isnan(epochs[71].second["Age"]));
}

TEST(CanReplay, AFrameCountsFromWhenItWasThere) {
  const test::Scratch scratch;
  std::mt19937_64 random(9);
  std::vector<FrameOutput> frames;
  for (const std::int64_t utime : {0, 100'000, 200'000}) {
    frames.push_back(make_frame_output(result_at(utime, &random), 1.0));
    frames.back().age_us = 50'000;
  }
  auto epochs = decode_can_log(can_log_of(scratch.path("a.candump"), frames, CanPoseFrame::kOdom));
  ASSERT_EQ(epochs.size(), 12u);
  for (std::size_t i = 0; i < 11; ++i) {
    EXPECT_EQ(epochs[i].first, static_cast<std::int64_t>(50'000 + 20'000 * i));
    EXPECT_NEAR(epochs[i].second["Age"], 0.05 + 0.02 * static_cast<double>(i % 5), 1e-9) << i;
  }
}

TEST(CanReplay, ATimeFarAwayIsNoGapToFill) {
  const test::Scratch scratch;
  std::mt19937_64 random(10);
  std::vector<FrameOutput> frames;
  for (const std::int64_t utime : {std::int64_t{0}, std::int64_t{1} << 50})
    frames.push_back(make_frame_output(result_at(utime, &random), 1.0));
  const auto epochs = decode_can_log(can_log_of(scratch.path("a.candump"), frames, CanPoseFrame::kOdom));
  EXPECT_EQ(epochs.size(), 2u);
}

TEST(Publisher, LogHoldsEveryMessageAtItsFramesTime) {
  const test::Scratch scratch;
  const std::string path = scratch.path("out.lcm");
  std::mt19937_64 random(6);
  {
    ipc::LogWriter log(path);
    Publisher publisher;
    publisher.add(std::make_unique<LogMessageSink>(&log));
    FrameOutput frame = make_frame_output(result_at(1'000'000, &random), 0.0);
    publisher.on_frame(frame);
    frame.valid = false;
    frame.result.utime = 1'100'000;
    publisher.on_frame(frame);
    publisher.publish_result(ipc::kTrajectoryChannel, 1'100'000, trajectory_t{});
    EXPECT_EQ(publisher.log_errors(), 0u);
    log.close();
  }
  lcm_eventlog_t* log = lcm_eventlog_create(path.c_str(), "r");
  ASSERT_NE(log, nullptr);
  std::vector<std::pair<std::string, std::int64_t>> seen;
  while (lcm_eventlog_event_t* event = lcm_eventlog_read_next_event(log)) {
    seen.emplace_back(event->channel, event->timestamp);
    if (seen.back().first == ipc::kOdometryChannel) {
      odometry_t odometry;
      ASSERT_EQ(odometry.decode(event->data, 0, event->datalen), event->datalen);
      EXPECT_EQ(odometry.utime, event->timestamp);
    }
    lcm_eventlog_free_event(event);
  }
  lcm_eventlog_destroy(log);
  const std::vector<std::pair<std::string, std::int64_t>> expected{
      {"FARPOINT_ODOMETRY", 1'000'000},      {"FARPOINT_POSE", 1'000'000},
      {"FARPOINT_MAP_FROM_ODOM", 1'000'000}, {"POSE", 1'000'000},
      {"FARPOINT_ODOMETRY", 1'100'000},      {"FARPOINT_POSE", 1'100'000},
      {"FARPOINT_MAP_FROM_ODOM", 1'100'000}, {"FARPOINT_TRAJECTORY", 1'100'000}};
  EXPECT_EQ(seen, expected);
}

TEST(LcmMessageSink, AUrlThatCannotBeUsedIsSaid) {
  EXPECT_THROW(LcmMessageSink("nosuchprovider://x"), std::runtime_error);
}

// Results of a run are for logs; LCM's file provider stands for the network here.
TEST(LcmMessageSink, NetworkGetsFramesButNoResults) {
  const test::Scratch scratch;
  const std::string path = scratch.path("net.lcm");
  std::mt19937_64 random(7);
  {
    Publisher publisher;
    publisher.add(std::make_unique<LcmMessageSink>("file://" + path + "?mode=w"));
    publisher.on_frame(make_frame_output(result_at(0, &random), 0.0));
    publisher.publish_result(ipc::kTrajectoryChannel, 0, trajectory_t{});
    EXPECT_EQ(publisher.network_errors(), 0u);
  }
  ipc::LogReader reader(path);
  ipc::LogEvent event;
  int events = 0;
  while (reader.next(&event)) {
    EXPECT_NE(event.channel, ipc::kTrajectoryChannel);
    ++events;
  }
  EXPECT_EQ(events, 4);
}

}  // namespace
}  // namespace farpoint::daemon
