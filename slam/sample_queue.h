// SPDX-License-Identifier: Apache-2.0
// Samples of one sensor on their way from the caller's thread to tracking, and the newest ones kept for
// fusion. All memory is allocated at the start; neither thread waits.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "slam/frame_result.h"
#include "slam/spsc_ring.h"

namespace farpoint::slam {

// The newest samples, ascending in time. A full history overwrites its oldest sample.
template <typename Sample>
class SampleHistory {
 public:
  explicit SampleHistory(std::size_t capacity) : samples_(capacity) {}

  void push(const Sample& sample) {
    samples_[pushed_ % samples_.size()] = sample;
    ++pushed_;
  }
  [[nodiscard]] std::size_t size() const {
    return pushed_ < samples_.size() ? static_cast<std::size_t>(pushed_) : samples_.size();
  }
  // 0: the oldest. Precondition: index < size().
  [[nodiscard]] const Sample& operator[](std::size_t index) const {
    return samples_[(pushed_ - size() + index) % samples_.size()];
  }
  [[nodiscard]] std::size_t capacity() const { return samples_.size(); }

 private:
  std::vector<Sample> samples_;
  std::uint64_t pushed_ = 0;
};

template <typename Sample>
class SampleQueue {
 public:
  // `waiting`: samples that may wait for a frame. `kept`: samples of the history.
  SampleQueue(std::size_t waiting, std::size_t kept) : ring_(waiting), history_(kept) {}

  // The caller's thread, one a sensor. False where the ring is full: the sample is dropped and counted.
  bool add(const Sample& sample) {
    if (ring_.push(sample)) return true;
    dropped_.fetch_add(1, std::memory_order_relaxed);
    return false;
  }

  // Tracking's thread, once a frame: takes what came, in order, up to the frame's time and until `most`
  // samples have been taken since the start. Late samples are counted, not kept.
  void take_until(std::int64_t frame_utime, std::uint64_t most) {
    while (counts_.taken() < most) {
      const Sample* sample = ring_.front();
      if (sample == nullptr || sample->utime > frame_utime) break;
      if (sample->utime > newest_utime_ && sample->utime > last_frame_utime_) {
        newest_utime_ = sample->utime;
        history_.push(*sample);
        ++counts_.used;
      } else {
        ++counts_.late;
      }
      ring_.pop();
    }
    last_frame_utime_ = frame_utime;
  }

  // Tracking's thread.
  [[nodiscard]] const SampleHistory<Sample>& history() const { return history_; }
  [[nodiscard]] SampleCounts counts() const {
    SampleCounts counts = counts_;
    counts.dropped = dropped_.load(std::memory_order_relaxed);
    return counts;
  }
  [[nodiscard]] std::size_t bytes() const {
    return (ring_.capacity() + history_.capacity()) * sizeof(Sample);
  }

 private:
  static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::min();
  SpscRing<Sample> ring_;
  std::atomic<std::uint64_t> dropped_{0};
  SampleHistory<Sample> history_;
  SampleCounts counts_;
  std::int64_t newest_utime_ = kNever, last_frame_utime_ = kNever;
};

}  // namespace farpoint::slam
