// Images on their way from capture to tracking: the newest few, in memory allocated at start.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "daemon/input/frame_source.h"
#include "ipc/image_codec.h"

namespace farpoint::daemon {

// One decoded image and what is known of it.
struct CapturedImage {
  ipc::GreyImage image;
  std::int64_t utime = 0;
  std::int64_t sequence = 0;
  std::int32_t exposure_us = -1;    // -1 unknown
  float gain = -1.0F;               // -1 unknown
  InputCounts in;                   // when it was read
  std::int64_t frames_dropped = 0;  // when it was queued
  double due_s = 0;                 // steady clock
  double decode_cpu_ms = -1.0, decode_wall_ms = -1.0;
  double progress = -1.0;  // of the source, as FrameSource::progress()
};

// A ring between two threads in which the newest wins: where it is full, the oldest waiting image gives way
// and is counted. Neither side waits.
class ImageQueue {
 public:
  // So many images may wait.
  ImageQueue(std::size_t capacity, int width_px, int height_px);

  // Capture. The image to fill; it is nobody else's until push().
  [[nodiscard]] CapturedImage* begin_push();
  void push();
  // No more will come.
  void close() { closed_.store(true, std::memory_order_release); }

  // Tracking. The oldest image that waits, null where none does; it is the caller's until give_back().
  [[nodiscard]] CapturedImage* pop();
  void give_back(CapturedImage* image);

  // Anyone.
  [[nodiscard]] bool is_closed() const { return closed_.load(std::memory_order_acquire); }
  [[nodiscard]] std::size_t waiting() const;
  [[nodiscard]] std::int64_t pushed() const {
    return static_cast<std::int64_t>(head_.load(std::memory_order_acquire));
  }
  [[nodiscard]] std::int64_t dropped() const { return dropped_.load(std::memory_order_acquire); }
  [[nodiscard]] std::size_t bytes() const;

 private:
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  struct Slot {
    CapturedImage image;
    std::atomic<bool> used{false};
  };
  // Takes the oldest entry; both threads may. kNone where there is none.
  std::uint32_t take_oldest();

  std::vector<Slot> slots_;  // those that wait, the one being filled, the one being tracked
  std::vector<std::atomic<std::uint32_t>> ring_;
  std::atomic<std::uint64_t> head_{0};  // images pushed; capture's
  std::atomic<std::uint64_t> tail_{0};  // images popped or dropped
  std::atomic<std::int64_t> dropped_{0};
  std::atomic<bool> closed_{false};
  std::uint32_t filling_ = kNone;
};

}  // namespace farpoint::daemon
