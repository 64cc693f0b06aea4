// SPDX-License-Identifier: Apache-2.0
// KITTI 03 driven forth and back for 3000 frames: memory and tracking's time must not know how long it has
// been.
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "ipc/channels.h"
#include "ipc/log.h"
#include "ipc/message.h"
#include "tests/ipc/log_events.h"
#include "tests/ipc/scratch.h"
#include "tests/replay/recordings.h"
#include "tests/support/record.h"
#include "tools/evaluate/statistics.h"

namespace farpoint::test {
namespace {

constexpr std::size_t kFrames = 3000;
const std::string kCamera = std::string(ipc::kCameraChannelPrefix) + "0";

// Writes `frames` images of the log: to its end, back to its beginning, and so on, at its own pace.
void write_forth_and_back(const std::string& recording, std::size_t frames, const std::string& file) {
  std::vector<image_t> images;
  ipc::LogWriter writer(file);
  ipc::LogReader reader(recording);
  for (ipc::LogEvent event; reader.next(&event);) {
    if (event.channel == ipc::kCalibrationChannel)
      writer.write(event.channel, event.timestamp_us, event.data);
    if (event.channel == kCamera) {
      ASSERT_TRUE(ipc::decode(event.data, &images.emplace_back()));
    }
  }
  ASSERT_GT(images.size(), 1U);
  const std::size_t last = images.size() - 1;
  const std::int64_t first_utime = images.front().utime;
  const std::int64_t interval_us = (images.back().utime - first_utime) / static_cast<std::int64_t>(last);
  for (std::size_t i = 0; i < frames; ++i) {
    const std::size_t phase = i % (2 * last);
    image_t& image = images[phase <= last ? phase : 2 * last - phase];
    image.utime = first_utime + static_cast<std::int64_t>(i) * interval_us;
    image.sequence = static_cast<std::int64_t>(i);
    writer.write_message(kCamera, image.utime, image);
  }
  writer.close();
}

double tracking_p99_ms(const std::vector<timing_t>& timings, std::size_t first, std::size_t last) {
  std::vector<double> ms;
  for (std::size_t i = first; i < last; ++i)
    if (timings[i].cpu_ms[timing_t::STAGE_TRACKING] >= 0.0)
      ms.push_back(timings[i].cpu_ms[timing_t::STAGE_TRACKING]);
  return tools::percentile(std::move(ms), 99.0);
}

TEST(RecordedEndlessLong, MemoryAndTimeStayAsTheyAre) {
  if (!std::filesystem::exists(kData / "kitti")) GTEST_SKIP() << "no recording " << (kData / "kitti");
  const Scratch work;
  const std::string recording = work.path("recording.lcm"), drive = work.path("drive.lcm"),
                    out = work.path("out.lcm");
  ASSERT_TRUE(import_recording("kitti {}/kitti 03", recording));
  write_forth_and_back(recording, kFrames, drive);
  ASSERT_EQ(run((kBin / "farpointd").string() + " --replay " + drive + " --lockstep --output " + out), 0);
  const std::vector<timing_t> timings = messages_of<timing_t>(out, ipc::kTimingChannel);
  ASSERT_EQ(timings.size(), kFrames);
  for (std::size_t i = 499; i < kFrames; i += 500)
    std::printf("%5zu frames: %.1f MB, tracking p99 %.2f ms\n", i + 1,
                1e-6 * static_cast<double>(timings[i].resident_bytes),
                tracking_p99_ms(timings, i - 499, i + 1));
  // The map forgets from about a thousand frames on.
  constexpr std::size_t kTenth = kFrames / 10, kHalf = kFrames / 2;
  testing::Test::RecordProperty("frames", static_cast<int>(kFrames));
  record_number("tenth_mb", 1e-6 * static_cast<double>(timings[kTenth - 1].resident_bytes));
  record_number("half_mb", 1e-6 * static_cast<double>(timings[kHalf - 1].resident_bytes));
  record_number("end_mb", 1e-6 * static_cast<double>(timings.back().resident_bytes));
  record_number("early_p99_ms", tracking_p99_ms(timings, 500, 1000));
  record_number("late_p99_ms", tracking_p99_ms(timings, kFrames - 500, kFrames));
  EXPECT_LT(static_cast<double>(timings.back().resident_bytes),
            1.02 * static_cast<double>(timings[kHalf].resident_bytes));
  EXPECT_LE(static_cast<double>(timings.back().peak_resident_bytes), 200e6);
  const double before_ms = tracking_p99_ms(timings, 500, 1000);
  EXPECT_LT(tracking_p99_ms(timings, kFrames - 500, kFrames), 1.25 * before_ms);
}

}  // namespace
}  // namespace farpoint::test
