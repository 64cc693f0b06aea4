// SPDX-License-Identifier: Apache-2.0
// The autopilot's time, from answers to TIMESYNC requests. One thread; fixed memory.
//
// All messages of the link speak in one time. It is this computer's steady clock until the autopilot has
// answered often enough, and the autopilot's from then on: stamps of ODOMETRY, and answers to the autopilot's
// own requests. An autopilot that converts stamps by its own exchanges then finds no difference left.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "ipc/mavlink/messages.h"

namespace farpoint::daemon {

class MavlinkClock {
 public:
  // Answers before the autopilot's time is in use.
  static constexpr int kLeastAnswers = 4;
  // A longer round trip tells too little: 20 ms of error at most.
  static constexpr std::int64_t kLongestRoundTrip_ns = 40'000'000;

  // The request to send at `now_ns` of the steady clock.
  [[nodiscard]] ipc::mavlink::Timesync request(std::int64_t now_ns);
  // Takes an answer that came at `now_ns`. False for one that no request asked for, late or of no time.
  bool take_answer(const ipc::mavlink::Timesync& answer, std::int64_t now_ns);
  // The answer to another's request.
  [[nodiscard]] ipc::mavlink::Timesync answer(const ipc::mavlink::Timesync& request,
                                              std::int64_t now_ns) const;

  [[nodiscard]] bool knows_autopilot() const { return offset_ns_.has_value(); }
  // Time of the link of a time of the steady clock.
  [[nodiscard]] std::int64_t link_time_ns(std::int64_t steady_ns) const {
    return steady_ns + offset_ns_.value_or(0);
  }
  // Of the exchange in use; -1: none.
  [[nodiscard]] std::int64_t round_trip_us() const;

 private:
  struct Exchange {
    std::int64_t round_trip_ns = 0, offset_ns = 0;
  };
  // The newest exchanges: the one of the shortest round trip counts. At one a second clocks that run apart by
  // 50 ppm part by less than a millisecond meanwhile.
  static constexpr std::size_t kExchanges = 16, kRequests = 8;
  // Exchanges in a row that contradict the one in use: the autopilot started anew.
  static constexpr int kContradictions = 3;

  [[nodiscard]] bool was_requested(std::int64_t ts1_ns);
  [[nodiscard]] bool contradicts(const Exchange& exchange) const;
  void choose();

  std::array<std::int64_t, kRequests> requests_{};  // 0: answered, or none
  std::size_t next_request_ = 0;
  std::array<Exchange, kExchanges> exchanges_{};
  std::size_t count_ = 0, next_ = 0;
  int contradictions_ = 0;
  Exchange best_;
  std::optional<std::int64_t> offset_ns_;  // the autopilot's time minus the steady clock's
};

}  // namespace farpoint::daemon
