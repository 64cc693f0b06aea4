// SPDX-License-Identifier: Apache-2.0
#include "daemon/pipeline/silence_reporter.h"

#include "ipc/channels.h"
#include "tests/daemon/pipeline/session_fixture.h"

namespace farpoint::daemon {
namespace {

constexpr double kNoCameraAfter_s = 0.25;

class SilenceReporterTest : public SessionFixture {
 protected:
  SilenceReporterTest() {
    session_->reporter().set_status_rate(5.0);
    presence_.begin(100.0);
  }
  const FrameOutput* report(double now_s) { return silence_.report_if_due(now_s, {}); }

  CameraPresence presence_;
  SilenceReporter silence_{&session_->reporter(), &presence_, kNoCameraAfter_s};
};

TEST_F(SilenceReporterTest, SilenceIsReportedAfterItsTimeWithItsAge) {
  EXPECT_EQ(report(100.2), nullptr);
  const FrameOutput* frame = report(100.3);
  ASSERT_NE(frame, nullptr);
  EXPECT_EQ(frame->result.state, slam::State::kNoCamera);
  EXPECT_FALSE(frame->valid);
  EXPECT_EQ(frame->result.utime, 100'300'000);
  ASSERT_EQ(sink_.frames.size(), 1U);
  EXPECT_EQ(sink_.frames[0].age_us, 300'000);
}

TEST_F(SilenceReporterTest, FurtherReportsComeAtTheRateOfTheStatusAlsoOnceItIsChanged) {
  ASSERT_NE(report(101.0), nullptr);
  EXPECT_EQ(report(101.15), nullptr);
  ASSERT_NE(report(101.21), nullptr);
  session_->reporter().set_status_rate(1.0);
  ASSERT_NE(report(101.42), nullptr);
  EXPECT_EQ(report(102.0), nullptr);
  ASSERT_NE(report(102.43), nullptr);
}

TEST_F(SilenceReporterTest, ACameraThatWentIsReportedAtOnceWithTheCountsOfThen) {
  InputCounts counts;
  counts.camera_losses = 3;
  EXPECT_TRUE(presence_.note_nothing(true, counts));
  ASSERT_NE(report(100.01), nullptr);
  EXPECT_EQ(silence_.input().camera_losses, 3);
  EXPECT_EQ(kept_.of<status_t>(ipc::kStatusChannel).back().camera_losses, 3);
}

TEST_F(SilenceReporterTest, AnImageEndsTheSilenceAndTheNextOneIsReportedAtOnce) {
  ASSERT_NE(report(100.3), nullptr);
  presence_.note_image(100.35);
  InputCounts in;
  in.images = 7;
  silence_.note_frame(in);
  EXPECT_EQ(report(100.55), nullptr);
  (void)presence_.note_nothing(true, in);
  ASSERT_NE(report(100.4), nullptr) << "not a period after the report before the image";
  EXPECT_EQ(silence_.input().images, 7);
}

TEST_F(SilenceReporterTest, ARecordingIsNeverSilent) {
  SilenceReporter recording(&session_->reporter(), &presence_, 0.0);
  (void)presence_.note_nothing(true, {});
  EXPECT_EQ(recording.report_if_due(1000.0, {}), nullptr);
  EXPECT_TRUE(sink_.frames.empty());
}

}  // namespace
}  // namespace farpoint::daemon
