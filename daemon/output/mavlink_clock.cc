// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/mavlink_clock.h"

#include <algorithm>
#include <cstdlib>

namespace farpoint::daemon {
namespace {

// What two clocks may part by between two exchanges, beyond their round trips.
constexpr std::int64_t kTolerance_ns = 2'000'000;
constexpr std::int64_t kMicro_ns = 1000;
// Times beyond are no time: sums with them stay within 64 bits.
constexpr std::int64_t kLatest_ns = std::int64_t{1} << 62;

}  // namespace

ipc::mavlink::Timesync MavlinkClock::request(std::int64_t now_ns) {
  requests_.at(next_request_) = now_ns;
  next_request_ = (next_request_ + 1) % kRequests;
  return {0, now_ns, 0, 0};
}

ipc::mavlink::Timesync MavlinkClock::answer(const ipc::mavlink::Timesync& request,
                                            std::int64_t now_ns) const {
  return {link_time_ns(now_ns), request.ts1_ns, 0, 0};
}

bool MavlinkClock::was_requested(std::int64_t ts1_ns) {
  if (ts1_ns == 0) return false;
  auto* const request = std::find(requests_.begin(), requests_.end(), ts1_ns);
  if (request == requests_.end()) return false;
  *request = 0;  // one answer each
  return true;
}

bool MavlinkClock::contradicts(const Exchange& exchange) const {
  // Each offset is wrong by half its round trip at most.
  return offset_ns_ && std::abs(exchange.offset_ns - best_.offset_ns) >
                           (exchange.round_trip_ns + best_.round_trip_ns) / 2 + kTolerance_ns;
}

bool MavlinkClock::take_answer(const ipc::mavlink::Timesync& answer, std::int64_t now_ns) {
  if (answer.tc1_ns <= 0 || answer.tc1_ns > kLatest_ns || !was_requested(answer.ts1_ns)) return false;
  const std::int64_t round_trip_ns = now_ns - answer.ts1_ns;
  if (round_trip_ns < 0 || round_trip_ns > kLongestRoundTrip_ns) return false;
  const Exchange exchange{round_trip_ns, answer.tc1_ns - (answer.ts1_ns + round_trip_ns / 2)};
  if (contradicts(exchange)) {
    if (++contradictions_ < kContradictions) return true;
    count_ = next_ = 0;
    offset_ns_.reset();
  }
  contradictions_ = 0;
  exchanges_.at(next_) = exchange;
  next_ = (next_ + 1) % kExchanges;
  count_ = std::min(count_ + 1, kExchanges);
  choose();
  return true;
}

void MavlinkClock::choose() {
  if (count_ < kLeastAnswers) return;
  best_ = *std::min_element(
      exchanges_.begin(), exchanges_.begin() + static_cast<std::ptrdiff_t>(count_),
      [](const Exchange& a, const Exchange& b) { return a.round_trip_ns < b.round_trip_ns; });
  offset_ns_ = best_.offset_ns;
}

std::int64_t MavlinkClock::round_trip_us() const {
  return offset_ns_ ? best_.round_trip_ns / kMicro_ns : -1;
}

}  // namespace farpoint::daemon
