// SPDX-License-Identifier: Apache-2.0
// Passes finished requests, and the removal of the camera, from libcamera's thread to the capture thread.
//
// A fixed ring: it holds each request at most once, so it cannot overflow. push() does not wait; the capture
// thread waits until fd() is readable.
#pragma once

#include <sys/eventfd.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdint>

namespace farpoint::drivers {

class FinishedRequests {
 public:
  static constexpr std::uint32_t kMaxRequests = 16;

  FinishedRequests() : fd_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC | EFD_SEMAPHORE)) {}
  ~FinishedRequests() { close(fd_); }
  FinishedRequests(const FinishedRequests&) = delete;
  FinishedRequests& operator=(const FinishedRequests&) = delete;

  // libcamera's thread. Returns false without storing when a request breaks the ring's bounds.
  bool push(std::uint32_t request) {
    const std::uint32_t end = end_.load(std::memory_order_relaxed);
    if (request >= kMaxRequests || end - begin_.load(std::memory_order_acquire) >= kMaxRequests) return false;
    ring_.at(end % kMaxRequests) = request;
    end_.store(end + 1, std::memory_order_release);
    wake();
    return true;
  }
  // libcamera's thread.
  void set_removed() {
    removed_.store(true, std::memory_order_release);
    wake();
  }

  // Capture thread, all below. Readable while the ring holds a request or a removal.
  [[nodiscard]] int fd() const { return fd_; }
  [[nodiscard]] bool was_removed() const { return removed_.load(std::memory_order_acquire); }
  // Takes the oldest request; false without one.
  [[nodiscard]] bool take(std::uint32_t* request) {
    std::uint64_t one = 0;
    if (read(fd_, &one, sizeof one) < 0) return false;
    const std::uint32_t begin = begin_.load(std::memory_order_relaxed);
    if (begin == end_.load(std::memory_order_acquire)) return false;
    *request = ring_.at(begin % kMaxRequests);
    begin_.store(begin + 1, std::memory_order_release);
    return true;
  }
  // Only while no thread can push.
  void clear() {
    for (std::uint64_t one = 0; read(fd_, &one, sizeof one) > 0;) continue;
    begin_.store(end_.load());
    removed_.store(false);
  }

 private:
  // The descriptor counts one for each entry. It is non-blocking and cannot overflow.
  void wake() {
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t written = write(fd_, &one, sizeof one);
  }

  int fd_;
  std::array<std::uint32_t, kMaxRequests> ring_{};
  std::atomic<std::uint32_t> begin_{0}, end_{0};
  std::atomic<bool> removed_{false};
};

}  // namespace farpoint::drivers
