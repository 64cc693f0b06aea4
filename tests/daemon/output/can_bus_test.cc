// SPDX-License-Identifier: Apache-2.0
// Odometry on the bus: one clock sends, one epoch is in flight, and never a stale number.
#include "daemon/output/can_bus.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "daemon/system/stage_clock.h"
#include "farpoint/status_t.hpp"
#include "tests/daemon/output/can_receiver.h"
#include "tests/ipc/scratch.h"

namespace farpoint::daemon {
namespace {

constexpr double kPeriod_s = 0.020;

class OnTheBus : public testing::Test {
 protected:
  OnTheBus() {
    EpochOptions options;
    options.frame_period_s = 0.1;
    sender_ = std::make_unique<CanBus>(ipc::CanLayout{}, options);
    frame_.valid = true;
    frame_.result.has_pose = true;
    frame_.result.state = slam::State::kTracking;
    frame_.result.scale = slam::ScaleState::kMetric;
    frame_.result.velocity_body << 10, 0, 0, 0, 0, 0;
  }

  // An image taken at `image_s`, published at now_s_.
  void image(double image_s) {
    frame_.age_at_s = now_s_;
    frame_.age_us = std::llround(1e6 * (now_s_ - image_s));
    sender_->on_frame(frame_);
  }
  // Ticks and the bus's answers, every 0.1 ms.
  void run(double for_s, bool answers = true) {
    for (const double end_s = now_s_ + for_s; now_s_ < end_s; now_s_ += 0.0001) {
      sender_->tick(now_s_);
      receiver_.take(answers);
    }
  }
  [[nodiscard]] const std::vector<test::CanReceiver::Epoch>& epochs() const { return receiver_.epochs(); }

