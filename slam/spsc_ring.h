// SPDX-License-Identifier: Apache-2.0
// A fixed ring between two threads: one pushes, one pops, neither waits.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace farpoint::slam {

// Slots are made once and used in place, so that what they own (vectors, buffers) keeps its memory.
template <typename T>
class SpscRing {
 public:
  template <typename... Arguments>
  explicit SpscRing(std::size_t capacity, const Arguments&... arguments) {
    slots_.reserve(capacity);
    for (std::size_t i = 0; i < capacity; ++i) slots_.emplace_back(arguments...);
  }

  // Pushing thread: the slot to fill, as its last user left it, then end_push(). Null where the ring is full.
  [[nodiscard]] T* begin_push() {
    const std::uint64_t pushed = pushed_.load(std::memory_order_relaxed);
    if (pushed - popped_.load(std::memory_order_acquire) == slots_.size()) return nullptr;
    return &slots_[pushed % slots_.size()];
  }
  void end_push() { pushed_.store(pushed_.load(std::memory_order_relaxed) + 1, std::memory_order_release); }
  // The same for values; false where the ring is full.
  [[nodiscard]] bool push(const T& value) {
    T* slot = begin_push();
    if (slot == nullptr) return false;
    *slot = value;
    end_push();
    return true;
  }

  // Popping thread: the oldest slot, to be read in place, then pop(). Null where the ring is empty.
  [[nodiscard]] T* front() {
    const std::uint64_t popped = popped_.load(std::memory_order_relaxed);
    if (pushed_.load(std::memory_order_acquire) == popped) return nullptr;
    return &slots_[popped % slots_.size()];
  }
  void pop() { popped_.store(popped_.load(std::memory_order_relaxed) + 1, std::memory_order_release); }

  // Either thread; a moment later it may be another number.
  [[nodiscard]] std::size_t size() const {
    const std::uint64_t popped = popped_.load(std::memory_order_acquire);
    return static_cast<std::size_t>(pushed_.load(std::memory_order_acquire) - popped);
  }
  [[nodiscard]] std::size_t capacity() const { return slots_.size(); }
  // One of the slots, for its size. Only while no thread uses the ring.
  [[nodiscard]] const T& sample() const { return slots_.front(); }

 private:
  static constexpr std::size_t kCacheLine = 64;
  std::vector<T> slots_;
  // Counted from the start; each on a cache line of its own, as each belongs to another core.
  alignas(kCacheLine) std::atomic<std::uint64_t> pushed_{0};
  alignas(kCacheLine) std::atomic<std::uint64_t> popped_{0};
};

}  // namespace farpoint::slam
