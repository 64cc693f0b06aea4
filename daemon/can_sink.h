// Odometry onto the bus and into a CAN log: one epoch of frames for every camera frame.
#pragma once

#include <memory>

#include "daemon/config.h"
#include "daemon/pose_sink.h"
#include "drivers/socketcan.h"
#include "ipc/can_codec.h"
#include "ipc/candump.h"

namespace farpoint::daemon {

// What one frame says on the bus. Standard deviations of the position are along the axes of the frame that
// the pose is in; those of the attitude are of heading, roll and pitch. age_s: from mid-exposure to sending.
[[nodiscard]] ipc::OdometryEpoch make_epoch(const FrameOutput& frame, CanPoseFrame pose_frame, double age_s);

class CanSink final : public PoseSink {
 public:
  explicit CanSink(CanPoseFrame pose_frame) : pose_frame_(pose_frame) {}
  void log_to(std::unique_ptr<ipc::CandumpWriter> log) { log_ = std::move(log); }
  void send_on(std::unique_ptr<drivers::SocketCan> bus) { bus_ = std::move(bus); }

  void on_frame(const FrameOutput& frame) override;

  // Frames that the bus did not take, and epochs that the log cannot hold (a time before 1970).
  [[nodiscard]] std::int64_t errors() const;
  // Puts the log in its place. Throws std::runtime_error where something was not stored.
  void close();

 private:
  CanPoseFrame pose_frame_;
  ipc::CanEncoder encoder_;
  std::unique_ptr<ipc::CandumpWriter> log_;
  std::unique_ptr<drivers::SocketCan> bus_;
  std::int64_t not_logged_ = 0;
};

}  // namespace farpoint::daemon
