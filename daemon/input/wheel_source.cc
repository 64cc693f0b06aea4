// SPDX-License-Identifier: Apache-2.0
#include "daemon/input/wheel_source.h"

#include <poll.h>

#include <cmath>
#include <utility>

#include "daemon/system/stage_clock.h"

namespace farpoint::daemon {
WheelSource::WheelSource(std::unique_ptr<drivers::SocketCan> bus, drivers::WheelReader reader)
    : bus_(std::move(bus)),
      reader_(std::move(reader)),
      ring_(kWaiting, drivers::wheels_with_room()),
      spare_(drivers::wheels_with_room()) {}

void WheelSource::run() {
  constexpr double kMaintainEvery_s = 1.0;
  double next_maintenance_s = 0.0;
  while (!stop_.load(std::memory_order_relaxed)) {
    if (const double now_s = steady_s(); now_s >= next_maintenance_s) {
      next_maintenance_s = now_s + kMaintainEvery_s;
      bus_->maintain();
    }
    wait_for_frame();
    read_all();
  }
}

// An interface that is away has no descriptor: poll() then only waits.
void WheelSource::wait_for_frame() const {
  constexpr int kLongest_ms = 100;
  pollfd waited{bus_->fd(), POLLIN, 0};
  (void)poll(&waited, 1, kLongest_ms);
}

void WheelSource::read_all() {
  ipc::CanFrame frame;
  std::int64_t age_us = 0;
  while (bus_->receive(&frame, &age_us)) {
    received_.fetch_add(1, std::memory_order_relaxed);
    const auto utime = static_cast<std::int64_t>(std::llround(1e6 * steady_s())) - age_us;
    wheels_t* slot = ring_.begin_push();
    wheels_t* message = slot != nullptr ? slot : &spare_;
    if (!reader_.take(frame, utime, message)) continue;
    give(*message);
    if (slot != nullptr) ring_.end_push();
  }
}

void WheelSource::give(const wheels_t& message) {
  if (feed_) feed_->add(message);
  if (Recorder* recorder = recorder_.load(std::memory_order_acquire)) recorder->offer(message);
}

}  // namespace farpoint::daemon
