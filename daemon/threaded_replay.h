// A recorded log at its own pace, on the threads of the vehicle:
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

#include "daemon/image_queue.h"
#include "daemon/log_frame_source.h"
#include "daemon/notifier.h"
#include "daemon/outputs.h"
#include "daemon/realtime.h"
#include "daemon/session.h"
#include "slam/spsc_ring.h"

namespace farpoint::daemon {

// For tests: called on the thread that is named, at the end of its work on a frame.
struct ThreadHooks {
  std::function<void()> on_captured;
  std::function<void(const slam::FrameResult&)> on_tracked;
  std::function<void(const FrameOutput&)> on_output;
};

class ThreadedReplay {
 public:
  // Names of the threads, as ps and top show them.
  static constexpr const char* kCaptureThread = "fp-capture";
  static constexpr const char* kTrackingThread = "fp-tracking";
  static constexpr const char* kMappingThread = "fp-mapping";
  static constexpr const char* kOutputThread = "fp-output";

  // `source` has given its first frame; all must outlive the replay.
  ThreadedReplay(const Config& config, double speed, LogFrameSource* source, Session* session,
                 Outputs* outputs);

  // From `first` to the end of the log. Throws what reading threw, and std::runtime_error where a signal came
  // or a thread could not be started.
  void run(const SourceFrame& first, const ThreadHooks& hooks);

  [[nodiscard]] std::int64_t frames_dropped() const { return images_.dropped(); }
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

  void capture(const SourceFrame& first);
  void track();
  void track_one(CapturedImage* image);
  void map();
  void output();
  void report_one(FramePackage* package);
  void watch();
  void take_notes(class Progress* progress);
  [[nodiscard]] bool frames_in_work() const;

  const RealtimeConfig config_;
  const double speed_;
  LogFrameSource& source_;
  Session& session_;
  Outputs& outputs_;
  ThreadHooks hooks_;

  ImageQueue images_;
  slam::SpscRing<FramePackage> packages_;
  slam::SpscRing<Note> notes_;
  FramePackage unpublished_;  // where the ring is full

  Notifier arrived_;                      // images; tracking and output wait here
  Notifier jobs_;                         // mapping waits here
  Notifier ended_;                        // the calling thread waits here
  std::atomic<std::int64_t> tracked_{0};  // frames that tracking has done
  std::atomic<std::int64_t> not_published_{0}, not_noted_{0};
  std::atomic<bool> stop_{false}, tracking_ended_{false}, output_ended_{false};
  std::exception_ptr capture_error_;  // read after capture's end

  const Thread* tracking_thread_ = nullptr;  // of which output reads the CPU time
  double tracking_cpu_s_ = 0;
  std::vector<double> tracking_cpu_ms_;
};

}  // namespace farpoint::daemon
