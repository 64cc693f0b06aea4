// SPDX-License-Identifier: Apache-2.0
// Something that one thread opens, at any time, and another thread uses from then on.
#pragma once

#include <atomic>
#include <memory>
#include <utility>

namespace farpoint::daemon {

template <typename T>
class LateOpened {
 public:
  // Opening thread, once.
  void set(std::unique_ptr<T> opened) {
    owned_ = std::move(opened);
    ready_.store(owned_.get(), std::memory_order_release);
  }
  // Any thread; null before set(). The object lives as long as this one.
  [[nodiscard]] T* get() const { return ready_.load(std::memory_order_acquire); }

 private:
  std::unique_ptr<T> owned_;
  std::atomic<T*> ready_{nullptr};
};

}  // namespace farpoint::daemon
