// SPDX-License-Identifier: Apache-2.0
// Decoded images of one camera that wait for their partners: a ring of fixed capacity, oldest first.
// Buffers stay in the ring or are swapped: after reserve() nothing is allocated for images of that size.
#pragma once

#include <array>
#include <cstddef>
#include <utility>

#include "daemon/input/frame_source.h"
#include "ipc/image_codec.h"

namespace farpoint::daemon {

class WaitingImages {
 public:
  static constexpr std::size_t kCapacity = 4;

  void reserve(std::size_t pixels) {
    for (Slot& slot : slots_) slot.image.pixels.reserve(pixels);
  }
  [[nodiscard]] bool empty() const { return size_ == 0; }
  [[nodiscard]] std::size_t size() const { return size_; }
  // Precondition: not empty.
  [[nodiscard]] const drivers::CameraFrame& front() const { return slots_[first_].meta; }

  // Takes the image by swap. A full ring gives up its oldest image.
  void push(const drivers::CameraFrame& meta, ipc::GreyImage* image) {
    if (size_ == kCapacity) drop();
    Slot& slot = slots_[(first_ + size_) % kCapacity];
    slot.meta = meta;
    std::swap(slot.image, *image);
    ++size_;
  }
  // Gives the oldest image by swap. Precondition: not empty.
  void pop(ipc::GreyImage* image) {
    std::swap(slots_[first_].image, *image);
    drop();
  }
  // Precondition: not empty.
  void drop() {
    --size_;
    first_ = size_ == 0 ? 0 : (first_ + 1) % kCapacity;  // an empty ring starts anew: fewer buffers in use
  }

 private:
  struct Slot {
    drivers::CameraFrame meta;
    ipc::GreyImage image;
  };
  std::array<Slot, kCapacity> slots_;
  std::size_t first_ = 0, size_ = 0;
};

}  // namespace farpoint::daemon
