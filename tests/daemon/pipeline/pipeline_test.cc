// SPDX-License-Identifier: Apache-2.0
// The threads of the vehicle over a source of images made by hand.
#include "daemon/pipeline/pipeline.h"

#include <algorithm>
#include <stdexcept>
#include <thread>

#include "ipc/channels.h"
#include "tests/daemon/pipeline/session_fixture.h"

namespace farpoint::daemon {
namespace {

// Gives N images, `pause` apart, then ends or throws.
class HandMadeSource final : public CaptureSource {
 public:
  HandMadeSource(int images, std::chrono::microseconds pause) : images_(images), pause_(pause) {
    for (int i = 0; i < kPictures; ++i) {
      const image_t picture = test::synthetic_image({}, i);
      pictures_.push_back({picture.width, picture.height, picture.data});
    }
  }
  void throw_at_end() { throws_ = true; }

  CaptureStatus next(const std::atomic<bool>& /*stop*/, CapturedImage* image) override {
    std::this_thread::sleep_for(pause_);
    if (given_ == images_) {
      if (throws_) throw std::runtime_error("the source broke");
      return CaptureStatus::kEnd;
    }
    image->image = pictures_[static_cast<std::size_t>(given_ % kPictures)];
    image->meta.utime = 1'000'000 + given_ * 100'000;
    image->meta.sequence = given_++;
    image->in = {};
    image->in.images = given_;
    image->due_s = steady_s();
    return CaptureStatus::kImage;
  }

 private:
  static constexpr int kPictures = 25;
  const int images_;
  const std::chrono::microseconds pause_;
  bool throws_ = false;
  int given_ = 0;
  std::vector<ipc::GreyImage> pictures_;
};

class PipelineTest : public SessionFixture {
 protected:
  // To the source's end. What the hooks saw is in captured_, tracked_ and output_.
  void run(HandMadeSource* source) {
    PipelineOptions options;
    const ipc::GreyImage image = grey(0);
    options.width_px = image.width_px, options.height_px = image.height_px;
    Options none;
    Outputs outputs(none, config_);
    Pipeline pipeline(config_, options, source, session_.get(), &outputs);
    ThreadHooks hooks;
    hooks.on_captured = [this] { ++captured_; };
    hooks.on_tracked = [this](const slam::FrameResult& r) { tracked_.push_back(r.sequence); };
    hooks.on_output = [this](const FrameOutput& f) { output_.push_back(f.result.sequence); };
    pipeline.run(hooks);
    dropped_ = pipeline.frames_dropped();
    EXPECT_EQ(pipeline.frames_tracked(), static_cast<std::int64_t>(tracked_.size()));
  }
  using Sequences = std::vector<std::int64_t>;

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
  EXPECT_GT(kept_.of<schedule_t>(ipc::kScheduleChannel).back().replies_taken, 0);
}

TEST_F(PipelineTest, WhatReadingThrowsIsThrownByRunAfterTheFramesBefore) {
  HandMadeSource source(4, std::chrono::milliseconds(20));
  source.throw_at_end();
  EXPECT_THROW(run(&source), std::runtime_error);
  EXPECT_EQ(captured_, 4);
  EXPECT_EQ(output_.size(), tracked_.size());
  EXPECT_FALSE(output_.empty());
}

}  // namespace
}  // namespace farpoint::daemon
