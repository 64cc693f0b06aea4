// SPDX-License-Identifier: Apache-2.0
#include "daemon/pipeline/tracking_loop.h"

#include "tests/daemon/pipeline/session_fixture.h"

namespace farpoint::daemon {
namespace {

constexpr double kLimit_s = 0.5;

class TrackingLoopTest : public SessionFixture {
 protected:
  void queue(int number) {
    CapturedImage* image = images_.begin_push();
    image->image = grey(number);
    image->meta.utime = 1'000'000 + number * 100'000;
    image->meta.sequence = number;
    image->in.images = number + 1;
    image->due_s = 50.0 + number;
    image->decode_cpu_ms = 1.5;
    image->progress = 0.25;
    images_.push();
  }

  ImageQueue images_{3, 480, 320};
  PackageRing packages_{2};
  Notifier arrived_;
  TrackingLoop loop_{&session_->estimator(),  &images_, &packages_, &arrived_,
                     FeatureBudget(400, 0.5), kLimit_s};
};

TEST_F(TrackingLoopTest, APackageHoldsWhatTheOutputNeedsOfTheFrame) {
  EXPECT_FALSE(loop_.turn({}));
  queue(0);
  queue(1);
  ASSERT_TRUE(loop_.turn({}));
  const FramePackage* package = packages_.front();
  ASSERT_NE(package, nullptr);
  EXPECT_EQ(package->result.sequence, 0);
  EXPECT_EQ(package->result.utime, 1'000'000);
  EXPECT_GT(package->result.features, 50);
  EXPECT_EQ(package->counts.frames, 1U);
  EXPECT_EQ(package->in.images, 1);
  EXPECT_EQ(package->due_s, 50.0);
  EXPECT_EQ(package->progress, 0.25);
  EXPECT_EQ(package->clock.cpu_ms(timing_t::STAGE_DECODE), 1.5);
  EXPECT_GT(package->clock.wall_ms(timing_t::STAGE_TRACKING), 0.0);
  EXPECT_EQ(package->chance.capture_queue, 1);
  EXPECT_EQ(package->chance.features_asked, 400);
  EXPECT_EQ(loop_.tracked(), 1);
}

TEST_F(TrackingLoopTest, AFrameWithoutRoomInTheRingIsTrackedAndCounted) {
  std::vector<std::int64_t> tracked;
  for (int i = 0; i < 3; ++i) {
    queue(i);
    ASSERT_TRUE(loop_.turn([&](const slam::FrameResult& r) { tracked.push_back(r.sequence); }));
  }
  EXPECT_EQ(tracked, (std::vector<std::int64_t>{0, 1, 2}));
  EXPECT_EQ(loop_.tracked(), 3);
  EXPECT_EQ(loop_.not_published(), 1);
  EXPECT_EQ(packages_.size(), 2U);
}

TEST_F(TrackingLoopTest, ItHasWorkWhileAnImageWaitsAndNoneOnceTheOthersWereDropped) {
  EXPECT_FALSE(loop_.has_work());
  for (int i = 0; i < 5; ++i) queue(i);  // three wait, two were dropped
  EXPECT_TRUE(loop_.has_work());
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(loop_.has_work());
    ASSERT_TRUE(loop_.turn({}));
  }
  EXPECT_FALSE(loop_.has_work());
}

TEST_F(TrackingLoopTest, DroppedImagesAreOfTheFrameThatFollowsAndLowerTheBudget) {
  for (int i = 0; i < 20; ++i) {
    for (int each = 0; each < 4; ++each) queue(4 * i + each);
    while (loop_.turn({})) packages_.pop();
  }
  queue(1000);
  ASSERT_TRUE(loop_.turn({}));
  EXPECT_EQ(packages_.front()->chance.frames_dropped, 20);
  EXPECT_LT(packages_.front()->chance.features_asked, 400);
}

TEST_F(TrackingLoopTest, IdleItIsAliveAndWithAnImageOnlyWhileItTurns) {
  EXPECT_TRUE(loop_.is_alive(100.0));
  EXPECT_TRUE(loop_.is_alive(200.0));
  queue(0);
  EXPECT_TRUE(loop_.is_alive(200.1));
  EXPECT_FALSE(loop_.is_alive(201.0));
  ASSERT_TRUE(loop_.turn({}));
  EXPECT_TRUE(loop_.is_alive(202.0));
}

TEST_F(TrackingLoopTest, RunTracksWhatWaitsAndEndsWithTheQueue) {
  queue(0);
  queue(1);
  images_.close();
  const std::uint32_t seen = arrived_.seen();
  loop_.run({});
  EXPECT_TRUE(loop_.has_ended());
  EXPECT_EQ(loop_.tracked(), 2);
  EXPECT_NE(arrived_.seen(), seen) << "the output is woken at the end";
}

}  // namespace
}  // namespace farpoint::daemon
