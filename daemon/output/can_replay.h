// Odometry of a replay, by the recording's clock: the same epochs as on the vehicle, and the same again.
#pragma once

#include <memory>

#include "daemon/output/epoch_predictor.h"
#include "drivers/can/socketcan.h"
#include "ipc/can_codec.h"
#include "ipc/candump.h"

namespace farpoint::daemon {

// Epochs are a period apart, from when the first frame was there. A frame counts from its time plus its age:
// the epochs before rest on the one before it.
class CanReplay final : public PoseSink {
 public:
  CanReplay(const ipc::CanLayout& layout, const EpochOptions& options)
      : predictor_(options), encoder_(layout) {}
  void log_to(std::unique_ptr<ipc::CandumpWriter> log) { log_ = std::move(log); }
  // Lockstep: at the pace of the replay.
  void send_on(std::unique_ptr<drivers::SocketCan> bus) { bus_ = std::move(bus); }
  void set_body_is_camera(bool is_camera) { predictor_.set_body_is_camera(is_camera); }

  void on_frame(const FrameOutput& frame) override;
  // Sends the epoch after the last frame, and the farewell. Puts the log in its place. Throws
  // std::runtime_error where something was not stored.
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
