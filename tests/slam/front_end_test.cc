// SPDX-License-Identifier: Apache-2.0
#include "slam/front_end.h"

#include <gtest/gtest.h>

#include <iterator>
#include <map>

#include "slam/back_end.h"
#include "tests/ipc/allocations.h"
#include "tests/slam/simulated_drive.h"

namespace farpoint::slam {
namespace {

class FrontEndTest : public ::testing::Test {
 protected:
  // One frame in lockstep.
  const FrameResult& run(FeatureInput&& input) {
    front_end_.track(std::move(input), TakeLimit{});
    work();
    return front_end_.take_replies_at_once();
  }
  // Mapping works on all jobs.
  void work() {
    while (back_end_.step()) {
      if (back_end_.reply().view) newest_view_ = back_end_.reply().view->sequence;
      back_end_.hand_over();
    }
  }
  // Until the map has settled and tracking is valid; false where that does not happen.
  [[nodiscard]] bool run_until_tracking() {
    for (int i = 0; i < 120; ++i)
      if (run(drive_.next()).state == State::kTracking) return true;
    return false;
  }

  SimulatedDrive drive_;
  // Frames are 0.1 s apart: the quick view is due with the next frame, the full one with the second.
  static EstimatorConfig delayed(EstimatorConfig config) {
    config.mapping.full_view_delay_ms = 150;
    return config;
  }
  const EstimatorConfig config_ = delayed(drive_.config());
  MappingRings rings_{config_};
  FrontEnd front_end_{config_, drive_.rig(), &rings_};
  BackEnd back_end_{config_, drive_.rig(), &rings_};
  std::uint64_t newest_view_ = 0;
};

TEST_F(FrontEndTest, AFirstMapSettlesAndIsTracked) {
  const FrameResult* result = &run(drive_.next());
  EXPECT_EQ(result->state, State::kInitialising);
  EXPECT_FALSE(result->has_pose);
  while (result->state == State::kInitialising) result = &run(drive_.next());
  EXPECT_EQ(result->state, State::kSettling);
  EXPECT_TRUE(result->has_pose);
  EXPECT_EQ(result->map_id, 1);
  EXPECT_EQ(result->reset_counter, 1U);
  ASSERT_TRUE(run_until_tracking());
  EXPECT_GT(front_end_.counts().mapping.keyframes_made, 2U);
  EXPECT_EQ(front_end_.counts().maps, 1U);
}

// The delays are those of the configuration.
TEST_F(FrontEndTest, AFrameIsTrackedAgainstTheNewestViewThatIsDue) {
  ASSERT_TRUE(run_until_tracking());
  for (int keyframes = 0; keyframes < 3; ++keyframes) {
    int frames = 0;
    while (!run(drive_.next()).keyframe) ASSERT_LT(++frames, 50);
    const std::uint64_t full = newest_view_, quick = full - 1;
    EXPECT_EQ(run(drive_.next()).view_sequence, quick);
    EXPECT_EQ(run(drive_.next()).view_sequence, full);
  }
}

TEST_F(FrontEndTest, TheCountsOfMappingAreThoseOfTheNewestReply) {
  ASSERT_TRUE(run_until_tracking());
  front_end_.finish();
  work();
  front_end_.take_counts();
  const MappingCounts &told = front_end_.counts().mapping, &made = back_end_.mapper().counts();
  EXPECT_EQ(told.keyframes_made, made.keyframes_made);
  EXPECT_EQ(told.landmarks_made, made.landmarks_made);
  EXPECT_EQ(told.vmp_made, made.vmp_made);
  EXPECT_EQ(told.local_ba, made.local_ba);
  EXPECT_GT(told.local_ba, 0U);
  EXPECT_EQ(front_end_.counts().keyframes, back_end_.mapper().map().keyframes().size());
  EXPECT_EQ(front_end_.counts().landmarks, back_end_.mapper().map().landmarks().size());
}

TEST_F(FrontEndTest, SendsNoKeyframeWhileMappingIsBusy) {
  ASSERT_TRUE(run_until_tracking());
  for (int i = 0; i < 5; ++i) run(drive_.next());
  const std::uint64_t dropped = front_end_.counts().keyframes_dropped;
  int keyframes = 0;
  for (int i = 0; i < 25; ++i)
    keyframes += front_end_.track(drive_.next(), {.replies_by_delay = false}).keyframe ? 1 : 0;
  EXPECT_EQ(keyframes, 1);
  EXPECT_LE(rings_.jobs.size(), 2U);  // and the one that poses frames from before the map
  EXPECT_GT(front_end_.counts().keyframes_dropped, dropped);
}

TEST_F(FrontEndTest, APlaceFoundAgainIsPublishedOnceTheNextFrameConfirmsIt) {
  ASSERT_TRUE(run_until_tracking());
  for (int i = 0; i < 20; ++i) run(drive_.next());
  for (int i = 0; i < 8; ++i) EXPECT_EQ(run(drive_.next_blind()).state, State::kLost);
  const FrameResult first = run(drive_.next());
  EXPECT_EQ(first.state, State::kRelocalising);
  EXPECT_FALSE(first.has_pose);
  EXPECT_GT(first.inliers, 30);
  const FrameResult second = run(drive_.next());
  EXPECT_TRUE(is_valid(second.state));
  EXPECT_TRUE(second.has_pose);
  EXPECT_EQ(second.map_id, 1);
  EXPECT_EQ(second.reset_counter, 1U);
  EXPECT_EQ(front_end_.counts().lost, 1U);
}

TEST_F(FrontEndTest, AMotionOverLostFramesIsCarriedOnceTheMapTellsIt) {
  ASSERT_TRUE(run_until_tracking());
  SE3 T_odom_body, T_map_body;
  for (int i = 0; i < 20; ++i) {
    const FrameResult& result = run(drive_.next());
    T_odom_body = result.T_odom_body, T_map_body = result.T_map_body;
  }
  for (int i = 0; i < 8; ++i) run(drive_.next_blind());
  run(drive_.next());
  const FrameResult& back = run(drive_.next());
  ASSERT_TRUE(back.has_pose);
  const SE3 by_map = T_map_body.inverse() * back.T_map_body;
  const SE3 by_odom = T_odom_body.inverse() * back.T_odom_body;
  EXPECT_GT(by_map.t.norm(), 0.05);
  EXPECT_LT((by_odom.t - by_map.t).norm(), 0.02 * by_map.t.norm());
  EXPECT_EQ(back.reset_counter, 1U);
}

// --- another unit

class FrontEndOfARescaledMap : public FrontEndTest {
 protected:
  const Sim3 S_{2.0, so3_exp({0.0, 0.1, 0.9}), {3, -2, 1}};

