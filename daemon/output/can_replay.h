// SPDX-License-Identifier: Apache-2.0
// Epochs of a replay, timed by the recording's clock. A repeated replay sends the same bytes.
#pragma once

#include <memory>

#include "daemon/output/epoch_predictor.h"
#include "drivers/can/socketcan.h"
#include "ipc/can_codec.h"
#include "ipc/candump.h"

namespace farpoint::daemon {

// The first epoch is due with the first frame, the others a period apart. An epoch uses the newest frame
// whose time plus age has passed.
class CanReplay final : public PoseSink {
 public:
  CanReplay(const ipc::CanLayout& layout, const EpochOptions& options)
      : predictor_(options), encoder_(layout) {}
  void log_to(std::unique_ptr<ipc::CandumpWriter> log) { log_ = std::move(log); }
  // Lockstep: at the pace of the replay.
  void send_on(std::unique_ptr<drivers::SocketCan> bus) { bus_ = std::move(bus); }
  void set_body_is_camera(bool is_camera) { predictor_.set_body_is_camera(is_camera); }

  void on_frame(const FrameOutput& frame) override;
  // Sends the epoch after the last frame and the farewell, and renames the log to its final name. Throws
  // std::runtime_error if a write failed.
  void close();

  // Frames that the bus did not take, and frames of the camera that the log cannot hold (a time before 1970).
  [[nodiscard]] std::int64_t errors() const;

 private:
  [[nodiscard]] std::int64_t next_us() const;
  void send_until(std::int64_t end_us);
  void send(const ipc::OdometryEpoch& epoch, std::int64_t utime);

  EpochPredictor predictor_;
  ipc::CanEncoder encoder_;
  std::unique_ptr<ipc::CandumpWriter> log_;
  std::unique_ptr<drivers::SocketCan> bus_;
  bool started_ = false;
  std::int64_t start_us_ = 0, epochs_ = 0;
  std::int64_t not_logged_ = 0;
};

}  // namespace farpoint::daemon
