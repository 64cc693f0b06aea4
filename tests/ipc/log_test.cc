// SPDX-License-Identifier: Apache-2.0
#include "ipc/log.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <lcm/lcm-cpp.hpp>
#include <random>
#include <thread>

#include "ipc/channels.h"
#include "tests/ipc/scratch.h"
#include "tests/support/file_size_limit.h"

namespace farpoint::ipc {
namespace {

using Bytes = std::vector<std::uint8_t>;

struct Event {
  std::int64_t number, timestamp_us;
  std::string channel;
  Bytes data;
  bool operator==(const Event&) const = default;
};

std::vector<Event> read_all(LogReader& reader, std::vector<std::uint64_t>* offsets = nullptr) {
  std::vector<Event> out;
  LogEvent event;
  while (reader.next(&event)) {
    out.push_back({event.number,
                   event.timestamp_us,
                   std::string(event.channel),
                   {event.data.begin(), event.data.end()}});
    if (offsets != nullptr) offsets->push_back(event.offset);
  }
  return out;
}

std::vector<Event> write_log(const std::string& path, int count, std::size_t max_bytes, unsigned seed = 1) {
  std::mt19937_64 rng(seed);
  std::vector<Event> events;
  LogWriter writer(path);
  for (int i = 0; i < count; ++i) {
    Event event{i, 1'000'000 + 10 * i, "CHANNEL_" + std::to_string(i % 3), Bytes(rng() % (max_bytes + 1))};
    for (auto& byte : event.data) byte = static_cast<std::uint8_t>(rng());
    EXPECT_TRUE(writer.write(event.channel, event.timestamp_us, event.data));
    events.push_back(event);
  }
  writer.close();
  return events;
}

std::vector<Event> read_file(const std::string& path, LogDamage* damage) {
  LogReader reader(path);
  auto out = read_all(reader);
  *damage = reader.damage();
  return out;
}

TEST(Log, ReadsWhatItWrote) {
  const test::Scratch scratch;
  const auto written = write_log(scratch.path("a.lcm"), 200, 5000);
  LogDamage damage;
  EXPECT_EQ(read_file(scratch.path("a.lcm"), &damage), written);
  EXPECT_EQ(damage.places, 0U);
  EXPECT_EQ(scratch.files(), 1U);  // no temporary left
}

TEST(Log, AgreesWithLcmsOwnReader) {
  const test::Scratch scratch;
  write_log(scratch.path("a.lcm"), 300, 3000);
  lcm::LogFile theirs(scratch.path("a.lcm"), "r");
  LogReader ours(scratch.path("a.lcm"));
  LogEvent event;
  int events = 0;
  while (const lcm::LogEvent* expected = theirs.readNextEvent()) {
    ASSERT_TRUE(ours.next(&event));
    EXPECT_EQ(event.number, expected->eventnum);
    EXPECT_EQ(event.timestamp_us, expected->timestamp);
    EXPECT_EQ(event.channel, expected->channel);
    ASSERT_EQ(event.data.size(), static_cast<std::size_t>(expected->datalen));
    EXPECT_TRUE(
        std::equal(event.data.begin(), event.data.end(), static_cast<const std::uint8_t*>(expected->data)));
    ++events;
  }
  EXPECT_FALSE(ours.next(&event));
  EXPECT_EQ(events, 300);
}

TEST(Log, ReadsImagesLargerThanItsBuffer) {
  const test::Scratch scratch;
  const auto written = write_log(scratch.path("a.lcm"), 6, 9'000'000);
  LogDamage damage;
  EXPECT_EQ(read_file(scratch.path("a.lcm"), &damage), written);
  EXPECT_EQ(damage.places, 0U);
}

TEST(Log, AnEventLongerThanTheReadersLimitCountsAsDamage) {
  const test::Scratch scratch;
  const std::string path = scratch.path("a.lcm");
  LogWriter writer(path);
  for (const std::size_t bytes : {std::size_t{100}, std::size_t{5} << 20, std::size_t{200}})
    ASSERT_TRUE(writer.write("A", 0, Bytes(bytes, 7)));
  writer.close();
  LogReader reader(path, std::size_t{5} << 20);
  EXPECT_EQ(read_all(reader).size(), 3U) << "as long as the limit";
  LogReader strict(path, (std::size_t{5} << 20) - 1);
  const std::vector<Event> events = read_all(strict);
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[1].data.size(), 200U);
  EXPECT_EQ(strict.damage().places, 1U);
}

TEST(Log, OffsetPointsAtTheSyncWord) {
  const test::Scratch scratch;
  write_log(scratch.path("a.lcm"), 20, 100);
  const Bytes file = test::read_bytes(scratch.path("a.lcm"));
  LogReader reader(scratch.path("a.lcm"));
  std::vector<std::uint64_t> offsets;
  read_all(reader, &offsets);
  ASSERT_EQ(offsets.size(), 20U);
  for (const std::uint64_t at : offsets) {
    EXPECT_EQ(Bytes(file.begin() + std::ptrdiff_t(at), file.begin() + std::ptrdiff_t(at) + 4),
              (Bytes{0xed, 0xa1, 0xda, 0x01}));
  }
}

TEST(Log, CutOffAnywhereGivesTheWholeEventsBefore) {
  const test::Scratch scratch;
  const auto written = write_log(scratch.path("a.lcm"), 12, 60);
  const Bytes file = test::read_bytes(scratch.path("a.lcm"));
  std::vector<std::uint64_t> ends;
  {
    LogReader reader(scratch.path("a.lcm"));
    read_all(reader, &ends);
    ends.push_back(file.size());
    ends.erase(ends.begin());  // where each event ends
  }
  for (std::size_t size = 0; size <= file.size(); ++size) {
    test::write_bytes(scratch.path("cut.lcm"), Bytes(file.begin(), file.begin() + std::ptrdiff_t(size)));
    LogDamage damage;
    const auto events = read_file(scratch.path("cut.lcm"), &damage);
    const auto whole = static_cast<std::size_t>(
        std::count_if(ends.begin(), ends.end(), [&](std::uint64_t end) { return end <= size; }));
    ASSERT_EQ(events.size(), whole) << "cut at " << size;
    EXPECT_TRUE(std::equal(events.begin(), events.end(), written.begin()));
    const bool at_boundary = size == 0 || std::find(ends.begin(), ends.end(), size) != ends.end();
    EXPECT_EQ(damage.places, at_boundary ? 0U : 1U) << "cut at " << size;
    EXPECT_EQ(damage.cut_off, !at_boundary) << "cut at " << size;
    EXPECT_EQ(damage.bytes, at_boundary ? 0U : size - (whole == 0 ? 0 : ends[whole - 1]));
  }
}

TEST(Log, GarbageInTheMiddleIsSkippedAndCounted) {
  const test::Scratch scratch;
  const auto written = write_log(scratch.path("a.lcm"), 30, 400);
  Bytes file = test::read_bytes(scratch.path("a.lcm"));
  std::vector<std::uint64_t> offsets;
  {
    LogReader reader(scratch.path("a.lcm"));
    read_all(reader, &offsets);
  }
  // Overwrites event 10's head and the middle of events 20 to 22.
  std::fill_n(file.begin() + std::ptrdiff_t(offsets[10]), 40, 0x55);
  std::fill(file.begin() + std::ptrdiff_t(offsets[20] + 30), file.begin() + std::ptrdiff_t(offsets[22] + 10),
            0xed);
  test::write_bytes(scratch.path("b.lcm"), file);
  LogDamage damage;
  const auto events = read_file(scratch.path("b.lcm"), &damage);
  EXPECT_GE(damage.places, 2U);
  EXPECT_EQ(damage.first_offset, offsets[10]);
  const auto contains = [&](const Event& e) {
    return std::find(events.begin(), events.end(), e) != events.end();
  };
  for (std::size_t i = 0; i < written.size(); ++i) {
    if (i == 10 || (i >= 20 && i <= 22)) continue;
    EXPECT_TRUE(contains(written[i])) << i;
  }
  EXPECT_FALSE(contains(written[10]));
}

// A damaged length must not swallow the events behind it.
TEST(Log, EveryFlippedHeaderBitCostsOneEventAtMost) {
  const test::Scratch scratch;
  const auto written = write_log(scratch.path("a.lcm"), 6, 200, 9);
  const Bytes file = test::read_bytes(scratch.path("a.lcm"));
  std::vector<std::uint64_t> offsets;
  {
    LogReader reader(scratch.path("a.lcm"));
    read_all(reader, &offsets);
  }
  for (std::size_t bit = 0; bit < 8 * (LogReader::kHeaderBytes + 3); ++bit) {
    Bytes damaged = file;
    auto& byte = damaged[offsets[2] + bit / 8];
    byte = static_cast<std::uint8_t>(byte ^ (1U << (bit % 8)));
    test::write_bytes(scratch.path("b.lcm"), damaged);
    LogDamage damage;
    const auto events = read_file(scratch.path("b.lcm"), &damage);
    for (std::size_t i = 0; i < written.size(); ++i) {
      if (i == 2) continue;
      EXPECT_EQ(std::count(events.begin(), events.end(), written[i]), 1) << "event " << i << ", bit " << bit;
    }
    const bool is_length = bit >= 8 * 20 && bit < 8 * 28;
    if (is_length && damage.places == 0) {
      EXPECT_EQ(events.size(), written.size());
      ADD_FAILURE() << "damaged length was not noticed, bit " << bit;
    }
  }
}

TEST(Log, NoiseHoldsNoEvents) {
  const test::Scratch scratch;
  std::mt19937_64 rng(5);
  Bytes noise(3'000'000);
  for (auto& byte : noise) byte = static_cast<std::uint8_t>(rng());
  test::write_bytes(scratch.path("noise"), noise);
  LogDamage damage;
  EXPECT_TRUE(read_file(scratch.path("noise"), &damage).empty());
  EXPECT_EQ(damage.places, 1U);
  EXPECT_EQ(damage.bytes, noise.size());
}

TEST(Log, OnlySyncBytesEndsInReasonableTime) {
  const test::Scratch scratch;
  Bytes sync;
  for (int i = 0; i < 500'000; ++i) sync.insert(sync.end(), {0xed, 0xa1, 0xda, 0x01});
  test::write_bytes(scratch.path("sync"), sync);
  LogDamage damage;
  EXPECT_TRUE(read_file(scratch.path("sync"), &damage).empty());
}

TEST(Log, ReadsStandardInputFromAPipe) {
  const test::Scratch scratch;
  const auto written = write_log(scratch.path("a.lcm"), 50, 100'000);
  const Bytes file = test::read_bytes(scratch.path("a.lcm"));
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  std::thread feeder([&] {
    for (std::size_t at = 0; at < file.size();) {  // in odd pieces
      const std::size_t piece = std::min<std::size_t>(777, file.size() - at);
      const ssize_t sent = write(ends[1], file.data() + at, piece);
      if (sent <= 0) break;
      at += static_cast<std::size_t>(sent);
    }
    close(ends[1]);
  });
  const int saved = dup(STDIN_FILENO);
  dup2(ends[0], STDIN_FILENO);
  std::vector<Event> events;
  {
    LogReader reader("-");
    events = read_all(reader);
  }
  dup2(saved, STDIN_FILENO);
  close(saved);
  feeder.join();
  close(ends[0]);
  EXPECT_EQ(events, written);
}

TEST(Log, MissingFileOrFolderSaysWhich) {
  const test::Scratch scratch;
  for (const std::string& path : {scratch.path("absent.lcm"), scratch.path(".")}) {
    try {
      LogReader reader(path);
      ADD_FAILURE() << "opened " << path;
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find(path), std::string::npos) << error.what();
    }
  }
}

TEST(Log, AnAbandonedWriterLeavesTheOldFile) {
  const test::Scratch scratch;
  test::write_bytes(scratch.path("a.lcm"), {1, 2, 3});
  {
    LogWriter writer(scratch.path("a.lcm"));
    EXPECT_TRUE(writer.write("A", 0, Bytes{4}));
  }
  EXPECT_EQ(test::read_bytes(scratch.path("a.lcm")), (Bytes{1, 2, 3}));
  EXPECT_EQ(scratch.files(), 1U);
}

TEST(Log, ReplacesAnExistingFile) {
  const test::Scratch scratch;
  test::write_bytes(scratch.path("a.lcm"), {1, 2, 3});
  const auto written = write_log(scratch.path("a.lcm"), 3, 10);
  LogDamage damage;
  EXPECT_EQ(read_file(scratch.path("a.lcm"), &damage), written);
}

TEST(Log, AFullDiskIsReported) {
  LogWriter writer("/dev/full");
  Bytes data(100'000);
  for (int i = 0; i < 10; ++i) writer.write("A", 0, data);
  EXPECT_THROW(writer.close(), std::runtime_error);
}

TEST(Log, WhatWasWrittenBeforeTheDiskWasFullIsKept) {
  const test::Scratch scratch;
  test::write_bytes(scratch.path("a.lcm"), {1, 2, 3});
  LogWriter writer(scratch.path("a.lcm"));
  const Bytes data(10'000);
  {
    const test::FileSizeLimit full(35'000);
    for (int i = 0; i < 6; ++i) EXPECT_EQ(writer.write("A", i, data), i < 3);
  }
  try {
    writer.close();
    ADD_FAILURE() << "no failure was reported";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("File too large; what was written is kept as"),
              std::string::npos)
        << error.what();
  }
  EXPECT_EQ(test::read_bytes(scratch.path("a.lcm")), (Bytes{1, 2, 3}));
  LogDamage damage;
  EXPECT_EQ(read_file(scratch.path("a.lcm.incomplete"), &damage).size(), 3U);
  EXPECT_EQ(damage.places, 0U);
}

TEST(Log, AMissingFolderIsReported) {
  const test::Scratch scratch;
  EXPECT_THROW(LogWriter(scratch.path("absent/a.lcm")), std::runtime_error);
}

TEST(Log, WritesMessages) {
  const test::Scratch scratch;
  {
    LogWriter writer(scratch.path("a.lcm"));
    imu_t imu{};
    imu.utime = 7;
    imu.acceleration[2] = 9.81;
    EXPECT_TRUE(writer.write_message(kImuChannel, imu.utime, imu));
    writer.close();
  }
  LogReader reader(scratch.path("a.lcm"));
  LogEvent event;
  ASSERT_TRUE(reader.next(&event));
  imu_t imu{};
  ASSERT_TRUE(decode(event.data, &imu));
  EXPECT_EQ(imu.utime, 7);
  EXPECT_EQ(imu.acceleration[2], 9.81);
}

}  // namespace
}  // namespace farpoint::ipc
