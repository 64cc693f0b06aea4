// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/record_ring.h"

#include <gtest/gtest.h>

#include <deque>
#include <random>
#include <string>
#include <string_view>
#include <thread>

namespace farpoint::daemon {
namespace {

std::span<const std::uint8_t> bytes(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

std::string text(const Record& record) {
  return {record.bytes.begin(), record.bytes.end()};
}

TEST(RecordRing, GivesRecordsBackWholeAndInOrder) {
  RecordRing ring(256);
  Record record;
  EXPECT_FALSE(ring.front(&record));
  ASSERT_TRUE(ring.push(1, {bytes("head"), bytes("tail")}));
  ASSERT_TRUE(ring.push(2, {}));
  ASSERT_TRUE(ring.front(&record));
  EXPECT_EQ(record.kind, 1U);
  EXPECT_EQ(text(record), "headtail");
  ring.pop();
  ASSERT_TRUE(ring.front(&record));
  EXPECT_EQ(record.kind, 2U);
  EXPECT_EQ(text(record), "");
  ring.pop();
  EXPECT_FALSE(ring.front(&record));
}

TEST(RecordRing, ARecordWithoutRoomIsRefusedAndChangesNothing) {
  RecordRing ring(64);
  EXPECT_FALSE(ring.push(1, {bytes(std::string(57, 'x'))})) << "longer than the ring";
  ASSERT_TRUE(ring.push(1, {bytes(std::string(24, 'a'))}));
  ASSERT_TRUE(ring.push(2, {bytes(std::string(24, 'b'))}));
  EXPECT_FALSE(ring.push(3, {}));
  Record record;
  ASSERT_TRUE(ring.front(&record));
  EXPECT_EQ(text(record), std::string(24, 'a'));
  ring.pop();
  ASSERT_TRUE(ring.push(3, {bytes("c")}));
  ASSERT_TRUE(ring.front(&record));
  EXPECT_EQ(text(record), std::string(24, 'b'));
}

// Lengths that meet the ring's end in every way.
TEST(RecordRing, RandomRecordsComeBackAsTheyWentIn) {
  std::mt19937_64 random(7);
  RecordRing ring(512);
  std::deque<std::string> expected;
  int refused = 0;
  for (int i = 0; i < 20'000; ++i) {
    const std::string sent(random() % 150, static_cast<char>('a' + i % 26));
    if (ring.push(static_cast<std::uint32_t>(sent.size()), {bytes(sent)}))
      expected.push_back(sent);
    else
      ++refused;
    for (Record record; random() % 3 != 0 && ring.front(&record); ring.pop()) {
      ASSERT_FALSE(expected.empty());
      ASSERT_EQ(text(record), expected.front());
      ASSERT_EQ(record.kind, expected.front().size());
      expected.pop_front();
    }
  }
  EXPECT_GT(refused, 100);
  EXPECT_LT(refused, 15'000);
}

TEST(RecordRing, TwoThreadsLoseNothingThatWasAccepted) {
  constexpr int kRecords = 50'000;
  RecordRing ring(4096);
  std::thread reader([&ring] {
    int expected = 0;
    while (expected < kRecords) {
      Record record;
      if (!ring.front(&record)) {
        std::this_thread::yield();
        continue;
      }
      ASSERT_EQ(text(record), std::to_string(expected));
      ring.pop();
      ++expected;
    }
  });
  for (int i = 0; i < kRecords; ++i)
    while (!ring.push(0, {bytes(std::to_string(i))})) std::this_thread::yield();
  reader.join();
}

}  // namespace
}  // namespace farpoint::daemon
