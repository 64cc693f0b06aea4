// SPDX-License-Identifier: Apache-2.0
#include "daemon/input/camera_troubles.h"

#include <gtest/gtest.h>

namespace farpoint::daemon {
namespace {

bool has(const std::string& text, const char* part) {
  return text.find(part) != std::string::npos;
}

TEST(CameraTroubles, NothingIsSaidOfAHealthyCamera) {
  CameraTroubles troubles;
  drivers::CameraCounts counts;
  for (counts.frames = 0; counts.frames < 100; ++counts.frames) {
    troubles.note(counts);
    EXPECT_EQ(troubles.take_line(0.03 * static_cast<double>(counts.frames)), "");
  }
}

TEST(CameraTroubles, TheFirstTroubleIsSaidAtOnceAndTheNextAfterAWhileWithTheNumbersSince) {
  CameraTroubles troubles;
  drivers::CameraCounts counts;
  counts.times_unknown = 1;
  troubles.note(counts);
  EXPECT_TRUE(has(troubles.take_line(100.0), "1 images with a time stamp of no clock"));
  int lines = 0;
  std::string last;
  for (int i = 1; i <= 200; ++i) {  // 20 s
    counts.times_unknown += 2;
    counts.times_backwards += 1;
    troubles.note(counts);
    const std::string line = troubles.take_line(100.0 + 0.1 * i);
    if (line.empty()) continue;
    ++lines;
    last = line;
  }
  EXPECT_EQ(lines, 2);
  EXPECT_TRUE(has(last, "200 images with a time stamp of no clock")) << last;
  EXPECT_TRUE(has(last, "; 100 images dropped, since their time was not after the one before")) << last;
}

TEST(CameraTroubles, WhatIsDroppedForItsContentIsSaidToo) {
  CameraTroubles troubles;
  drivers::CameraCounts counts;
  counts.undecodable = 3;
  counts.flagged = 4;
  troubles.note(counts);
  const std::string line = troubles.take_line(1.0);
  EXPECT_TRUE(has(line, "3 images dropped, since they were too short")) << line;
  EXPECT_TRUE(has(line, "4 images dropped, since the driver marked them")) << line;
}

}  // namespace
}  // namespace farpoint::daemon
