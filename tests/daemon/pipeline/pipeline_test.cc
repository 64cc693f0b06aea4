// SPDX-License-Identifier: Apache-2.0
// The threads of the vehicle over a source of images made by hand.
#include "daemon/pipeline/pipeline.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <future>
#include <stdexcept>
#include <thread>

#include "daemon/system/stop_signal.h"
#include "ipc/channels.h"
#include "tests/daemon/pipeline/hand_made_source.h"
#include "tests/daemon/pipeline/session_fixture.h"

namespace farpoint::daemon {
namespace {

class PipelineTest : public SessionFixture {
 protected:
  // To the source's end. What the hooks saw is in captured_, tracked_ and output_.
  void run(HandMadeSource* source) {
    Options none;
    Outputs outputs(none, config_);
    Pipeline pipeline(config_, options(), parts(source, &outputs));
    ThreadHooks hooks;
    hooks.on_captured = [this] { ++captured_; };
    hooks.on_tracked = [this](const slam::FrameResult& r) { tracked_.push_back(r.sequence); };
    hooks.on_output = [this](const FrameOutput& f) { output_.push_back(f.result.sequence); };
    pipeline.run(hooks);
    dropped_ = pipeline.frames_dropped();
    EXPECT_EQ(pipeline.frames_tracked(), static_cast<std::int64_t>(tracked_.size()));
  }
  [[nodiscard]] static PipelineOptions options() {
    PipelineOptions options;
    const ipc::GreyImage image = grey(0);
    options.width_px = image.width_px, options.height_px = image.height_px;
    return options;
  }
  [[nodiscard]] PipelineParts parts(CaptureSource* source, Outputs* outputs) {
    return {source, &session_->estimator(), &session_->reporter(), outputs, &session_->tally(), &realtime_};
  }
  using Sequences = std::vector<std::int64_t>;

  RealtimeReport realtime_{config_.realtime};
  int captured_ = 0;
  Sequences tracked_, output_;
  std::int64_t dropped_ = 0;
};

TEST_F(PipelineTest, EveryTrackedFrameIsHandedToTheOutputOnceAndInOrder) {
  HandMadeSource source(25, std::chrono::milliseconds(20));
  run(&source);
  EXPECT_EQ(captured_, 25);
  EXPECT_EQ(output_, tracked_);
  EXPECT_TRUE(std::is_sorted(tracked_.begin(), tracked_.end(), std::less_equal<>{}) || tracked_.size() < 2);
  ASSERT_EQ(sink_.frames.size(), tracked_.size());
  for (std::size_t i = 0; i < tracked_.size(); ++i) EXPECT_EQ(sink_.frames[i].result.sequence, tracked_[i]);
  EXPECT_EQ(session_->end().frames, static_cast<std::int64_t>(tracked_.size()));
}

TEST_F(PipelineTest, AnImageIsTrackedOrCountedAsDropped) {
  HandMadeSource source(60, std::chrono::microseconds(0));
  run(&source);
  EXPECT_EQ(static_cast<std::int64_t>(tracked_.size()) + dropped_, 60);
  EXPECT_GT(dropped_, 0) << "a source without a pace outruns tracking";
  EXPECT_EQ(tracked_.back(), 59) << "the newest wins";
  const auto schedule = kept_.of<schedule_t>(ipc::kScheduleChannel);
  ASSERT_EQ(schedule.size(), tracked_.size());
  EXPECT_EQ(schedule.back().frames_dropped, dropped_);
}

TEST_F(PipelineTest, MappingWorksOnTheJobsOfTheFrames) {
  HandMadeSource source(25, std::chrono::milliseconds(60));
  run(&source);
  session_->finish({});
  EXPECT_EQ(session_->end().counts.maps, 1U);
  EXPECT_GE(kept_.of<schedule_t>(ipc::kScheduleChannel).back().replies_taken, 3);
}

TEST_F(PipelineTest, TheTimesOfMappingsStagesArePublishedWithTheFrames) {
  HandMadeSource source(25, std::chrono::milliseconds(60));
  run(&source);
  int mapped = 0;
  for (const timing_t& t : kept_.of<timing_t>(ipc::kTimingChannel)) {
    EXPECT_LT(t.cpu_ms[timing_t::STAGE_EXTRACTION], 0.0) << "of tracking only the whole is measured";
    if (t.cpu_ms[timing_t::STAGE_LOCAL_BA] < 0.0) continue;
    ++mapped;
    EXPECT_GT(t.cpu_ms[timing_t::STAGE_MAPPING], t.cpu_ms[timing_t::STAGE_LOCAL_BA]);
  }
  EXPECT_GE(mapped, 1);
}

TEST_F(PipelineTest, WhatReadingThrowsIsThrownByRunAfterTheFramesBefore) {
  HandMadeSource source(4, std::chrono::milliseconds(20));
  source.throw_at_end();
  EXPECT_THROW(run(&source), std::runtime_error);
  EXPECT_EQ(captured_, 4);
  EXPECT_EQ(output_.size(), tracked_.size());
  EXPECT_FALSE(output_.empty());
}

// --- progress

// Holds the first call of one hook until it is released.
class Hold {
 public:
  void at_hook() {
    if (has_held_.exchange(true)) return;
    is_held_ = true;
    released_.get_future().wait();
  }
  void release() {
    is_held_ = false;
    released_.set_value();
  }
  [[nodiscard]] bool is_held() const { return is_held_; }

