// SPDX-License-Identifier: Apache-2.0
// The threads of the vehicle, whether images come from a camera or from a recording at its own pace:
//
//   capture  -> images, the newest few -> tracking -> packages -> output -> notes -> the calling thread
//                                         tracking -> jobs -> mapping -> replies -> tracking
//
// Each arrow is a fixed ring; nobody waits for room in one. Each thread waits in one place. Tracking makes no
// system call but its wait, so it wakes nobody: capture wakes output together with tracking, output then
// looks every so often until the frame is done, and wakes mapping when the frame brought a job.
#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <functional>
#include <vector>

#include "daemon/input/capture_source.h"
#include "daemon/input/image_queue.h"
#include "daemon/output/outputs.h"
#include "daemon/pipeline/feature_budget.h"
#include "daemon/pipeline/session.h"
#include "daemon/system/notifier.h"
#include "daemon/system/realtime.h"
#include "slam/spsc_ring.h"

namespace farpoint::daemon {

// Called on the thread that is named, at the end of its work on a frame; for tests, but for on_started and
// on_watch, both of the calling thread: when all threads run, and about every 20 ms.
struct ThreadHooks {
  std::function<void()> on_captured;
  std::function<void(const slam::FrameResult&)> on_tracked;
  std::function<void(const FrameOutput&)> on_output;
  std::function<void()> on_started, on_watch;
};

struct PipelineOptions {
  int width_px = 0, height_px = 0;
  // A camera: without an image for so long, or where the source knows that it is away, 'no_camera' is
  // published at the rate of the status. 0: a recording, which has gaps of its own.
  double no_camera_after_s = 0;
  // Keep what the end of the run is summarised from; it grows with the run.
  bool remember = true;
  RealtimeReport* realtime = nullptr;  // gets what the threads were granted
};

class Pipeline {
 public:
  // Names of the threads, as ps and top show them.
  static constexpr const char* kCaptureThread = "fp-capture";
  static constexpr const char* kTrackingThread = "fp-tracking";
  static constexpr const char* kMappingThread = "fp-mapping";
  static constexpr const char* kOutputThread = "fp-output";

  // All must outlive the pipeline.
  Pipeline(const Config& config, const PipelineOptions& options, CaptureSource* source, Session* session,
           Outputs* outputs);

  // To the end of the source, or until a signal came. Throws what reading threw, and std::runtime_error where
  // a thread could not be started.
  void run(const ThreadHooks& hooks);

  // Calling thread. True where since the last call capture has turned, and tracking has finished a frame or
  // had none to do: what a watchdog is to be fed with.
  [[nodiscard]] bool has_progressed();
  [[nodiscard]] std::int64_t frames_tracked() const { return tracked_.load(std::memory_order_relaxed); }
  [[nodiscard]] std::int64_t frames_dropped() const { return images_.dropped(); }
  // As published last.
  [[nodiscard]] slam::State state() const { return state_.load(std::memory_order_relaxed); }
  [[nodiscard]] std::vector<double> take_tracking_cpu_ms() { return std::move(tracking_cpu_ms_); }

 private:
  // What the end of the run needs of a frame.
  struct Note {
    slam::FrameResult published;
    bool valid = false;
    double tracking_cpu_ms = 0, progress = -1.0;
  };
  static constexpr std::size_t kPackages = 64;  // frames that the output may be behind
  static constexpr std::size_t kNotes = 1024;   // frames that the calling thread may be behind
  static constexpr std::size_t kMaxCpuTimes = 100'000;

  void capture();
  void capture_until_end();
  void note_presence(CaptureStatus status, const InputCounts& in);
  void track();
  void track_one(CapturedImage* image);
  void map();
  void output();
  [[nodiscard]] std::int64_t idle_us() const;
  void report_one(FramePackage* package);
  void report_silence_if_due();
  void watch();
  void take_notes(class Progress* progress);
  [[nodiscard]] bool frames_in_work() const;
  [[nodiscard]] bool is_live() const { return options_.no_camera_after_s > 0.0; }

  const RealtimeConfig config_;
  const PipelineOptions options_;
  const double silence_period_s_;
  CaptureSource& source_;
  Session& session_;
  Outputs& outputs_;
  ThreadHooks hooks_;

  ImageQueue images_;
  slam::SpscRing<FramePackage> packages_;
  slam::SpscRing<Note> notes_;
  slam::SpscRing<InputCounts> counts_of_absence_;
  FramePackage unpublished_;  // where the ring is full
  FeatureBudget features_;    // tracking's
  std::int64_t dropped_seen_ = 0;

  Notifier arrived_;                      // images; tracking and output wait here
  Notifier jobs_;                         // mapping waits here
  Notifier ended_;                        // the calling thread waits here
  std::atomic<std::int64_t> turns_{0};    // of capture
  std::atomic<std::int64_t> tracked_{0};  // frames that tracking has done
  std::atomic<std::int64_t> not_published_{0}, not_noted_{0};
  std::atomic<slam::State> state_{slam::State::kStarting};  // published last
  std::atomic<double> last_image_s_{0.0};                   // steady clock; the run's start before the first
  std::atomic<bool> away_{false};                           // the source knows that there is no camera
  std::atomic<bool> stop_{false}, tracking_ended_{false}, output_ended_{false};
  std::exception_ptr capture_error_;  // read after capture's end

  // Output's.
  const Thread* tracking_thread_ = nullptr;  // of which output reads the CPU time
  double tracking_cpu_s_ = 0;
  double next_silence_s_ = 0;
  InputCounts last_in_;
  // The calling thread's.
  std::int64_t turns_seen_ = -1, tracked_seen_ = -1;
  std::vector<double> tracking_cpu_ms_;
};

}  // namespace farpoint::daemon
