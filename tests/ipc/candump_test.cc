// SPDX-License-Identifier: Apache-2.0
#include "ipc/candump.h"

#include <gtest/gtest.h>

#include <fstream>
#include <random>

#include "tests/ipc/scratch.h"

namespace farpoint::ipc {
namespace {

TEST(Candump, WritesTheKnownFormat) {
  const test::Scratch scratch;
  CandumpWriter writer(scratch.path("a.candump"), "can0");
  CanFrame frame;
  frame.id = 0x12;
  frame.data = {0xde, 0xad, 0, 1, 2, 3, 4, 0xff};
  writer.write(1'436'509'052'249'713, {&frame, 1});
  frame.size = 2;
  writer.write(0, {&frame, 1});
  writer.close();
  const auto bytes = test::read_bytes(scratch.path("a.candump"));
  EXPECT_EQ(std::string(bytes.begin(), bytes.end()),
            "(1436509052.249713) can0 012#DEAD0001020304FF\n(0000000000.000000) can0 012#DEAD\n");
}

TEST(Candump, CanFdFramesHaveTheirOwnSign) {
  const test::Scratch scratch;
  CandumpWriter writer(scratch.path("a.candump"), "can0", true);
  CanFrame frame;
  frame.id = 0x301;
  frame.size = 12;
  frame.data[11] = 0xab;
  writer.write(1'000'000, {&frame, 1});
  writer.close();
  const auto bytes = test::read_bytes(scratch.path("a.candump"));
  const std::string line(bytes.begin(), bytes.end());
  EXPECT_EQ(line, "(0000000001.000000) can0 301##10000000000000000000000AB\n");
  CandumpLine parsed;
  ASSERT_TRUE(parse_candump_line(line, &parsed));
  EXPECT_EQ(parsed.frame.size, 12);
  EXPECT_EQ(parsed.frame.data[11], 0xab);
}

TEST(Candump, IdentifiersOf29BitsHaveEightDigits) {
  const test::Scratch scratch;
  CandumpWriter writer(scratch.path("a.candump"), "can0");
  CanFrame frame;
  frame.id = 0x123;
  frame.size = 1;
  frame.extended = true;
  writer.write(1'000'000, {&frame, 1});
  writer.close();
  const auto bytes = test::read_bytes(scratch.path("a.candump"));
  const std::string line(bytes.begin(), bytes.end());
  EXPECT_EQ(line, "(0000000001.000000) can0 00000123#00\n");
  CandumpLine parsed;
  ASSERT_TRUE(parse_candump_line(line, &parsed));
  EXPECT_TRUE(parsed.frame.extended);
  EXPECT_EQ(parsed.frame.id, 0x123U);
}

TEST(Candump, ReadsWhatItWrote) {
  const test::Scratch scratch;
  std::mt19937_64 rng(1);
  std::vector<CanFrame> frames(300);
  CandumpWriter writer(scratch.path("a.candump"), "vcan7");
  for (std::size_t i = 0; i < frames.size(); ++i) {
    frames[i].id = static_cast<std::uint32_t>(rng() % 0x800);
    frames[i].size = static_cast<std::uint8_t>(rng() % 9);
    for (std::size_t k = 0; k < frames[i].size; ++k) frames[i].data[k] = static_cast<std::uint8_t>(rng());
    writer.write(static_cast<std::int64_t>(i) * 123'457, {&frames[i], 1});
  }
  writer.close();
  std::ifstream file(scratch.path("a.candump"));
  std::string line;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    ASSERT_TRUE(std::getline(file, line));
    CandumpLine parsed;
    ASSERT_TRUE(parse_candump_line(line, &parsed)) << line;
    EXPECT_EQ(parsed.utime, static_cast<std::int64_t>(i) * 123'457);
    EXPECT_EQ(parsed.interface, "vcan7");
    EXPECT_EQ(parsed.frame.id, frames[i].id);
    EXPECT_EQ(parsed.frame.size, frames[i].size);
    EXPECT_EQ(parsed.frame.data, frames[i].data);
  }
  EXPECT_FALSE(std::getline(file, line));
}

TEST(Candump, RefusesWhatIsNotAFrame) {
  CandumpLine out;
  EXPECT_TRUE(parse_candump_line("(1.000000) can0 7FF#\r\n", &out));
  for (const char* line : {"",
                           "(",
                           "()",
                           "(1.0) can0 123#00",
                           "1.000000 can0 123#00",
                           "(1.000000) can0",
                           "(1.000000) can0 ",
                           "(1.000000)  123#00",
                           "(1.000000) can0 800#00",
                           "(1.000000) can0 22345678#00",
                           "(1.000000) can0 123#0",
                           "(1.000000) can0 123#001122334455667788",
                           "(1.000000) can0 123#0G",
                           "(1.000000) can0 123##00",
                           "(1.000000) can0 123##",
                           "(1.000000) can0 123#R",
                           "(-1.000000) can0 123#00",
                           "(99999999999999999999.000000) can0 123#00",
                           "(x.000000) can0 123#00",
                           "(1.-00001) can0 123#00",
                           "(.000000) can0 123#00"}) {
    EXPECT_FALSE(parse_candump_line(line, &out)) << line;
  }
}

TEST(Candump, AFullDiskIsReported) {
  CandumpWriter writer("/dev/full", "can0");
  const CanFrame frame;
  writer.write(0, {&frame, 1});
  EXPECT_THROW(writer.close(), std::runtime_error);
}

TEST(Candump, WithoutCloseTheOldFileStays) {
  const test::Scratch scratch;
  test::write_bytes(scratch.path("a"), {'o', 'l', 'd'});
  {
    CandumpWriter writer(scratch.path("a"), "can0");
    const CanFrame frame;
    writer.write(0, {&frame, 1});
  }
  EXPECT_EQ(test::read_bytes(scratch.path("a")).size(), 3U);
  EXPECT_EQ(scratch.files(), 1U);
}

}  // namespace
}  // namespace farpoint::ipc
