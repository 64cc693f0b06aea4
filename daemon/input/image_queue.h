// SPDX-License-Identifier: Apache-2.0
// Queue of images from capture to tracking: the newest N, in memory allocated at start.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "daemon/input/camera_note.h"
#include "daemon/input/frame_source.h"
#include "ipc/image_codec.h"

namespace farpoint::daemon {

// One decoded image and its data.
struct CapturedImage {
  ipc::GreyImage image;
  ipc::GreyImage second;  // the second camera's; in use with has_second only
  bool has_second = false;
  drivers::CameraFrame meta;
  InputCounts in;                   // at the time of reading
  CameraNote camera;                // live
  std::int64_t frames_dropped = 0;  // at the time of queueing
  double due_s = 0;                 // steady clock
  double decode_cpu_ms = -1.0, decode_wall_ms = -1.0;
  double progress = -1.0;  // of the source, as FrameSource::progress()
};

// A ring between two threads in which the newest images win: a full ring drops and counts the oldest waiting
// image. Neither side waits.
class ImageQueue {
 public:
  // `capacity`: images that wait at most. `second_pixels`: of a second camera's images; 0: there is none.
  ImageQueue(std::size_t capacity, int width_px, int height_px, std::size_t second_pixels = 0);

  // Capture: returns the image to fill, owned by the caller until push().
  [[nodiscard]] CapturedImage* begin_push();
  void push();
  // Capture: no image follows.
  void close() { closed_.store(true, std::memory_order_release); }

  // Tracking: returns the oldest waiting image, null without one; owned by the caller until give_back().
  [[nodiscard]] CapturedImage* pop();
  void give_back(CapturedImage* image);

  // Any thread.
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
  // Takes the oldest entry; both threads may call it. kNone without one.
  std::uint32_t take_oldest();

  std::vector<Slot> slots_;  // waiting images, the one being filled, the one being tracked
  std::vector<std::atomic<std::uint32_t>> ring_;
  std::atomic<std::uint64_t> head_{0};  // images pushed; capture's
  std::atomic<std::uint64_t> tail_{0};  // images popped or dropped
  std::atomic<std::int64_t> dropped_{0};
  std::atomic<bool> closed_{false};
  std::uint32_t filling_ = kNone;
};

}  // namespace farpoint::daemon
