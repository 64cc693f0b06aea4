// One run of the estimator and everything that is published of it, wherever the images come from.
//
// Lockstep: process() does all that one frame asks for, in one order. Times that are published derive from
// the frames' utime; the measured ones go to FARPOINT_TIMING alone.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "daemon/config.h"
#include "daemon/messages.h"
#include "daemon/pose_sink.h"
#include "daemon/publisher.h"
#include "daemon/stage_clock.h"
#include "slam/estimator.h"

namespace farpoint::daemon {

// What came in and what was refused, since the start.
struct InputCounts {
  std::int64_t images = 0;  // of all cameras
  std::int64_t wrong_size = 0, undecodable = 0, unknown_camera = 0, times_backwards = 0;
  std::int64_t messages_undecodable = 0, log_damages = 0;
};

// What could not be sent; the bus is counted here because its sink is no message sink.
struct OutputCounts {
  std::int64_t can_send_errors = 0;
};

class Session {
 public:
  // Allocates the estimator's memory. `sinks` get each frame in their order, then the publisher; all must
  // outlive the session. Throws std::invalid_argument where configuration and rig cannot work together.
  Session(const Config& config, const slam::Rig& rig, std::string calibration_hash,
          std::vector<PoseSink*> sinks, Publisher* publisher);

  // Tracks one image and hands the outcome to every sink. `clock` holds what the caller measured of this
  // frame (the decoding) and gets the rest.
  const FrameOutput& process(const slam::FrameInput& input, const InputCounts& in, const OutputCounts& out,
                             StageClock* clock);

  // Finishes mapping's queue, and publishes the final trajectory and the summary.
  const RunEnd& finish(const InputCounts& in);

  [[nodiscard]] const slam::Estimator& estimator() const { return estimator_; }
  [[nodiscard]] std::size_t pool_bytes() const { return pool_bytes_; }

 private:
  void note_state(const slam::FrameResult& result);
  void publish_status(const FrameOutput& frame, const InputCounts& in, const OutputCounts& out);
  void publish_map(const FrameOutput& frame);
  [[nodiscard]] status_t make_status(const FrameOutput& frame, const InputCounts& in,
                                     const OutputCounts& out) const;
  [[nodiscard]] double unit_scale(slam::ScaleState scale) const;

  Config config_;
  std::string calibration_hash_, config_hash_, build_;
  slam::Estimator estimator_;
  std::size_t pool_bytes_ = 0;
  std::vector<PoseSink*> sinks_;
  Publisher* publisher_;

  FrameOutput frame_;
  RunEnd end_;
  slam::State last_state_ = slam::State::kStarting;
  std::int64_t next_status_utime_, next_map_utime_;
};

}  // namespace farpoint::daemon
