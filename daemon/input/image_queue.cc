// SPDX-License-Identifier: Apache-2.0
#include "daemon/input/image_queue.h"

namespace farpoint::daemon {

ImageQueue::ImageQueue(std::size_t capacity, int width_px, int height_px, std::size_t second_pixels)
    : slots_(capacity + 2), ring_(capacity) {
  const std::size_t pixels = static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  for (Slot& slot : slots_) {
    slot.image.image = {width_px, height_px, std::vector<std::uint8_t>(pixels, 0)};
    slot.image.second.pixels.reserve(second_pixels);
  }
}

CapturedImage* ImageQueue::begin_push() {
  if (filling_ != kNone) return &slots_[filling_].image;
  // One is always free: all that wait and the one being tracked leave one over.
  for (std::uint32_t i = 0; i < slots_.size(); ++i) {
    if (slots_[i].used.load(std::memory_order_acquire)) continue;
    slots_[i].used.store(true, std::memory_order_relaxed);
    filling_ = i;
    return &slots_[i].image;
  }
  return nullptr;
}

void ImageQueue::push() {
  const std::uint64_t head = head_.load(std::memory_order_relaxed);
  if (head - tail_.load(std::memory_order_acquire) == ring_.size()) {
    if (const std::uint32_t oldest = take_oldest(); oldest != kNone) {
      slots_[oldest].used.store(false, std::memory_order_relaxed);
      dropped_.fetch_add(1, std::memory_order_release);
    }
  }
  slots_[filling_].image.frames_dropped = dropped_.load(std::memory_order_relaxed);
  ring_[head % ring_.size()].store(filling_, std::memory_order_relaxed);
  filling_ = kNone;
  head_.store(head + 1, std::memory_order_release);
}

std::uint32_t ImageQueue::take_oldest() {
  std::uint64_t tail = tail_.load(std::memory_order_acquire);
  while (tail != head_.load(std::memory_order_acquire)) {
    // Where capture has replaced this entry in the meantime, the tail has moved and the exchange fails.
    const std::uint32_t slot = ring_[tail % ring_.size()].load(std::memory_order_relaxed);
    if (tail_.compare_exchange_weak(tail, tail + 1, std::memory_order_acq_rel)) return slot;
  }
  return kNone;
}

CapturedImage* ImageQueue::pop() {
  const std::uint32_t slot = take_oldest();
  return slot == kNone ? nullptr : &slots_[slot].image;
}

void ImageQueue::give_back(CapturedImage* image) {
  for (Slot& slot : slots_)
    if (&slot.image == image) slot.used.store(false, std::memory_order_release);
}

std::size_t ImageQueue::waiting() const {
  const std::uint64_t tail = tail_.load(std::memory_order_acquire);
  return static_cast<std::size_t>(head_.load(std::memory_order_acquire) - tail);
}

std::size_t ImageQueue::bytes() const {
  const CapturedImage& one = slots_.front().image;
  return slots_.size() * (sizeof(Slot) + one.image.pixels.capacity() + one.second.pixels.capacity());
}

}  // namespace farpoint::daemon
