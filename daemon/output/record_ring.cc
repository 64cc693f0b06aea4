// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/record_ring.h"

#include <algorithm>
#include <cstring>

namespace farpoint::daemon {
namespace {

// Every record begins at a multiple of it, so that a head always fits before the ring's end.
constexpr std::size_t kAlign = 8;

std::size_t rounded(std::size_t bytes) {
  return (bytes + kAlign - 1) / kAlign * kAlign;
}

}  // namespace

RecordRing::RecordRing(std::size_t bytes) : memory_(std::max(rounded(bytes), 2 * kAlign), 0) {
  static_assert(sizeof(Head) == kAlign);
}

bool RecordRing::push(std::uint32_t kind, Parts parts) {
  std::size_t bytes = 0;
  for (const auto part : parts) bytes += part.size();
  const std::size_t needed = sizeof(Head) + rounded(bytes);
  if (needed > memory_.size()) return false;
  std::uint64_t begin = pushed_.load(std::memory_order_relaxed);
  const std::size_t left = to_end(begin);
  const std::size_t skipped = needed > left ? left : 0;
  if (begin + skipped + needed - popped_.load(std::memory_order_acquire) > memory_.size()) return false;
  if (skipped > 0) write_head(begin, {0, kWrap});
  begin += skipped;
  write_head(begin, {static_cast<std::uint32_t>(bytes), kind});
  std::uint8_t* to = memory_.data() + begin % memory_.size() + sizeof(Head);
  for (const auto part : parts) to = std::copy(part.begin(), part.end(), to);
  pushed_.store(begin + needed, std::memory_order_release);
  return true;
}

bool RecordRing::front(Record* record) {
  std::uint64_t at = popped_.load(std::memory_order_relaxed);
  if (pushed_.load(std::memory_order_acquire) == at) return false;
  Head head = head_at(at);
  if (head.kind == kWrap) {
    at += to_end(at);
    popped_.store(at, std::memory_order_release);
    head = head_at(at);
  }
  record->kind = head.kind;
  record->bytes = {memory_.data() + at % memory_.size() + sizeof(Head), head.bytes};
  return true;
}

void RecordRing::pop() {
  const std::uint64_t at = popped_.load(std::memory_order_relaxed);
  popped_.store(at + sizeof(Head) + rounded(head_at(at).bytes), std::memory_order_release);
}

RecordRing::Head RecordRing::head_at(std::uint64_t position) const {
  Head head;
  std::memcpy(&head, memory_.data() + position % memory_.size(), sizeof head);
  return head;
}

void RecordRing::write_head(std::uint64_t position, const Head& head) {
  std::memcpy(memory_.data() + position % memory_.size(), &head, sizeof head);
}

}  // namespace farpoint::daemon
