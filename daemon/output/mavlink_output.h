// SPDX-License-Identifier: Apache-2.0
// Odometry for an autopilot, on a thread of its own: ODOMETRY at the configured rate, HEARTBEAT once a
// second, TIMESYNC both ways. A link that cannot be opened or is gone is tried again every second; tracking,
// CAN and LCM never wait for it.
#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>

#include "daemon/config/config.h"
#include "daemon/output/mavlink_clock.h"
#include "daemon/output/mavlink_odometry.h"
#include "daemon/system/realtime.h"
#include "drivers/mavlink/mavlink_link.h"
#include "slam/spsc_ring.h"

namespace farpoint::daemon {

struct MavlinkCounts {
  std::int64_t sent = 0, without_scale = 0, without_pose = 0;  // ODOMETRY messages
  std::int64_t send_errors = 0, received = 0;                  // messages of any kind
  std::int64_t round_trip_us = -1;
  bool is_open = false;
  std::int64_t failed_openings = 0;
};

class MavlinkOutput final : public PoseSink {
 public:
  static constexpr const char* kThread = "fp-mavlink";

  // Precondition: the link's address is well formed.
  explicit MavlinkOutput(const MavlinkConfig& config);
  // Calls stop().
  ~MavlinkOutput() override { stop(); }
  MavlinkOutput(const MavlinkOutput&) = delete;
  MavlinkOutput& operator=(const MavlinkOutput&) = delete;

  // Output thread: hands the frame over. Never waits, makes no heap call and no system call.
  void on_frame(const FrameOutput& frame) override;
  // Any thread.
  [[nodiscard]] MavlinkCounts counts() const;

  // Starts the thread; `report` may be null.
  void start(const RealtimeConfig& config, RealtimeReport* report);
  // Ends it.
  void stop();

 private:
  struct Handed {
    FrameOutput frame;
    std::int64_t image_us = 0;  // steady clock
  };
  static constexpr std::size_t kHanded = 16;

  void run();
  void open_if_due(std::int64_t now_us);
  void wait(std::int64_t now_us);
  void read_all();
  void take(const ipc::mavlink::Received& received);
  void send_due(std::int64_t now_us);
  void send_odometry(std::int64_t now_us);
  template <typename Message>
  void send(const Message& message);
  void note_counts();

  const MavlinkConfig config_;
  const ipc::mavlink::Sender self_;
  const std::int64_t period_us_;
  slam::SpscRing<Handed> handed_;
  std::optional<Thread> thread_;
  std::atomic<bool> stop_{false};

  // Of the thread.
  drivers::MavlinkLink link_;
  ipc::mavlink::Parser parser_;
  MavlinkClock clock_;
  Handed last_;
  std::uint8_t sequence_ = 0;
  std::int64_t next_odometry_us_ = 0, next_heartbeat_us_ = 0, next_request_us_ = 0, next_opening_us_ = 0;
  std::string problem_;  // why the link is not open, as logged last
  // Written by the thread, read by any.
  struct Shared {
    std::atomic<std::int64_t> sent{0}, without_scale{0}, without_pose{0}, send_errors{0}, received{0};
    std::atomic<std::int64_t> round_trip_us{-1}, failed_openings{0};
    std::atomic<bool> is_open{false};
  } shared_;
};

}  // namespace farpoint::daemon