 private:
  std::promise<void> released_;
  std::atomic<bool> has_held_{false}, is_held_{false};
};

// Never has an image.
class EmptySource final : public CaptureSource {
 public:
  CaptureStatus next(const std::atomic<bool>& /*stop*/, CapturedImage* /*image*/) override {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return CaptureStatus::kAway;
  }
};

class HeldPipelineTest : public PipelineTest {
 protected:
  // A turn of the calling thread takes at least this long: on a loaded machine the limits count slower.
  static constexpr double kTurn_s = 0.02;

  [[nodiscard]] static PipelineOptions live_options() {
    PipelineOptions live = options();
    live.no_camera_after_s = 1000.0;
    return live;
  }
  // Holds one thread from its first frame on, until the watch finds one hung, and returns which.
  const char* hung_while_held(const std::function<void(ThreadHooks*, Hold*)>& hold_at) {
    HandMadeSource source(100'000, std::chrono::milliseconds(20));
    Options none;
    Outputs outputs(none, config_);
    Pipeline pipeline(config_, live_options(), parts(&source, &outputs));
    Hold hold;
    ThreadHooks hooks;
    hold_at(&hooks, &hold);
    const char* hung = nullptr;
    double now_s = 100.0;
    hooks.on_watch = [&] {
      const char* found = pipeline.hung_thread(now_s);
      if (!hold.is_held()) {
        EXPECT_TRUE(found == nullptr || hung != nullptr) << found << " before one was held";
        return;
      }
      now_s += kTurn_s;
      if (found == nullptr && now_s < 110.0) return;
      hung = found;
      held_s_ = now_s - 100.0;
      hold.release();
      StopOnSignal::ask();
    };
    const StopOnSignal stop;
    pipeline.run(hooks);
    return hung;
  }
  double held_s_ = 0;
};

TEST_F(HeldPipelineTest, WithoutImagesAllThreadsCountAsAlive) {
  EmptySource source;
  Options none;
  Outputs outputs(none, config_);
  Pipeline pipeline(config_, live_options(), parts(&source, &outputs));
  ThreadHooks hooks;
  double now_s = 100.0;
  hooks.on_watch = [&] {
    EXPECT_EQ(pipeline.hung_thread(now_s), nullptr);
    now_s += kTurn_s;
    if (now_s > 103.0) StopOnSignal::ask();
  };
  const StopOnSignal stop;
  pipeline.run(hooks);
}

TEST_F(HeldPipelineTest, AHeldCaptureThreadIsFound) {
  const char* hung = hung_while_held(
      [](ThreadHooks* hooks, Hold* hold) { hooks->on_captured = [hold] { hold->at_hook(); }; });
  EXPECT_STREQ(hung, Pipeline::kCaptureThread);
  EXPECT_NEAR(held_s_, config_.watchdog.capture_s, 0.1);
}

TEST_F(HeldPipelineTest, AHeldTrackingThreadIsFound) {
  const char* hung = hung_while_held([](ThreadHooks* hooks, Hold* hold) {
    hooks->on_tracked = [hold](const slam::FrameResult&) { hold->at_hook(); };
  });
  EXPECT_STREQ(hung, Pipeline::kTrackingThread);
  EXPECT_NEAR(held_s_, config_.watchdog.tracking_s, 0.1);
}

TEST_F(HeldPipelineTest, AHeldMappingThreadIsFound) {
  const char* hung =
      hung_while_held([](ThreadHooks* hooks, Hold* hold) { hooks->on_mapped = [hold] { hold->at_hook(); }; });
  EXPECT_STREQ(hung, Pipeline::kMappingThread);
  EXPECT_NEAR(held_s_, config_.watchdog.mapping_s, 0.1);
}

TEST_F(HeldPipelineTest, AHeldOutputThreadIsFound) {
  const char* hung = hung_while_held([](ThreadHooks* hooks, Hold* hold) {
    hooks->on_output = [hold](const FrameOutput&) { hold->at_hook(); };
  });
  EXPECT_STREQ(hung, Pipeline::kOutputThread);
  EXPECT_NEAR(held_s_, config_.watchdog.output_s, 0.1);
}

// --- a start that is refused

// The process would hang: it is given a minute, then killed.
TEST_F(PipelineTest, ARequiredCoreThatIsRefusedEndsTheStartWhicheverThreadItIsFor) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  for (ThreadConfig RealtimeConfig::*thread : {&RealtimeConfig::capture, &RealtimeConfig::tracking,
                                               &RealtimeConfig::mapping, &RealtimeConfig::output}) {
    EXPECT_EXIT(
        {
          alarm(60);
          config_.realtime.require = true;
          (config_.realtime.*thread).core = 1000;
          RealtimeReport strict(config_.realtime);
          HandMadeSource source(100'000, std::chrono::milliseconds(1));
          Options none;
          Outputs outputs(none, config_);
          PipelineParts all = parts(&source, &outputs);
          all.realtime = &strict;
          Pipeline pipeline(config_, options(), all);
          try {
            pipeline.run({});
          } catch (const std::runtime_error& error) {
            std::fprintf(stderr, "%s\n", error.what());
            std::exit(1);
          }
          std::exit(0);
        },
        testing::ExitedWithCode(1), "is not on core 1000.*realtime.require is set");
  }
}

TEST_F(PipelineTest, WhatAHookOfTheCallingThreadThrowsEndsTheRun) {
  HandMadeSource source(100'000, std::chrono::milliseconds(1));
  Options none;
  Outputs outputs(none, config_);
  Pipeline pipeline(config_, options(), parts(&source, &outputs));
  ThreadHooks hooks;
  hooks.on_watch = [] { throw std::logic_error("a command failed"); };
  EXPECT_THROW(pipeline.run(hooks), std::logic_error);
}

TEST(RingSlots, FollowTimeAndRate) {
  EXPECT_EQ(ring_slots(2.0, 30.0), 60U);
  EXPECT_EQ(ring_slots(2.0, 120.0), 240U);
  EXPECT_EQ(ring_slots(2.0, 0.0), 120U) << "as for 60 Hz";
  EXPECT_EQ(ring_slots(2.0, 1.0), 16U);
}

}  // namespace
}  // namespace farpoint::daemon
