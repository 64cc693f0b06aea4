// SPDX-License-Identifier: Apache-2.0
// One run of the estimator and everything that is published of it, wherever the images come from.
//
// Published times derive from the frames' utime; measured ones go to FARPOINT_TIMING, and in a threaded run
// to FARPOINT_SCHEDULE, from which they are taken when the run is repeated.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "daemon/config/config.h"
#include "daemon/input/counts.h"
#include "daemon/output/frame_reporter.h"
#include "daemon/output/messages.h"
#include "daemon/pipeline/run_tally.h"
#include "slam/estimator.h"

namespace farpoint::daemon {

class Outputs;

// One frame of a threaded run, to be repeated.
struct RecordedChance {
  FrameChance chance;
  slam::FrameTaken taken;
};

class Session {
 public:
  struct Options {
    std::string calibration_hash;
    std::int32_t boot_counter = 0;
    bool with_schedule = false;  // FARPOINT_SCHEDULE is published too
    bool keep_times = true;      // see RunTally
  };
  // Allocates the estimator's memory. `sinks` and the publisher must outlive the session. Throws
  // std::invalid_argument where configuration and rig cannot work together.
  Session(const Config& config, const slam::Rig& rig, Options options, std::vector<PoseSink*> sinks,
          Publisher* publisher);

  // Tracks one image, maps, and hands the outcome to every sink: in lockstep, or as `recorded` tells. `clock`
  // holds what the caller measured of this frame (the decoding) and gets the rest.
  const FrameOutput& process(const slam::FrameInput& input, const InputCounts& in, const OutputCounts& out,
                             const RecordedChance* recorded, StageClock* clock);

  // The parts of process(), for threads of their own.
  [[nodiscard]] slam::Estimator& estimator() { return estimator_; }
  [[nodiscard]] FrameReporter& reporter() { return *reporter_; }
  [[nodiscard]] RunTally& tally() { return tally_; }

  // Finishes mapping's queue, and publishes the final trajectory and the summary.
  const RunEnd& finish(const InputCounts& in);
  // What is known without that.
  [[nodiscard]] const RunEnd& end() const { return tally_.end(); }

  [[nodiscard]] std::size_t pool_bytes() const { return pool_bytes_; }

 private:
  const slam::FrameResult& process_recorded(slam::FrameInput input, const RecordedChance& recorded);
  void publish_results(const InputCounts& in);
  void publish_landmarks();
  void summarise_maps();

  Config config_;
  FrameReporter::Names names_;
  slam::Estimator estimator_;
  MapBoard maps_;
  std::size_t pool_bytes_ = 0;
  Publisher* publisher_;
  std::unique_ptr<FrameReporter> reporter_;
  FramePackage package_;  // of process()
  RunTally tally_;
};

// A session for the rig of `calibration` (see the constructor), with the cameras that `config` uses. Throws
// InputError where the calibration cannot be used, ConfigError where the configuration cannot or wants more
// memory than there is.
[[nodiscard]] std::unique_ptr<Session> make_session(const Config& config, const calibration_t& calibration,
                                                    Outputs* outputs, bool with_schedule,
                                                    bool keep_times = true);

}  // namespace farpoint::daemon
