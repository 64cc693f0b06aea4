// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/can_replay.h"

#include <cmath>

namespace farpoint::daemon {

void CanReplay::on_frame(const FrameOutput& frame) {
  const std::int64_t utime = frame.result.utime;
  if (utime < 0) {
    ++not_logged_;
    return;
  }
  const std::int64_t there_us = utime + frame.age_us;
  // A damaged time may be years away.
  constexpr std::int64_t kLongestGap_us = 60'000'000;
  if (!started_ || there_us > next_us() + kLongestGap_us || there_us < next_us() - kLongestGap_us) {
    started_ = true;
    start_us_ = there_us;
    epochs_ = 0;
  }
  send_until(there_us);
  predictor_.take(frame, utime);
}

std::int64_t CanReplay::next_us() const {
  return start_us_ + std::llround(1e6 * static_cast<double>(epochs_) / encoder_.layout().rate_hz);
}

void CanReplay::send_until(std::int64_t end_us) {
  while (next_us() < end_us) send(predictor_.at(next_us()), next_us());
}

void CanReplay::send(const ipc::OdometryEpoch& epoch, std::int64_t utime) {
  ++epochs_;
  const ipc::CanEpoch frames = encoder_.encode(epoch);
  if (log_) log_->write(utime, frames.frames());
  if (bus_) bus_->send(frames.frames());
}

void CanReplay::close() {
  if (started_) {
    send(predictor_.at(next_us()), next_us());
    send(predictor_.farewell(next_us()), next_us());
    started_ = false;
  }
  if (log_) log_->close();
}

std::int64_t CanReplay::errors() const {
  return not_logged_ + (bus_ ? static_cast<std::int64_t>(bus_->counts().not_sent) : 0);
}

}  // namespace farpoint::daemon
