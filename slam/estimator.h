// SPDX-License-Identifier: Apache-2.0
// The facade of the estimator: measurements in, poses out. No I/O, no threads, no clock, no logging, no
// globals.
//
// Two halves share fixed rings only: tracking (slam/front_end.h) and mapping (slam/back_end.h). The caller
// chooses how they run:
//   lockstep  process() tracks one frame, runs the mapping jobs it asked for, and takes their results a
//             configured number of frames later, as a real-time run would;
//   threads   track() on one thread, map() on another; a frame takes what mapping has ready;
//   recorded  process_recorded() repeats a run of threads: each frame takes what it took then.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "slam/config.h"
#include "slam/frame_result.h"
#include "slam/inspection.h"
#include "slam/measurement.h"
#include "slam/stages.h"

namespace farpoint::slam {

class Estimator {
 public:
  // Allocates everything. Throws std::invalid_argument where the configuration or the rig cannot work; the
  // message names the cause and what is expected.
  Estimator(const EstimatorConfig& config, const Rig& rig);
  ~Estimator();
  Estimator(const Estimator&) = delete;
  Estimator& operator=(const Estimator&) = delete;

  // Queues a sample until a frame of at least its time takes it. One thread a sensor; makes no heap call.
  // False where the queue is full: the sample is dropped and counted (EstimatorCounts). In lockstep a sample
  // comes before the frame that takes it.
  bool add(const ImuSample& sample);
  bool add(const WheelSample& sample);

  // Tracks one frame. A frame that cannot be used (wrong size, time not after the last frame's) is counted in
  // counts().frames_rejected; the result then repeats the last state without a pose.
  const FrameResult& process(const FrameInput& input);
  const FrameResult& process(FeatureInput&& input);

  // Announces the stages of every later frame; null ends that. The listener must outlive its use. Called on
  // the thread that does the work: of two threads on both at once. Set while no thread runs.
  void listen(StageListener* listener);

  // Threads. track() is process() without mapping. map() works on the oldest job up to its next reply; false
  // where no job waits (FrameResult::job says when one was sent).
  const FrameResult& track(const FrameInput& input);
  bool map();

  // Repeats one frame of a run of threads: mapping works until it has made `taken.replies` replies, and the
  // frame takes them and as many samples as it took then (FrameResult::taken). Smaller numbers in the result
  // mean that the run is another one.
  const FrameResult& process_recorded(const FrameInput& input, const FrameTaken& taken);

  // Called when mapping has made a view, on mapping's thread, before tracking can take it. inspect() is
  // allowed then.
  void on_view(std::function<void(const MappingNote&)> observer);

  // Finishes mapping's queue without further optimisation. Threads must have ended.
  void finish();
  // After finish(): frees the pools of frames and images, so that a summary of the run needs no more memory
  // than the run did. No frame can be processed afterwards.
  void release_frames();

  // As of the last frame; tracking's thread. After finish(): of the whole run.
  [[nodiscard]] const EstimatorCounts& counts() const;
  // The maps, for reports. Mapping's thread, or any while no thread runs.
  [[nodiscard]] Inspection inspect() const;
  // Bytes of every pool, for the table printed at start.
  [[nodiscard]] std::vector<std::pair<std::string, std::size_t>> memory_table() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace farpoint::slam
