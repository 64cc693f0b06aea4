// SPDX-License-Identifier: Apache-2.0
// The tracking thread: images from the queue to packages for the output.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>

#include "daemon/input/image_queue.h"
#include "daemon/output/frame_package.h"
#include "daemon/pipeline/feature_budget.h"
#include "daemon/pipeline/thread_progress.h"
#include "daemon/system/notifier.h"
#include "slam/estimator.h"
#include "slam/spsc_ring.h"

namespace farpoint::daemon {

// Frames on their way from tracking to the output.
using PackageRing = slam::SpscRing<FramePackage>;

class TrackingLoop {
 public:
  using Hook = std::function<void(const slam::FrameResult&)>;

  // All must outlive this object. The thread waits at `arrived`, which capture notifies. limit_s: see
  // ThreadProgress.
  TrackingLoop(slam::Estimator* estimator, ImageQueue* images, PackageRing* packages, Notifier* arrived,
               const FeatureBudget& features, double limit_s);

  // The thread: until the queue is closed and empty. Makes no system call except its wait. on_tracked: called
  // before a frame is handed over.
  void run(const Hook& on_tracked);
  // One image of run(); false where none waits.
  bool turn(const Hook& on_tracked);

  // No frame follows: the end of run(), or in its place where the thread does not run.
  void end();

  // Any thread.
  [[nodiscard]] bool has_ended() const { return ended_.load(std::memory_order_acquire); }
  // Frames tracked so far.
  [[nodiscard]] std::int64_t tracked() const { return tracked_.load(std::memory_order_acquire); }
  // An image waits or is in work.
  [[nodiscard]] bool has_work() const;
  // Tracked frames without room in the ring: not published.
  [[nodiscard]] std::int64_t not_published() const { return not_published_.load(std::memory_order_relaxed); }
  // One other thread.
  [[nodiscard]] bool is_alive(double now_s) { return progress_.is_alive(now_s, has_work()); }

 private:
  void fill_chance(const CapturedImage& image, FrameChance* chance);
  void track(CapturedImage* image, FramePackage* package);

  slam::Estimator& estimator_;
  ImageQueue& images_;
  PackageRing& packages_;
  Notifier& arrived_;
  ThreadProgress progress_;
  FeatureBudget features_;
  FramePackage unpublished_;       // takes a frame while the ring is full
  std::int64_t dropped_seen_ = 0;  // images, when the last frame was queued
  std::atomic<std::int64_t> tracked_{0}, not_published_{0};
  std::atomic<bool> ended_{false};
};

}  // namespace farpoint::daemon
