// SPDX-License-Identifier: Apache-2.0
// A fixed ring of records of any length between two threads; neither waits.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <vector>

namespace farpoint::daemon {

struct Record {
  std::uint32_t kind = 0;
  std::span<const std::uint8_t> bytes;  // in one piece
};

class RecordRing {
 public:
  using Parts = std::initializer_list<std::span<const std::uint8_t>>;

  // Allocates and touches `bytes`, rounded up to 8.
  explicit RecordRing(std::size_t bytes);

  // Pushing thread: a record made of the parts in order. False where there is no room; nothing is changed
  // then. No heap call.
  [[nodiscard]] bool push(std::uint32_t kind, Parts parts);

  // Popping thread: the oldest record, valid until pop(). False where there is none.
  [[nodiscard]] bool front(Record* record);
  void pop();

  [[nodiscard]] std::size_t capacity() const { return memory_.size(); }

 private:
  struct Head {
    std::uint32_t bytes = 0;  // of the record
    std::uint32_t kind = 0;
  };
  // Follows no record: the next one begins at the ring's start.
  static constexpr std::uint32_t kWrap = 0xFFFFFFFFU;
  static constexpr std::size_t kCacheLine = 64;

  [[nodiscard]] Head head_at(std::uint64_t position) const;
  void write_head(std::uint64_t position, const Head& head);
  [[nodiscard]] std::size_t to_end(std::uint64_t position) const {
    return memory_.size() - position % memory_.size();
  }

  std::vector<std::uint8_t> memory_;
  // Bytes since the start, multiples of 8.
  alignas(kCacheLine) std::atomic<std::uint64_t> pushed_{0};
  alignas(kCacheLine) std::atomic<std::uint64_t> popped_{0};
};

}  // namespace farpoint::daemon