  // Tracks until a keyframe is under way to mapping, and rescales the map before it arrives.
  void rescale_at_a_keyframe() {
    ASSERT_TRUE(run_until_tracking());
    while (!front_end_.track(drive_.next(), TakeLimit{}).keyframe) finish_frame();
    back_end_.transform_map(1, S_);
    before_ = finish_frame();
  }
  const FrameResult& finish_frame() {
    work();
    return front_end_.take_replies_at_once();
  }

  FrameResult before_;  // the last frame in the old unit
};

TEST_F(FrontEndOfARescaledMap, OdomKeepsItsUnitAndMapFromOdomTakesTheNewOne) {
  rescale_at_a_keyframe();
  ASSERT_EQ(before_.map_from_odom.scale, 1.0);
  FrameResult last = before_;
  int rescaled = 0;
  for (int i = 0; i < 40; ++i) {
    const FrameResult now = run(drive_.next());
    ASSERT_TRUE(is_valid(now.state)) << i;
    const double speed = last.velocity_body.head<3>().norm();
    const double step = (last.T_odom_body.inverse() * now.T_odom_body).t.norm();
    EXPECT_NEAR(step / (1e-6 * static_cast<double>(now.utime - last.utime) * speed), 1.0, 0.1) << i;
    EXPECT_LT((now.velocity_body - last.velocity_body).norm(), 0.1 * speed) << i;
    EXPECT_LT((now.map_from_odom * now.T_odom_body).boxminus_to(now.T_map_body).norm(), 1e-9) << i;
    rescaled += now.map_from_odom.scale == 2.0 ? 1 : 0;
    last = now;
  }
  EXPECT_GE(rescaled, 30);
  EXPECT_EQ(last.reset_counter, 1U);
  EXPECT_EQ(front_end_.counts().lost, 0U);
  // The frames in the old unit lie where the whole map went.
  EXPECT_LT((last.map_from_odom * SE3{}).boxminus_to(S_ * (before_.map_from_odom * SE3{})).norm(), 0.1);
}

// Poses relative to keyframes: those recorded before, those under way, and the keyframe itself.
TEST_F(FrontEndOfARescaledMap, RecordedFramesAndKeyframesUnderWayFollow) {
  rescale_at_a_keyframe();
  for (int i = 0; i < 40; ++i) run(drive_.next());
  back_end_.collect_recorded();
  const Map& map = back_end_.mapper().map();
  std::map<std::int64_t, Eigen::Vector3d> ways;  // by time
  for (const KeptFrame& frame : back_end_.recorded()) {
    Sim3 S_world_reference;
    ASSERT_TRUE(map.similarity_of(frame.reference_id, &S_world_reference));
    ways[frame.utime] = (S_world_reference * frame.T_reference_body()).t;
  }
  ASSERT_GT(ways.size(), 40U);
  EXPECT_LT(ways.begin()->first, before_.utime);
  // An even drive: no step is twice the one before it, or half of it.
  double last_step = 0.0;
  for (auto at = std::next(ways.begin()); at != ways.end(); ++at) {
    const double step = (at->second - std::prev(at)->second).norm();
    if (last_step > 0.0) {
      EXPECT_NEAR(step / last_step, 1.0, 0.3) << at->first;
    }
    last_step = step;
  }
}

TEST_F(FrontEndTest, ALostSequenceBeginsANewMapAndRaisesTheResetCounter) {
  ASSERT_TRUE(run_until_tracking());
  for (int i = 0; i < 30; ++i) run(drive_.next());
  int lost = 0;
  while (run(drive_.next_unknown()).state != State::kInitialising) ASSERT_LT(++lost, 40);
  EXPECT_GE(lost, 15);
  EXPECT_EQ(front_end_.counts().maps, 1U);
  const FrameResult* result = &run(drive_.next());
  for (int i = 0; i < 60 && result->state == State::kInitialising; ++i) result = &run(drive_.next());
  EXPECT_EQ(result->map_id, 2);
  EXPECT_EQ(result->reset_counter, 2U);
  EXPECT_EQ(front_end_.counts().maps, 2U);
}

class FrontEndHeap : public FrontEndTest {
 protected:
  // One frame in lockstep. Counts tracking's heap calls, and not those of mapping or of the drive.
  FrameResult counted(FeatureInput&& input) {
    const std::uint64_t before_tracking = test::allocations();
    front_end_.track(std::move(input), TakeLimit{});
    heap_calls_ += test::allocations() - before_tracking;
    work();
    const std::uint64_t before_replies = test::allocations();
    const FrameResult& result = front_end_.take_replies_at_once();
    heap_calls_ += test::allocations() - before_replies;
    return result;
  }
  void track_until(State state) {
    for (int i = 0; i < 200; ++i)
      if (counted(drive_.next()).state == state) return;
    FAIL() << "not " << to_string(state);
  }
  void lose_and_find_again() {
    for (int i = 0; i < 8; ++i) counted(drive_.next_blind());
    track_until(State::kTracking);
    for (int i = 0; i < 10; ++i) counted(drive_.next());
  }
  void lose_the_map() {
    for (int i = 0; i < 60; ++i)
      if (counted(drive_.next_unknown()).state == State::kInitialising) return;
    FAIL() << "the map was not given up";
  }

