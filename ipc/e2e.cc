// SPDX-License-Identifier: Apache-2.0
#include "ipc/e2e.h"

#include <cstddef>

namespace farpoint::ipc {
namespace {

constexpr std::uint8_t kPolynomial = 0x1d;

constexpr std::array<std::uint8_t, 256> make_table() {
  std::array<std::uint8_t, 256> table{};
  for (std::size_t i = 0; i < table.size(); ++i) {
    unsigned crc = static_cast<unsigned>(i);
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 0x80U) != 0 ? (crc << 1) ^ kPolynomial : crc << 1;
    table[i] = static_cast<std::uint8_t>(crc);
  }
  return table;
}

constexpr std::array<std::uint8_t, 256> kTable = make_table();

std::uint8_t step(std::uint8_t crc, unsigned byte) {
  return kTable[(crc ^ byte) & 0xffU];
}

constexpr std::uint16_t kPolynomial5 = 0x1021;

constexpr std::array<std::uint16_t, 256> make_table5() {
  std::array<std::uint16_t, 256> table{};
  for (std::size_t i = 0; i < table.size(); ++i) {
    unsigned crc = static_cast<unsigned>(i) << 8;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 0x8000U) != 0 ? (crc << 1) ^ kPolynomial5 : crc << 1;
    table[i] = static_cast<std::uint16_t>(crc);
  }
  return table;
}

constexpr std::array<std::uint16_t, 256> kTable5 = make_table5();

std::uint16_t step5(std::uint16_t crc, unsigned byte) {
  return static_cast<std::uint16_t>((static_cast<unsigned>(crc) << 8) ^ kTable5[(crc >> 8 ^ byte) & 0xffU]);
}

}  // namespace

std::uint8_t e2e_crc(const CanFrame& frame, std::uint16_t data_id) {
  std::uint8_t crc = step(0, data_id & 0xffU);
  crc = step(crc, static_cast<unsigned>(data_id) >> 8);
  for (std::size_t i = 1; i < frame.size; ++i) crc = step(crc, frame.data[i]);
  return crc;
}

void e2e_protect(CanFrame* frame, std::uint16_t data_id, std::uint8_t counter) {
  frame->data[1] = static_cast<std::uint8_t>((frame->data[1] & 0xf0U) | (counter & 0x0fU));
  frame->data[0] = e2e_crc(*frame, data_id);
}

std::uint16_t e2e5_crc(const CanFrame& frame, std::uint16_t data_id) {
  std::uint16_t crc = 0xffff;
  for (std::size_t i = 2; i < frame.size; ++i) crc = step5(crc, frame.data[i]);
  crc = step5(crc, data_id & 0xffU);
  return step5(crc, static_cast<unsigned>(data_id) >> 8);
}

void e2e5_protect(CanFrame* frame, std::uint16_t data_id, std::uint8_t counter) {
  frame->data[2] = counter;
  const std::uint16_t crc = e2e5_crc(*frame, data_id);
  frame->data[0] = static_cast<std::uint8_t>(crc & 0xffU);
  frame->data[1] = static_cast<std::uint8_t>(crc >> 8);
}

E2eStatus E2eChecker::check(const CanFrame& frame) {
  if (frame.size < 2 || frame.size > frame.data.size()) return E2eStatus::kWrongCrc;
  const int counter = frame.data[1] & 0x0f;
  if (counter >= kE2eCounterEnd || frame.data[0] != e2e_crc(frame, data_id_)) return E2eStatus::kWrongCrc;
  const int last = last_;
  last_ = counter;
  if (last < 0 || counter == e2e_next(static_cast<std::uint8_t>(last))) return E2eStatus::kOk;
  return counter == last ? E2eStatus::kRepeated : E2eStatus::kSomeLost;
}

}  // namespace farpoint::ipc
