// SPDX-License-Identifier: Apache-2.0
// Wheel speeds from the vehicle's bus, on a thread of their own and a socket of their own.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>

#include "daemon/input/measurement_feed.h"
#include "daemon/input/recorder.h"
#include "drivers/can/socketcan.h"
#include "drivers/can/wheel_reader.h"
#include "slam/spsc_ring.h"

namespace farpoint::daemon {

class WheelSource {
 public:
  static constexpr const char* kThread = "fp-wheels";

  WheelSource(std::unique_ptr<drivers::SocketCan> bus, drivers::WheelReader reader);

  // Before the thread: gives each measurement to the estimator too.
  void feed(slam::Estimator* estimator, const slam::WheelConfig& config) { feed_.emplace(estimator, config); }
  // Any thread: each measurement from now on is recorded too.
  void record_to(Recorder* recorder) { recorder_.store(recorder, std::memory_order_release); }
  // The thread: reads until stop(). Waits for a frame in poll(), nowhere else.
  void run();
  // Any thread.
  void stop() { stop_.store(true, std::memory_order_relaxed); }

  // One other thread: the oldest measurement not popped, null where there is none. Times are of the steady
  // clock, from when the frame arrived.
  [[nodiscard]] const wheels_t* front() { return ring_.front(); }
  void pop() { ring_.pop(); }
  // Any thread: frames that were asked for.
  [[nodiscard]] std::int64_t received() const { return received_.load(std::memory_order_relaxed); }

 private:
  static constexpr std::size_t kWaiting = 64;  // measurements; when full the new ones are left out

  void wait_for_frame() const;
  void read_all();
  void give(const wheels_t& message);

  std::unique_ptr<drivers::SocketCan> bus_;
  drivers::WheelReader reader_;
  slam::SpscRing<wheels_t> ring_;
  wheels_t spare_;  // where the ring is full
  std::optional<MeasurementFeed> feed_;
  std::atomic<Recorder*> recorder_{nullptr};
  std::atomic<bool> stop_{false};
  std::atomic<std::int64_t> received_{0};
};

}  // namespace farpoint::daemon
