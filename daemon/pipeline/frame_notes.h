// SPDX-License-Identifier: Apache-2.0
// Notes of published frames, from the output thread to the calling thread, which may use the heap.
#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

#include "slam/frame_result.h"
#include "slam/spsc_ring.h"

namespace farpoint::daemon {

struct FrameNote {
  slam::FrameResult published;
  bool valid = false;
  slam::EstimatorCounts counts;
  double tracking_cpu_ms = 0;
  double progress = -1.0;  // of the source
};

class FrameNotes {
 public:
  // capacity: notes that wait at most.
  explicit FrameNotes(std::size_t capacity) : ring_(capacity) {}

  // Output thread. A note without room is left out and counted.
  void push(const FrameNote& note) {
    if (!ring_.push(note)) missing_.fetch_add(1, std::memory_order_relaxed);
  }
  // Calling thread: the oldest note, null without one; in use until pop().
  [[nodiscard]] const FrameNote* front() { return ring_.front(); }
  void pop() { ring_.pop(); }

  // Any thread.
  [[nodiscard]] std::int64_t missing() const { return missing_.load(std::memory_order_relaxed); }
  [[nodiscard]] std::size_t bytes() const { return ring_.capacity() * sizeof(FrameNote); }

 private:
  slam::SpscRing<FrameNote> ring_;
  std::atomic<std::int64_t> missing_{0};
};

}  // namespace farpoint::daemon
