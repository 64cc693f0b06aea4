// SPDX-License-Identifier: Apache-2.0
// The threads of the vehicle, whether images come from a camera or from a recording at its own pace:
//
//   capture  -> images, the newest few -> tracking -> packages -> output -> notes -> the calling thread
//                                         tracking -> jobs -> mapping -> replies -> tracking
//
// Each arrow is a fixed ring; no thread waits for room in one. Each thread waits in one place. Tracking makes
// no system call except its wait, so it wakes no other thread. Capture wakes output together with tracking.
// Output then looks at short intervals until the frame is done, and wakes mapping when the frame brought a
// job.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "daemon/input/capture_source.h"
#include "daemon/input/image_queue.h"
#include "daemon/output/outputs.h"
#include "daemon/pipeline/capture_loop.h"
#include "daemon/pipeline/frame_notes.h"
#include "daemon/pipeline/mapping_loop.h"
#include "daemon/pipeline/output_loop.h"
#include "daemon/pipeline/run_tally.h"
#include "daemon/pipeline/tracking_loop.h"
#include "daemon/system/notifier.h"
#include "daemon/system/realtime.h"

namespace farpoint::daemon {

// Called at the end of a thread's work on a frame, for tests. Exceptions: on_started and on_watch are called
// on the calling thread, the first once all threads run, the second about every 20 ms.
struct ThreadHooks {
  std::function<void()> on_captured;
  std::function<void(const slam::FrameResult&)> on_tracked;
  std::function<void()> on_mapped;
  std::function<void(const FrameOutput&)> on_output;
  std::function<void()> on_started, on_watch;
};

struct PipelineOptions {
  int width_px = 0, height_px = 0;
  std::size_t second_pixels = 0;  // of the second camera's images; 0: one camera
  double rate_hz = 0;             // of the images, at the run's pace; 0: unknown
  // A camera: after this silence, or when the source has lost its camera, 'no_camera' is published at the
  // rate of the status. 0: a recording, which has gaps of its own.
  double no_camera_after_s = 0;
};

// What the threads work on. All must outlive the pipeline.
struct PipelineParts {
  CaptureSource* source = nullptr;
  slam::Estimator* estimator = nullptr;  // tracking's and mapping's
  FrameReporter* reporter = nullptr;     // output's
  Outputs* outputs = nullptr;            // output's
  RunTally* tally = nullptr;             // the calling thread's
  RealtimeReport* realtime = nullptr;    // receives what the threads were granted
};

class Pipeline {
 public:
  // Names of the threads, as ps and top show them.
  static constexpr const char* kCaptureThread = "fp-capture";
  static constexpr const char* kTrackingThread = "fp-tracking";
  static constexpr const char* kMappingThread = "fp-mapping";
  static constexpr const char* kOutputThread = "fp-output";

  Pipeline(const Config& config, const PipelineOptions& options, const PipelineParts& parts);

  // Runs to the end of the source, or until a signal. Throws what reading threw, and std::runtime_error where
  // a thread could not be started.
  void run(const ThreadHooks& hooks);

  // Calling thread, several times within the limits of section watchdog. The name of a thread that has work
  // and has finished none within its limit; null where all four make progress or are idle.
  [[nodiscard]] const char* hung_thread(double now_s);

  [[nodiscard]] std::int64_t frames_tracked() const { return tracking_.tracked(); }
  [[nodiscard]] std::int64_t frames_dropped() const { return images_.dropped(); }
  // As published last.
  [[nodiscard]] slam::State state() const { return output_.state(); }
  // After run().
  [[nodiscard]] const InputCounts& input() const { return output_.input(); }
  [[nodiscard]] std::vector<double> take_tracking_cpu_ms() { return std::move(tracking_cpu_ms_); }

 private:
  static constexpr std::size_t kMaxCpuTimes = 100'000;

  struct Threads;
  void run_threads(const ThreadHooks& hooks);
  void start(const ThreadHooks& hooks, Threads* threads);
  void give_up(const Threads& threads);
  void watch(const std::function<void()>& on_watch);
  void take_notes(class Progress* progress);
  void print_memory() const;
  void warn_of_losses() const;

  const RealtimeConfig config_;
  RunTally& tally_;
  RealtimeReport* realtime_;

  ImageQueue images_;
  PackageRing packages_;
  FrameNotes notes_;
  CameraPresence presence_;
  Notifier arrived_;  // images; tracking and output wait here
  Notifier ended_;    // the calling thread waits here

  CaptureLoop capture_;
  TrackingLoop tracking_;
  MappingLoop mapping_;
  OutputLoop output_;
  std::atomic<bool> output_ended_{false};
  std::vector<double> tracking_cpu_ms_;  // the calling thread's
};

// Slots of a ring that a thread may be `seconds` behind in, at this rate of images; at least 16. rate_hz 0:
// as for 60 Hz.
[[nodiscard]] std::size_t ring_slots(double seconds, double rate_hz);

}  // namespace farpoint::daemon
