// SPDX-License-Identifier: Apache-2.0
#include "ipc/e2e.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

namespace farpoint::ipc {
namespace {

constexpr std::uint16_t kDataId = 0x123;

CanFrame protected_frame(std::uint8_t counter, std::array<std::uint8_t, 8> data = {}) {
  CanFrame frame;
  std::copy(data.begin(), data.end(), frame.data.begin());
  e2e_protect(&frame, kDataId, counter);
  return frame;
}

// A bit-by-bit CRC of its own, straight from the definition.
std::uint8_t slow_crc(const CanFrame& frame, std::uint16_t data_id) {
  std::vector<unsigned> bytes = {data_id & 0xffU, static_cast<unsigned>(data_id >> 8)};
  for (std::size_t i = 1; i < 8; ++i) bytes.push_back(frame.data[i]);
  unsigned remainder = 0;
  for (const unsigned byte : bytes) {
    for (int bit = 7; bit >= 0; --bit) {
      const unsigned out = (remainder >> 7) ^ ((byte >> bit) & 1U);
      remainder = (remainder << 1 & 0xffU) ^ (out != 0 ? 0x1dU : 0U);
    }
  }
  return static_cast<std::uint8_t>(remainder);
}

TEST(E2e, Vectors) {
  EXPECT_EQ(protected_frame(0).data, (std::array<std::uint8_t, 64>{0xcc, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(protected_frame(1).data, (std::array<std::uint8_t, 64>{0x91, 1, 0, 0, 0, 0, 0, 0}));
}

TEST(E2e, AgreesWithABitwiseCrc) {
  std::mt19937_64 rng(1);
  for (int i = 0; i < 2000; ++i) {
    CanFrame frame;
    for (auto& byte : frame.data) byte = static_cast<std::uint8_t>(rng());
    const auto data_id = static_cast<std::uint16_t>(rng());
    EXPECT_EQ(e2e_crc(frame, data_id), slow_crc(frame, data_id));
  }
}

TEST(E2e, TheHighNibbleOfTheCounterByteIsKept) {
  const CanFrame frame = protected_frame(9, {0, 0xa5, 1, 2, 3, 4, 5, 6});
  EXPECT_EQ(frame.data[1], 0xa9);
  EXPECT_EQ(frame.data[7], 6);
}

TEST(E2e, CounterRunsFrom0To14) {
  std::uint8_t counter = 0;
  std::set<int> seen;
  for (int i = 0; i < 15; ++i) {
    seen.insert(counter);
    counter = e2e_next(counter);
  }
  EXPECT_EQ(counter, 0);
  EXPECT_EQ(seen.size(), 15U);
  EXPECT_EQ(*seen.rbegin(), 14);
}

TEST(E2e, EveryFlippedBitIsNoticed) {
  const CanFrame good = protected_frame(3, {0, 0x70, 11, 22, 33, 44, 55, 66});
  for (unsigned bit = 0; bit < 64; ++bit) {
    CanFrame bad = good;
    bad.data[bit / 8] = static_cast<std::uint8_t>(bad.data[bit / 8] ^ (1U << (bit % 8)));
    EXPECT_EQ(E2eChecker(kDataId).check(bad), E2eStatus::kWrongCrc) << bit;
  }
  EXPECT_EQ(E2eChecker(kDataId).check(good), E2eStatus::kOk);
  EXPECT_EQ(E2eChecker(kDataId + 1).check(good), E2eStatus::kWrongCrc);
  EXPECT_EQ(E2eChecker(kDataId ^ 0x100).check(good), E2eStatus::kWrongCrc);
}

TEST(E2e, CheckerTellsLossAndRepetition) {
  E2eChecker checker(kDataId);
  EXPECT_EQ(checker.check(protected_frame(13)), E2eStatus::kOk);
  EXPECT_EQ(checker.check(protected_frame(14)), E2eStatus::kOk);
  EXPECT_EQ(checker.check(protected_frame(0)), E2eStatus::kOk);  // never 15
  EXPECT_EQ(checker.check(protected_frame(0)), E2eStatus::kRepeated);
  EXPECT_EQ(checker.check(protected_frame(5)), E2eStatus::kSomeLost);
  EXPECT_EQ(checker.check(protected_frame(15)), E2eStatus::kWrongCrc);
  CanFrame empty;
  empty.size = 0;
  EXPECT_EQ(checker.check(empty), E2eStatus::kWrongCrc);
}

TEST(E2eProfile5, Vector) {
  CanFrame frame;
  e2e5_protect(&frame, 0x1234, 0);
  EXPECT_EQ(frame.data, (std::array<std::uint8_t, 64>{0x1c, 0xca, 0, 0, 0, 0, 0, 0}));
}

// A bit-by-bit CRC of its own, straight from the definition.
std::uint16_t slow_crc5(const CanFrame& frame, std::uint16_t data_id) {
  std::vector<unsigned> bytes(frame.data.begin() + 2, frame.data.begin() + frame.size);
  bytes.push_back(data_id & 0xffU);
  bytes.push_back(static_cast<unsigned>(data_id >> 8));
  unsigned remainder = 0xffff;
  for (const unsigned byte : bytes) {
    for (int bit = 7; bit >= 0; --bit) {
      const unsigned out = (remainder >> 15) ^ ((byte >> bit) & 1U);
      remainder = (remainder << 1 & 0xffffU) ^ (out != 0 ? 0x1021U : 0U);
    }
  }
  return static_cast<std::uint16_t>(remainder);
}

TEST(E2eProfile5, AgreesWithABitwiseCrcAndWritesItLowByteFirst) {
  std::mt19937_64 rng(2);
  for (int i = 0; i < 2000; ++i) {
    CanFrame frame;
    frame.size = 64;
    for (auto& byte : frame.data) byte = static_cast<std::uint8_t>(rng());
    const auto data_id = static_cast<std::uint16_t>(rng());
    const auto counter = static_cast<std::uint8_t>(rng());
    e2e5_protect(&frame, data_id, counter);
    EXPECT_EQ(frame.data[2], counter);
    EXPECT_EQ(frame.data[0] | frame.data[1] << 8, slow_crc5(frame, data_id));
  }
}

}  // namespace
}  // namespace farpoint::ipc
