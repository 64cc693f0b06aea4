// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/mavlink_output.h"

#include <poll.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "daemon/output/extrapolation.h"
#include "daemon/system/stage_clock.h"

namespace farpoint::daemon {
namespace {

constexpr std::int64_t kSecond_us = 1'000'000, kMicro_ns = 1000;
constexpr std::int64_t kHeartbeatEvery_us = kSecond_us, kOpenEvery_us = kSecond_us;
// TIMESYNC requests: often until the autopilot's time is known.
constexpr std::int64_t kFirstRequestsEvery_us = 100'000, kRequestEvery_us = kSecond_us;
// Until stop() is seen.
constexpr std::int64_t kLongestWait_us = 50'000;
// Reads before something is sent again: a flood of bytes stops no message.
constexpr int kMostReads = 16;

std::int64_t steady_us() {
  return std::llround(1e6 * steady_s());
}

// Due times that were missed by whole periods are left out: no burst follows.
bool comes_due(std::int64_t now_us, std::int64_t period_us, std::int64_t* next_us) {
  if (now_us < *next_us) return false;
  *next_us =
      *next_us == 0 ? now_us + period_us : *next_us + period_us * (1 + (now_us - *next_us) / period_us);
  return true;
}

}  // namespace

MavlinkOutput::MavlinkOutput(const MavlinkConfig& config)
    : config_(config),
      self_{static_cast<std::uint8_t>(config.system_id), static_cast<std::uint8_t>(config.component_id)},
      period_us_(std::llround(1e6 / config.rate_hz)),
      handed_(kHanded),
      link_(drivers::MavlinkAddress::parse(config.link)) {}

void MavlinkOutput::on_frame(const FrameOutput& frame) {
  Handed* slot = handed_.begin_push();
  if (slot == nullptr) return;
  const double at_s = frame.age_at_s > 0.0 ? frame.age_at_s : steady_s();
  slot->frame = frame;
  slot->image_us = std::llround(1e6 * at_s) - frame.age_us;
  handed_.end_push();
}

MavlinkCounts MavlinkOutput::counts() const {
  constexpr auto kRelaxed = std::memory_order_relaxed;
  return {shared_.sent.load(kRelaxed),         shared_.without_scale.load(kRelaxed),
          shared_.without_pose.load(kRelaxed), shared_.send_errors.load(kRelaxed),
          shared_.received.load(kRelaxed),     shared_.round_trip_us.load(kRelaxed),
          shared_.is_open.load(kRelaxed),      shared_.failed_openings.load(kRelaxed)};
}

void MavlinkOutput::start(const RealtimeConfig& config, RealtimeReport* report) {
  thread_.emplace(kThread, config, ThreadConfig{}, report, [this] { run(); });
}

void MavlinkOutput::stop() {
  stop_.store(true, std::memory_order_relaxed);
  thread_.reset();
}

// --- the thread

void MavlinkOutput::run() {
  while (!stop_.load(std::memory_order_relaxed)) {
    open_if_due(steady_us());
    wait(steady_us());
    read_all();
    while (Handed* handed = handed_.front()) {
      // A frame without an image, as in the state no_camera, does not make the last image younger.
      if (handed->frame.result.state == slam::State::kNoCamera) handed->image_us = last_.image_us;
      std::swap(last_, *handed);
      handed_.pop();
    }
    send_due(steady_us());
    note_counts();
  }
}

void MavlinkOutput::open_if_due(std::int64_t now_us) {
  if (link_.is_open() || now_us < next_opening_us_) return;
  next_opening_us_ = now_us + kOpenEvery_us;
  const std::string problem = link_.open();
  if (problem.empty()) {
    if (!problem_.empty()) spdlog::info("MAVLink: {} is open now", config_.link);
  } else {
    shared_.failed_openings.fetch_add(1, std::memory_order_relaxed);
    if (problem != problem_) spdlog::warn("MAVLink: {}: {}; trying again", config_.link, problem);
  }
  problem_ = problem;
}

void MavlinkOutput::wait(std::int64_t now_us) {
  const std::int64_t due_us = std::min({next_odometry_us_, next_heartbeat_us_, next_request_us_});
  const std::int64_t wait_us = std::clamp<std::int64_t>(due_us - now_us, 0, kLongestWait_us);
  pollfd descriptor{link_.fd(), POLLIN, 0};  // of a negative descriptor poll() sees nothing, it only waits
  const timespec limit{0, wait_us * kMicro_ns};
  if (::ppoll(&descriptor, 1, &limit, nullptr) > 0 && (descriptor.revents & POLLHUP) != 0) link_.hang_up();
}

void MavlinkOutput::read_all() {
  std::array<std::uint8_t, ipc::mavlink::kMostFrame> room{};
  for (int read = 0; read < kMostReads; ++read) {
    std::span<const std::uint8_t> bytes = link_.receive(room);
    if (bytes.empty()) return;
    while (!bytes.empty()) {
      bytes = bytes.subspan(parser_.take(bytes));
      while (const auto received = parser_.next()) take(*received);
    }
  }
}

void MavlinkOutput::take(const ipc::mavlink::Received& received) {
  // A router may bring back what was sent.
  const bool is_own = received.sender.system == self_.system && received.sender.component == self_.component;
  if (is_own) return;
  shared_.received.fetch_add(1, std::memory_order_relaxed);
  if (received.id != ipc::mavlink::kTimesync.id) return;
  const ipc::mavlink::Timesync message = ipc::mavlink::decode_timesync(received);
  const std::int64_t now_ns = steady_us() * kMicro_ns;
  if (message.tc1_ns == 0) {
    ipc::mavlink::Timesync answer = clock_.answer(message, now_ns);
    answer.target_system = received.sender.system;
    answer.target_component = received.sender.component;
    send(answer);
    return;
  }
  const bool is_autopilot = received.sender.system == self_.system &&
                            received.sender.component == ipc::mavlink::kComponentAutopilot;
  if (is_autopilot) (void)clock_.take_answer(message, now_ns);
}

void MavlinkOutput::send_due(std::int64_t now_us) {
  if (comes_due(now_us, kHeartbeatEvery_us, &next_heartbeat_us_)) send(ipc::mavlink::Heartbeat{});
  const std::int64_t every_us = clock_.knows_autopilot() ? kRequestEvery_us : kFirstRequestsEvery_us;
  if (comes_due(now_us, every_us, &next_request_us_)) send(clock_.request(now_us * kMicro_ns));
  if (comes_due(now_us, period_us_, &next_odometry_us_)) send_odometry(now_us);
}

void MavlinkOutput::send_odometry(std::int64_t now_us) {
  const std::int64_t age_us = std::max<std::int64_t>(now_us - last_.image_us, 0);
  switch (hold_of(last_.frame, age_us)) {
    case MavlinkHold::kNoPose:
      shared_.without_pose.fetch_add(1, std::memory_order_relaxed);
      return;
    case MavlinkHold::kNoScale:
      shared_.without_scale.fetch_add(1, std::memory_order_relaxed);
      return;
    case MavlinkHold::kNone:
      break;
  }
  const FrameOutput now = extrapolate(last_.frame, 1e-6 * static_cast<double>(age_us));
  const std::int64_t time_us = clock_.link_time_ns(now_us * kMicro_ns) / kMicro_ns;
  // The estimator's covariances are not true yet: unknown, as on LCM.
  send(mavlink_odometry(now, std::nullopt, static_cast<std::uint64_t>(std::max<std::int64_t>(time_us, 0))));
}

template <typename Message>
void MavlinkOutput::send(const Message& message) {
  const ipc::mavlink::Frame frame = ipc::mavlink::encode(message, self_, sequence_);
  if (!link_.send(frame.bytes())) return;
  ++sequence_;
  if constexpr (std::is_same_v<Message, ipc::mavlink::Odometry>)
    shared_.sent.fetch_add(1, std::memory_order_relaxed);
}

void MavlinkOutput::note_counts() {
  shared_.send_errors.store(static_cast<std::int64_t>(link_.counts().not_sent), std::memory_order_relaxed);
  shared_.round_trip_us.store(clock_.round_trip_us(), std::memory_order_relaxed);
  shared_.is_open.store(link_.is_open(), std::memory_order_relaxed);
}

}  // namespace farpoint::daemon
