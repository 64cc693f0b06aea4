// SPDX-License-Identifier: Apache-2.0
#include "ipc/event_file.h"

#include <gtest/gtest.h>

#include <cerrno>
#include <string>
#include <vector>

#include "ipc/log.h"
#include "tests/ipc/scratch.h"
#include "tests/support/file_size_limit.h"

namespace farpoint::ipc {
namespace {

using Bytes = std::vector<std::uint8_t>;

struct Read {
  std::vector<std::int64_t> timestamps, numbers;
  LogDamage damage;
};
Read read(const std::string& path) {
  Read found;
  LogReader reader(path);
  LogEvent event;
  while (reader.next(&event)) {
    found.timestamps.push_back(event.timestamp_us);
    found.numbers.push_back(event.number);
  }
  found.damage = reader.damage();
  return found;
}

TEST(EventFile, AfterAFullDiskTheFileEndsWithAWholeEventAndGoesOnOnceThereIsRoom) {
  const test::Scratch scratch;
  EventFile file(scratch.path("a.lcm"));
  const Bytes data(10'000, 7);
  int stored = 0;
  {
    const test::FileSizeLimit full(35'000);
    for (int i = 0; i < 6; ++i) {
      const int error = file.append("A", i, data);
      EXPECT_EQ(error, i < 3 ? 0 : EFBIG) << i;
      stored += error == 0 ? 1 : 0;
    }
  }
  EXPECT_EQ(stored, 3);
  EXPECT_EQ(test::read_bytes(scratch.path("a.lcm")).size(), file.bytes());
  EXPECT_EQ(file.append("A", 6, data), 0);
  EXPECT_EQ(file.sync(), 0);
  file.close();
  const Read found = read(scratch.path("a.lcm"));
  EXPECT_EQ(found.timestamps, (std::vector<std::int64_t>{0, 1, 2, 6}));
  EXPECT_EQ(found.numbers, (std::vector<std::int64_t>{0, 1, 2, 3}));
  EXPECT_EQ(found.damage.places, 0U);
}

TEST(EventFile, ADeviceThatIsFullSaysSoEachTime) {
  EventFile file("/dev/full");
  EXPECT_EQ(file.append("A", 0, Bytes(10)), ENOSPC);
  EXPECT_EQ(file.append("A", 0, Bytes(10)), ENOSPC);
  EXPECT_EQ(file.events(), 0U);
}

TEST(EventFile, WhatWasAppendedIsInTheFileAtOnce) {
  const test::Scratch scratch;
  EventFile file(scratch.path("a.lcm"));
  EXPECT_EQ(file.append("CHANNEL", -5, Bytes(3)), 0);
  EXPECT_EQ(read(scratch.path("a.lcm")).timestamps, (std::vector<std::int64_t>{-5}));
}

TEST(EventWalk, EndsAfterTheLastWholeEventAndMeasuresFromTheSecond) {
  const test::Scratch scratch;
  const std::string path = scratch.path("a.lcm");
  std::uint64_t whole = 0;
  {
    EventFile file(path);
    EXPECT_EQ(file.append("CALIBRATION", 0, Bytes(100)), 0);
    for (int i = 0; i < 50; ++i) EXPECT_EQ(file.append("CAMERA_0", 5'000'000 + 20'000 * i, Bytes(999)), 0);
    whole = file.bytes();
    EXPECT_EQ(file.append("CAMERA_0", 7'000'000, Bytes(999)), 0);
  }
  Bytes bytes = test::read_bytes(path);
  for (const std::size_t cut : {std::size_t{1}, std::size_t{999}, std::size_t{1020}, std::size_t{1034}}) {
    test::write_bytes(path, Bytes(bytes.begin(), bytes.end() - static_cast<std::ptrdiff_t>(cut)));
    EventWalk walk(path);
    int steps = 0;
    while (walk.step(7)) ++steps;
    EXPECT_EQ(steps, 51 / 7);
    EXPECT_EQ(walk.events(), 51U);
    EXPECT_EQ(walk.end(), whole);
    EXPECT_EQ(walk.file_bytes(), bytes.size() - cut);
    EXPECT_EQ(walk.duration_us(), 49 * 20'000);
  }
}

TEST(EventWalk, NoiseAndAMissingFileHoldNoEvents) {
  const test::Scratch scratch;
  test::write_bytes(scratch.path("noise"), Bytes(100'000, 0xED));
  for (const std::string& path : {scratch.path("noise"), scratch.path("absent")}) {
    EventWalk walk(path);
    EXPECT_FALSE(walk.step(10));
    EXPECT_EQ(walk.events(), 0U);
    EXPECT_EQ(walk.duration_us(), 0);
  }
}

}  // namespace
}  // namespace farpoint::ipc
