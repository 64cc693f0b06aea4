// Odometry onto the bus and into a CAN log: one epoch of frames for every camera frame.
#pragma once

#include <limits>
#include <memory>

#include "daemon/config/config.h"
#include "daemon/output/pose_sink.h"
#include "drivers/can/socketcan.h"
#include "drivers/can/wheel_reader.h"
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
  // Live: odometry carried on to now so often between the images; `frame_period_s` of the camera, 0 unknown.
  void send_steadily(double rate_hz, double frame_period_s);
  void read_wheels(std::unique_ptr<drivers::WheelReader> wheels) { wheels_ = std::move(wheels); }

  void on_frame(const FrameOutput& frame) override;
  static constexpr double kNever_s = std::numeric_limits<double>::infinity();
  // When tick() has to send next.
  [[nodiscard]] double next_due_s() const { return next_due_s_; }
  // Live, often: sends what is due, looks for a bus that is away, and reads what has come. True where *wheels
  // was filled; ask again then.
  [[nodiscard]] bool tick(double now_s, wheels_t* wheels);

  // Frames that the bus did not take, and epochs that the log cannot hold (a time before 1970).
  [[nodiscard]] std::int64_t errors() const;
  [[nodiscard]] drivers::CanState bus_state() const {
    return bus_ ? bus_->state() : drivers::CanState::kUnknown;
  }
  [[nodiscard]] drivers::CanCounts bus_counts() const { return bus_ ? bus_->counts() : drivers::CanCounts{}; }
  // Puts the log in its place. Throws std::runtime_error where something was not stored.
  void close();

 private:
  CanPoseFrame pose_frame_;
  ipc::CanEncoder encoder_;
  std::unique_ptr<ipc::CandumpWriter> log_;
  std::unique_ptr<drivers::SocketCan> bus_;
  std::int64_t not_logged_ = 0;

  void send_carried_on(double now_s);
  std::unique_ptr<drivers::WheelReader> wheels_;
  double steady_period_s_ = 0, frame_period_s_ = 0;
  FrameOutput last_;  // sent with an image
  double last_s_ = 0, next_maintenance_s_ = 0;
  double next_due_s_ = kNever_s;  // there is nothing to carry on before the first image
};

}  // namespace farpoint::daemon