  test::CanReceiver receiver_;
  std::unique_ptr<CanBus> sender_;
  FrameOutput frame_;
  double now_s_ = 100.0;
};

TEST_F(OnTheBus, EpochsGoOutAtTheRateBeforeTheFirstImageAndWhateverImagesDo) {
  sender_->send_on(receiver_.bus(true));
  run(0.1);
  EXPECT_EQ(epochs().size(), 5U);
  EXPECT_EQ(epochs().back().at("State"), int{status_t::STATE_STARTING});
  EXPECT_TRUE(std::isnan(epochs().back().at("Age")));
  for (int i = 0; i < 20; ++i) {  // images in a burst, then none
    image(now_s_ - 0.030);
    run(0.001);
  }
  run(0.38);
  EXPECT_EQ(epochs().size(), 25U);
  for (std::size_t i = 0; i < epochs().size(); ++i)
    EXPECT_EQ(epochs()[i].at("Counter"), static_cast<double>(i % 15));
}

TEST_F(OnTheBus, ThePoseIsPredictedAndTheAgeIsTheImages) {
  sender_->send_on(receiver_.bus(true));
  sender_->tick(now_s_);
  receiver_.take();
  image(now_s_ - 0.030);
  run(0.085);
  ASSERT_EQ(epochs().size(), 5U);
  for (std::size_t i = 1; i < epochs().size(); ++i) {
    const double age_s = 0.030 + kPeriod_s * static_cast<double>(i);
    EXPECT_NEAR(epochs()[i].at("Age"), age_s, 0.0002) << i;
    EXPECT_NEAR(epochs()[i].at("PositionX"), 10.0 * age_s, 0.006) << i;
    EXPECT_EQ(epochs()[i].at("Predicted"), 1.0);
    EXPECT_EQ(epochs()[i].at("FromVision"), age_s <= 0.1 ? 1.0 : 0.0) << i;
  }
}

// Its image was 0.2 s old when it was published: 0.05 s later it is not valid, by the image's time.
TEST_F(OnTheBus, ALatePublicationMakesNothingValidForLonger) {
  sender_->send_on(receiver_.bus(true));
  sender_->tick(now_s_);
  image(now_s_ - 0.200);
  run(0.085);
  ASSERT_EQ(epochs().size(), 5U);
  EXPECT_EQ(epochs()[2].at("PoseValid"), 1.0);  // 0.24 s
  EXPECT_EQ(epochs()[3].at("PoseValid"), 0.0);
  EXPECT_EQ(epochs()[3].at("State"), int{status_t::STATE_LOST});
  EXPECT_TRUE(std::isnan(epochs()[3].at("PositionX")) && std::isnan(epochs()[3].at("VelocityX")));
}

TEST_F(OnTheBus, WhatCameLateIsNotFollowedByABurst) {
  sender_->send_on(receiver_.bus(true));
  run(0.0205);
  ASSERT_EQ(epochs().size(), 2U);
  now_s_ += 0.105;  // output was held up
  run(0.0205);
  EXPECT_EQ(epochs().size(), 4U);  // the late one, and the next at its time
}

TEST_F(OnTheBus, TheOtherFramesFollowTheStatusFrameOnceItIsConfirmed) {
  sender_->send_on(receiver_.bus(true));
  sender_->tick(now_s_);
  EXPECT_EQ(receiver_.take(false), 1);
  EXPECT_NEAR(sender_->next_due_s(), now_s_ + 0.0003, 1e-9);
  sender_->tick(now_s_ + 0.001);
  EXPECT_EQ(receiver_.take(), 0);
  receiver_.come_back();
  sender_->tick(now_s_ + 0.002);
  EXPECT_EQ(receiver_.take(), 5);  // and one of those of every fifth epoch
  EXPECT_NEAR(sender_->next_due_s(), now_s_ + kPeriod_s, 1e-9);
}

TEST_F(OnTheBus, WhenTheBusComesBackNoOldEpochFollows) {
  sender_->send_on(receiver_.bus(true));
  image(now_s_ - 0.010);
  run(0.1);
  const std::size_t before = epochs().size();
  run(2.0, false);
  EXPECT_EQ(epochs().size(), before + 1);  // the status frame that was in flight, alone
  EXPECT_FALSE(epochs().back().contains("PositionX"));
  EXPECT_GT(sender_->errors(), 99 * 6);
  image(now_s_ - 0.010);
  receiver_.come_back();
  run(0.0195);
  ASSERT_GE(epochs().size(), before + 2);
  EXPECT_TRUE(epochs()[before + 1].contains("PositionX"));
  EXPECT_LE(epochs()[before + 1].at("Age"), 0.035);
}

TEST_F(OnTheBus, TheLogHoldsWhatWasConfirmed) {
  const test::Scratch scratch;
  sender_->send_on(receiver_.bus(true));
  sender_->log_to(std::make_unique<ipc::CandumpWriter>(scratch.path("a.candump"), "can0"));
  run(0.1);
  run(0.5, false);  // nothing is confirmed
  receiver_.come_back();
  run(0.1);
  sender_->write_log();
  sender_->close();
  std::ifstream log(scratch.path("a.candump"));
  int status_frames = 0;
  for (std::string line; std::getline(log, line);) status_frames += line.find(" 680#") != std::string::npos;
  EXPECT_GE(status_frames, 10);
  EXPECT_LE(status_frames, 12);
}

TEST_F(OnTheBus, WithoutConfirmationsAnEpochIsSentAtOnce) {
  sender_->send_on(receiver_.bus(false));
  sender_->tick(now_s_);
  EXPECT_EQ(receiver_.take(), 6);
}

TEST_F(OnTheBus, TheLastEpochSaysStoppedAndGivesNoNumber) {
  sender_->send_on(receiver_.bus(false));
  image(now_s_ - 0.010);
  run(0.05);
  EXPECT_EQ(epochs().back().at("PoseValid"), 1.0);
  sender_.reset();  // however the run ends
  receiver_.take();
  EXPECT_EQ(epochs().back().at("State"), int{status_t::STATE_STOPPED});
  EXPECT_EQ(epochs().back().at("PoseValid"), 0.0);
  for (const char* name : {"Age", "PositionX", "Heading", "VelocityX", "YawRate"})
    EXPECT_TRUE(std::isnan(epochs().back().at(name))) << name;
}

TEST_F(OnTheBus, BeforeItRanThereIsNoFarewell) {
  sender_->send_on(receiver_.bus(false));
  sender_.reset();
  EXPECT_EQ(receiver_.take(), 0);
}

}  // namespace
}  // namespace farpoint::daemon
