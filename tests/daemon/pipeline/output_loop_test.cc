// SPDX-License-Identifier: Apache-2.0
// The output loop over packages made by hand, on the calling thread.
#include "daemon/pipeline/output_loop.h"

#include "ipc/channels.h"
#include "tests/daemon/pipeline/session_fixture.h"

namespace farpoint::daemon {
namespace {

constexpr double kLimit_s = 0.5;

class OutputLoopTest : public SessionFixture {
 protected:
  void push(int number, std::uint64_t job = 0) {
    FramePackage package;
    package.result.utime = 1'000'000 + number * 100'000;
    package.result.sequence = number;
    package.result.state = number % 2 == 0 ? slam::State::kTracking : slam::State::kLost;
    package.result.has_pose = number % 2 == 0;
    package.result.job = job;
    package.counts.maps = static_cast<std::uint64_t>(number);
    package.in.images = 10 + number;
    package.due_s = steady_s() - 0.04;
    package.progress = 0.1 * number;
    ASSERT_TRUE(packages_.push(package));
  }
  // Until all packages are reported: tracking has ended before.
  void run() {
    tracking_.end();
    loop_.run([this] { return tracking_cpu_s_; },
              [this](const FrameOutput& f) { reported_.push_back(f.result.sequence); });
  }

  Options none_;
  Outputs outputs_{none_, config_};
  ImageQueue images_{2, 480, 320};
  PackageRing packages_{8};
  FrameNotes notes_{4};
  CameraPresence presence_;
  Notifier arrived_;
  TrackingLoop tracking_{&session_->estimator(),  &images_, &packages_, &arrived_,
                         FeatureBudget(400, 0.5), kLimit_s};
  MappingLoop mapping_{&session_->estimator(), &tracking_, kLimit_s};
  OutputLoop loop_{{&packages_, &tracking_, &mapping_, &arrived_, &session_->reporter(), &outputs_, &notes_},
                   {&session_->reporter(), &presence_, 0.0},
                   false,
                   kLimit_s};
  double tracking_cpu_s_ = 2.0;
  std::vector<std::int64_t> reported_;
};

TEST_F(OutputLoopTest, ReportsEachPackageOnceAndInOrderAndEndsWithTracking) {
  for (int i = 0; i < 3; ++i) push(i);
  run();
  EXPECT_EQ(reported_, (std::vector<std::int64_t>{0, 1, 2}));
  ASSERT_EQ(sink_.frames.size(), 3U);
  EXPECT_TRUE(sink_.frames[0].valid);
  EXPECT_FALSE(sink_.frames[1].valid);
  EXPECT_EQ(packages_.size(), 0U);
  EXPECT_EQ(loop_.state(), slam::State::kTracking);
  EXPECT_EQ(loop_.input().images, 12);
}

TEST_F(OutputLoopTest, TheAgeCountsFromWhenTheFrameWasDue) {
  push(0);
  run();
  EXPECT_GE(sink_.frames[0].age_us, 40'000);
  EXPECT_LT(sink_.frames[0].age_us, 30'000'000);
}

TEST_F(OutputLoopTest, ANoteHoldsWhatTheEndOfTheRunNeeds) {
  push(2);
  run();
  const FrameNote* note = notes_.front();
  ASSERT_NE(note, nullptr);
  EXPECT_EQ(note->published.sequence, 2);
  EXPECT_TRUE(note->valid);
  EXPECT_EQ(note->counts.maps, 2U);
  EXPECT_EQ(note->progress, 0.2);
  EXPECT_EQ(note->tracking_cpu_ms, 2000.0);
}

TEST_F(OutputLoopTest, NotesWithoutRoomAreCounted) {
  for (int i = 0; i < 6; ++i) push(i);
  run();
  EXPECT_EQ(notes_.missing(), 2);
  EXPECT_EQ(reported_.size(), 6U);
}

// CPU time of the thread that tracks, from frame to frame; its clock ends with it.
TEST_F(OutputLoopTest, TheCpuTimeOfAFrameIsWhatTrackingUsedSinceTheOneBefore) {
  push(0);
  push(1);
  push(2);
  tracking_.end();
  std::vector<double> clock{3.0, 3.5, 0.0};
  std::size_t next = 0;
  loop_.run([&] { return clock[next++]; }, {});
  std::vector<double> cpu_ms;
  for (; notes_.front() != nullptr; notes_.pop()) cpu_ms.push_back(notes_.front()->tracking_cpu_ms);
  EXPECT_EQ(cpu_ms, (std::vector<double>{3000.0, 500.0, 0.0}));
  const auto timing = kept_.of<timing_t>(ipc::kTimingChannel);
  ASSERT_EQ(timing.size(), 3U);
  EXPECT_EQ(timing[1].cpu_ms[timing_t::STAGE_TRACKING], 500.0);
}

TEST_F(OutputLoopTest, AHeldReportIsNoProgress) {
  push(0);
  push(1);
  tracking_.end();
  std::vector<bool> alive;
  double now_s = 100.0;
  loop_.run([] { return 0.0; },
            [&](const FrameOutput&) {
              alive.push_back(loop_.is_alive(now_s));
              alive.push_back(loop_.is_alive(now_s + 1.0));
              now_s += 1.0;
            });
  EXPECT_EQ(alive, (std::vector<bool>{true, false, true, false}));
}

}  // namespace
}  // namespace farpoint::daemon