  std::uint64_t heap_calls_ = 0;
};

TEST_F(FrontEndHeap, NoCallFromTheFirstFrameOnOverFiveLossesAndTwoNewMaps) {
  if (!test::counts_allocations()) GTEST_SKIP() << "a sanitizer owns the heap";
  track_until(State::kTracking);
  for (int i = 0; i < 20; ++i) counted(drive_.next());
  for (int i = 0; i < 3; ++i) lose_and_find_again();
  for (int i = 0; i < 2; ++i) {
    lose_the_map();
    track_until(State::kTracking);
    for (int k = 0; k < 20; ++k) counted(drive_.next());
  }
  EXPECT_EQ(heap_calls_, 0U);
  EXPECT_GT(test::allocations(), 0U);  // the count works
  EXPECT_EQ(front_end_.counts().lost, 5U);
  EXPECT_EQ(front_end_.counts().maps, 3U);
}

// Mapping is behind: it answers a keyframe of the old map after that was given up.
TEST_F(FrontEndTest, TakesNoViewOfAMapThatItGaveUp) {
  ASSERT_TRUE(run_until_tracking());
  for (int i = 0; i < 30; ++i) run(drive_.next());
  // A keyframe on its way, then only unknown frames.
  const TakeLimit at_once{.replies_by_delay = false};
  for (int i = 0; i < 20 && !front_end_.track(drive_.next(), at_once).keyframe; ++i) continue;
  ASSERT_GE(rings_.jobs.size(), 1U);
  TakeLimit none{.replies_by_delay = false, .up_to = {0, 0, 0}};
  int lost = 0;
  while (front_end_.track(drive_.next_unknown(), none).state != State::kInitialising) ASSERT_LT(++lost, 40);
  const std::uint64_t before = front_end_.track(drive_.next_unknown(), none).taken.replies;
  std::vector<std::shared_ptr<const LocalView>> views;
  while (back_end_.step()) {
    if (back_end_.reply().view) views.push_back(back_end_.reply().view);
    back_end_.hand_over();
  }
  ASSERT_EQ(views.size(), 2U) << "quick and full view of the keyframe";
  const FrameResult& after = front_end_.track(drive_.next_unknown(), at_once);
  for (const auto& view : views)
    EXPECT_EQ(view.use_count(), 2) << "in use by tracking, beside the pool and here";
  EXPECT_GT(after.taken.replies, before) << "replies are taken all the same";
  EXPECT_EQ(after.state, State::kInitialising);
  EXPECT_FALSE(after.has_pose);
  EXPECT_EQ(after.view_sequence, 0U);
  EXPECT_EQ(after.jobs_under_way, 0);
}

TEST_F(FrontEndTest, EachFrameTakesTheSamplesUpToItsTime) {
  FeatureInput first = drive_.next(), second = drive_.next();
  const auto sample = [](std::int64_t utime) {
    ImuSample s;
    s.utime = utime;
    return s;
  };
  EXPECT_TRUE(front_end_.add(sample(first.utime)));
  EXPECT_TRUE(front_end_.add(sample(first.utime + 1)));
  EXPECT_TRUE(front_end_.add(sample(second.utime + 1)));
  WheelSample wheels;
  wheels.utime = second.utime;
  wheels.speed_m_per_s = 12.5;
  EXPECT_TRUE(front_end_.add(wheels));
  EXPECT_EQ(run(std::move(first)).taken.imu, 1U);
  EXPECT_EQ(front_end_.counts().wheels.used, 0U);
  const FrameResult& result = run(std::move(second));
  EXPECT_EQ(result.taken.imu, 2U);
  EXPECT_EQ(result.taken.wheels, 1U);
  EXPECT_EQ(front_end_.counts().imu.used, 2U);
  ASSERT_EQ(front_end_.wheels().size(), 1U);
  EXPECT_EQ(front_end_.wheels()[0].speed_m_per_s, 12.5);
}

TEST_F(FrontEndTest, RejectsATimeNotAfterTheLastAndAnotherCamera) {
  FeatureInput frame = drive_.next();
  const std::int64_t utime = frame.utime;
  run(std::move(frame));
  FeatureInput again = drive_.next();
  again.utime = utime;
  EXPECT_FALSE(run(std::move(again)).has_pose);
  FeatureInput other = drive_.next();
  other.camera = 1;
  run(std::move(other));
  EXPECT_EQ(front_end_.counts().frames, 1U);
  EXPECT_EQ(front_end_.counts().frames_rejected, 2U);
}

}  // namespace
}  // namespace farpoint::slam
