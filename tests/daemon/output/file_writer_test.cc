// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/file_writer.h"

#include <gtest/gtest.h>

#include <future>
#include <string>

#include "daemon/output/message_sink.h"
#include "daemon/output/trajectory_file.h"
#include "ipc/channels.h"
#include "tests/ipc/log_events.h"
#include "tests/ipc/scratch.h"

namespace farpoint::daemon {
namespace {

std::span<const std::uint8_t> bytes(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

class FileWriterTest : public ::testing::Test {
 protected:
  // A file whose disk does not answer until may_write_ is set.
  std::uint32_t add_held_file(FileWriter* files) {
    return files->add_file([this, opened = may_write_.get_future().share()](std::span<const std::uint8_t> r) {
      is_held_ = true;
      opened.wait();
      written_.emplace_back(r.begin(), r.end());
    });
  }

  std::promise<void> may_write_;
  std::atomic<bool> is_held_{false};
  std::vector<std::string> written_;
};

// Were the pushing thread held, the test would not end.
TEST_F(FileWriterTest, ADiskThatDoesNotAnswerHoldsNoPushAndWhatFindsNoRoomIsCounted) {
  FileWriter files(4096);
  const std::uint32_t file = add_held_file(&files);
  files.start(RealtimeConfig{}, nullptr);
  const std::string record(100, 'x');
  int taken = 0;
  for (int i = 0; i < 1000; ++i) taken += files.push(file, {bytes(record)}) ? 1 : 0;
  EXPECT_GE(taken, 20);
  EXPECT_LE(taken, 60);
  EXPECT_EQ(files.dropped(), static_cast<std::uint64_t>(1000 - taken));
  may_write_.set_value();
  files.stop();
  EXPECT_EQ(written_.size(), static_cast<std::size_t>(taken)) << "what was taken is written at the end";
}

TEST_F(FileWriterTest, WithoutItsThreadARecordOfAnyLengthIsWrittenAtOnce) {
  FileWriter files(64);
  may_write_.set_value();
  const std::uint32_t file = add_held_file(&files);
  EXPECT_TRUE(files.push(file, {bytes("before")}));
  files.start(RealtimeConfig{}, nullptr);
  files.stop();
  EXPECT_TRUE(files.push(file, {bytes(std::string(10'000, 'x')), bytes("after")}));
  ASSERT_EQ(written_.size(), 2U);
  EXPECT_EQ(written_[0], "before");
  EXPECT_EQ(written_[1], std::string(10'000, 'x') + "after");
  EXPECT_EQ(files.dropped(), 0U);
}

TEST_F(FileWriterTest, TheLastTurnFollowsTheStop) {
  FileWriter files(64);
  std::atomic<bool> stopping{false};
  std::atomic<int> turns_after_stop{0};
  files.add_turn([&] { turns_after_stop += stopping ? 1 : 0; });
  files.start(RealtimeConfig{}, nullptr);
  stopping = true;
  files.stop();
  EXPECT_GE(turns_after_stop, 1);
}

TEST_F(FileWriterTest, AQueuedLogHoldsWhatTheDirectOneHolds) {
  const test::Scratch scratch;
  FileWriter files(1 << 16);
  LateOpened<ipc::LogWriter> log;
  QueuedLogSink queued(&files, &log);
  log.set(std::make_unique<ipc::LogWriter>(scratch.path("queued.lcm")));
  ipc::LogWriter direct_log(scratch.path("direct.lcm"));
  LogMessageSink direct(&direct_log);
  files.start(RealtimeConfig{}, nullptr);
  for (MessageSink* sink : {static_cast<MessageSink*>(&queued), static_cast<MessageSink*>(&direct)}) {
    sink->send(ipc::kOdometryChannel, 1'234'567, bytes("first"));
    sink->send(ipc::kStatusChannel, 1'300'000, bytes(std::string(1000, 's')));
    sink->send(ipc::kPoseChannel, 1'400'000, {});
  }
  files.stop();
  queued.send(ipc::kSummaryChannel, 1'500'000, bytes(std::string(100'000, 'r')));
  direct.send(ipc::kSummaryChannel, 1'500'000, bytes(std::string(100'000, 'r')));
  log.get()->close();
  direct_log.close();
  EXPECT_EQ(queued.errors(), 0U);
  EXPECT_EQ(test::read_bytes(scratch.path("queued.lcm")), test::read_bytes(scratch.path("direct.lcm")));
  EXPECT_EQ(test::events_of(scratch.path("queued.lcm")).size(), 4U);
}

TEST_F(FileWriterTest, MessagesBeforeTheLogIsOpenAreCounted) {
  const test::Scratch scratch;
  FileWriter files(1 << 16);
  LateOpened<ipc::LogWriter> log;
  QueuedLogSink queued(&files, &log);
  queued.send(ipc::kOdometryChannel, 1, bytes("lost"));
  log.set(std::make_unique<ipc::LogWriter>(scratch.path("out.lcm")));
  queued.send(ipc::kOdometryChannel, 2, bytes("kept"));
  log.get()->close();
  EXPECT_EQ(queued.errors(), 1U);
  EXPECT_EQ(test::events_of(scratch.path("out.lcm")).size(), 1U);
}

TEST_F(FileWriterTest, AQueuedTrajectoryHoldsWhatTheDirectOneHolds) {
  const test::Scratch scratch;
  FileWriter files(1 << 16);
  LiveTrajectory queued(&files), direct(scratch.path("direct.tum"));
  EXPECT_FALSE(queued.is_open());
  queued.open(scratch.path("queued.tum"));
  files.start(RealtimeConfig{}, nullptr);
  FrameOutput frame;
  for (int i = 0; i < 10; ++i) {
    frame.valid = i % 3 != 0;
    frame.result.utime = 1'000'000 + i;
    frame.result.T_map_body.t.x() = 0.1 * i;
    queued.on_frame(frame);
    direct.on_frame(frame);
  }
  files.stop();
  queued.close();
  direct.close();
  const auto written = test::read_bytes(scratch.path("queued.tum"));
  EXPECT_EQ(written, test::read_bytes(scratch.path("direct.tum")));
  EXPECT_EQ(std::count(written.begin(), written.end(), '\n'), 1 + 6);
}

}  // namespace
}  // namespace farpoint::daemon
