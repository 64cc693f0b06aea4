// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/can_bus.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <utility>

#include "daemon/system/stage_clock.h"

namespace farpoint::daemon {
namespace {

constexpr double kMaintainEvery_s = 1.0;
// How often tick() looks for the confirmation of a status frame; at 500 kbit/s it takes 0.25 ms.
constexpr double kLookEvery_s = 0.0003;

std::int64_t micros(double time_s) {
  return std::llround(1e6 * time_s);
}

}  // namespace

CanBus::CanBus(const ipc::CanLayout& layout, const EpochOptions& options)
    : predictor_(options), encoder_(layout), period_s_(1.0 / layout.rate_hz), logged_(kLogged) {}

CanBus::~CanBus() {
  farewell();
}

void CanBus::on_frame(const FrameOutput& frame) {
  const double at_s = frame.age_at_s > 0.0 ? frame.age_at_s : steady_s();
  predictor_.take(frame, micros(at_s) - frame.age_us);
}

void CanBus::tick(double now_s) {
  if (next_epoch_s_ <= 0.0) next_epoch_s_ = now_s;
  maintain(now_s);
  const bool is_due = now_s >= next_epoch_s_;
  if (is_due || waits_for_confirmation()) take_confirmations(now_s);
  if (is_due)
    begin_epoch(now_s);
  else
    send_next(now_s);
  look_s_ = waits_for_confirmation() ? now_s + kLookEvery_s : kNever_s;
}

double CanBus::next_due_s() const {
  return std::min(next_epoch_s_, look_s_);
}

void CanBus::maintain(double now_s) {
  if (!bus_ || now_s < next_maintenance_s_) return;
  next_maintenance_s_ = now_s + kMaintainEvery_s;
  bus_->maintain();
}

void CanBus::take_confirmations(double now_s) {
  if (!bus_) return;
  ipc::CanFrame frame;
  std::int64_t age_us = 0;
  while (bus_->take_confirmed(&frame, &age_us)) note(frame, now_s, age_us);
}

void CanBus::begin_epoch(double now_s) {
  // What came late by whole periods is left out: no burst follows.
  next_epoch_s_ += period_s_ * (1.0 + std::floor((now_s - next_epoch_s_) / period_s_));
  leave_rest_out();
  if (bus_ && bus_->in_flight() > 0) {
    left_out_ += static_cast<std::int64_t>(encoder_.layout().most_frames());
    return;
  }
  epoch_ = encoder_.encode(predictor_.at(micros(now_s)));
  sent_ = 0;
  send_next(now_s);
}

// The status frame, or where it is confirmed the others.
void CanBus::send_next(double now_s) {
  if (sent_ == epoch_.size() || waits_for_confirmation()) return;
  const bool step_by_step = bus_ && bus_->confirms();
  const auto part = step_by_step && sent_ == 0 ? epoch_.frames().first(1) : epoch_.frames().subspan(sent_);
  sent_ += part.size();
  for (const ipc::CanFrame& frame : part) {
    const bool is_taken = !bus_ || bus_->send({&frame, 1});
    if (is_taken && !step_by_step) note(frame, now_s, 0);
    if (!is_taken) {
      leave_rest_out();
      return;
    }
  }
}

bool CanBus::waits_for_confirmation() const {
  return bus_ && sent_ > 0 && sent_ < epoch_.size() && bus_->in_flight() > 0;
}

void CanBus::leave_rest_out() {
  left_out_ += static_cast<std::int64_t>(epoch_.size() - sent_);
  sent_ = epoch_.size();
}

void CanBus::note(const ipc::CanFrame& frame, double now_s, std::int64_t age_us) {
  if (log_.get() == nullptr) return;
  if (Logged* slot = logged_.begin_push()) {
    *slot = {micros(now_s) - age_us, frame};
    logged_.end_push();
  } else {
    ++not_logged_;
  }
}

// --- the thread of the files

void CanBus::write_log() {
  ipc::CandumpWriter* log = log_.get();
  if (log == nullptr) return;
  while (const Logged* logged = logged_.front()) {
    log->write(logged->utime, {&logged->frame, 1});
    logged_.pop();
  }
}

// --- the calling thread

// Waits until nothing is in flight; false where something still is.
bool CanBus::settle(double limit_s) {
  constexpr timespec kPause{0, 1'000'000};
  const double end_s = steady_s() + limit_s;
  while (bus_) {
    take_confirmations(steady_s());
    if (bus_->in_flight() == 0) break;
    if (steady_s() > end_s) return false;
    clock_nanosleep(CLOCK_MONOTONIC, 0, &kPause, nullptr);
  }
  return true;
}

void CanBus::farewell() {
  constexpr double kLimit_s = 0.1;
  if (said_farewell_ || next_epoch_s_ <= 0.0) return;
  said_farewell_ = true;
  leave_rest_out();
  if (!settle(kLimit_s)) return;
  const double now_s = steady_s();
  epoch_ = encoder_.encode(predictor_.farewell(micros(now_s)));
  sent_ = 0;
  send_next(now_s);
  if (settle(kLimit_s)) send_next(steady_s());
  (void)settle(kLimit_s);
}

void CanBus::close() {
  farewell();
  write_log();
  if (ipc::CandumpWriter* log = log_.get()) log->close();
}

std::int64_t CanBus::errors() const {
  return left_out_ + (bus_ ? static_cast<std::int64_t>(bus_->counts().not_sent) : 0);
}

}  // namespace farpoint::daemon
