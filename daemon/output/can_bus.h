// SPDX-License-Identifier: Apache-2.0
// Odometry on the bus, by the steady clock: an epoch at the configured rate, whatever happens to images.
//
// At most one epoch is in flight. Its status frame is sent first; the others follow once the controller has
// confirmed it. A blocked bus drops whole epochs, which are counted, so that only the frame in flight can be
// late. Receivers reject frames that do not follow their status frame (DBC).
#pragma once

#include <limits>
#include <memory>

#include "daemon/output/epoch_predictor.h"
#include "daemon/system/late_opened.h"
#include "drivers/can/socketcan.h"
#include "ipc/can_codec.h"
#include "ipc/candump.h"
#include "slam/spsc_ring.h"

namespace farpoint::daemon {

class CanBus final : public PoseSink {
 public:
  static constexpr double kNever_s = std::numeric_limits<double>::infinity();

  CanBus(const ipc::CanLayout& layout, const EpochOptions& options);
  // Sends the farewell if the caller has not.
  ~CanBus() override;
  CanBus(const CanBus&) = delete;
  CanBus& operator=(const CanBus&) = delete;

  // Before the first tick. Without a bus the epochs go into the log alone.
  void send_on(std::unique_ptr<drivers::SocketCan> bus) { bus_ = std::move(bus); }
  // Once, any thread. The log holds confirmed frames only, each with the time of its confirmation.
  void log_to(std::unique_ptr<ipc::CandumpWriter> log) { log_.set(std::move(log)); }
  [[nodiscard]] bool is_logged() const { return log_.get() != nullptr; }
  void set_body_is_camera(bool is_camera) { predictor_.set_body_is_camera(is_camera); }

  // Output thread, which never waits here.
  void on_frame(const FrameOutput& frame) override;
  // Sends what is due, takes confirmations, and looks for a bus that is away.
  void tick(double now_s);
  // Time of the next call of tick(); seconds of the steady clock.
  [[nodiscard]] double next_due_s() const;

  // Thread of the files: writes the confirmed frames to the log.
  void write_log();
  // Calling thread, after the output thread has ended: sends the last epoch. Waits up to 0.3 s for the bus.
  void farewell();
  // After the thread of the files has ended: writes the rest of the log and renames it to its final name.
  // Throws std::runtime_error if a write failed.
  void close();

  // Frames that did not reach the bus.
  [[nodiscard]] std::int64_t errors() const;
  // Frames missing in the log: its ring was full.
  [[nodiscard]] std::int64_t not_logged() const { return not_logged_; }
  [[nodiscard]] drivers::CanState bus_state() const {
    return bus_ ? bus_->state() : drivers::CanState::kUnknown;
  }
  [[nodiscard]] drivers::CanCounts bus_counts() const { return bus_ ? bus_->counts() : drivers::CanCounts{}; }

 private:
  struct Logged {
    std::int64_t utime = 0;
    ipc::CanFrame frame;
  };
  static constexpr std::size_t kLogged = 4096;  // confirmed frames waiting for the log: nine seconds

  void maintain(double now_s);
  void take_confirmations(double now_s);
  void begin_epoch(double now_s);
  void send_next(double now_s);
  void leave_rest_out();
  [[nodiscard]] bool waits_for_confirmation() const;
  void note(const ipc::CanFrame& frame, double now_s, std::int64_t age_us);
  bool settle(double limit_s);

  EpochPredictor predictor_;
  ipc::CanEncoder encoder_;
  const double period_s_;
  std::unique_ptr<drivers::SocketCan> bus_;
  LateOpened<ipc::CandumpWriter> log_;
  slam::SpscRing<Logged> logged_;
  ipc::CanEpoch epoch_;   // being sent
  std::size_t sent_ = 0;  // of its frames
  double next_epoch_s_ = 0, next_maintenance_s_ = 0, look_s_ = kNever_s;
  std::int64_t left_out_ = 0, not_logged_ = 0;  // frames
  bool said_farewell_ = false;
};

}  // namespace farpoint::daemon
