// SPDX-License-Identifier: Apache-2.0
#include "daemon/pipeline/tracking_loop.h"

#include <span>

namespace farpoint::daemon {

TrackingLoop::TrackingLoop(slam::Estimator* estimator, ImageQueue* images, PackageRing* packages,
                           Notifier* arrived, const FeatureBudget& features, double limit_s)
    : estimator_(*estimator),
      images_(*images),
      packages_(*packages),
      arrived_(*arrived),
      progress_(limit_s),
      features_(features) {}

void TrackingLoop::run(const Hook& on_tracked) {
  for (;;) {
    const std::uint32_t seen = arrived_.seen();
    if (turn(on_tracked)) continue;
    if (!images_.is_closed())
      arrived_.wait(seen);
    else if (images_.waiting() == 0)
      break;
  }
  end();
}

void TrackingLoop::end() {
  progress_.end();
  ended_.store(true, std::memory_order_release);
  arrived_.notify();
}

bool TrackingLoop::turn(const Hook& on_tracked) {
  CapturedImage* image = images_.pop();
  if (image == nullptr) return false;
  FramePackage* package = packages_.begin_push();
  const bool has_room = package != nullptr;
  if (!has_room) package = &unpublished_;
  track(image, package);
  if (on_tracked) on_tracked(package->result);
  if (has_room)
    packages_.end_push();
  else
    not_published_.fetch_add(1, std::memory_order_relaxed);
  tracked_.fetch_add(1, std::memory_order_release);
  progress_.step();
  return true;
}

void TrackingLoop::track(CapturedImage* image, FramePackage* package) {
  // The thread's CPU time costs a system call here: the output reads it.
  const double began_s = steady_s();
  fill_chance(*image, &package->chance);
  const slam::ImageView view = SourceFrame::view_of(image->image);
  slam::FrameInput input{image->meta.utime, image->meta.sequence, 0, view, package->chance.features_asked};
  slam::CameraImage second{1, {}};
  if (image->has_second) {
    second.image = SourceFrame::view_of(image->second);
    input.others = std::span(&second, 1);
  }
  package->result = estimator_.track(input);
  package->counts = estimator_.counts();
  package->in = image->in;
  package->camera = image->camera;
  package->due_s = image->due_s;
  package->progress = image->progress;
  package->clock.new_frame();
  package->clock.set(timing_t::STAGE_DECODE, image->decode_cpu_ms, image->decode_wall_ms);
  images_.give_back(image);
  package->clock.set(timing_t::STAGE_TRACKING, -1.0, 1e3 * (steady_s() - began_s));
}

void TrackingLoop::fill_chance(const CapturedImage& image, FrameChance* chance) {
  *chance = {};
  chance->capture_queue = static_cast<std::int32_t>(images_.waiting());
  chance->publish_queue = static_cast<std::int32_t>(packages_.size());
  chance->frames_dropped = image.frames_dropped;
  chance->features_asked = features_.features();
  features_.note(chance->capture_queue > 0 || image.frames_dropped > dropped_seen_);
  dropped_seen_ = image.frames_dropped;
}

bool TrackingLoop::has_work() const {
  const std::int64_t done = tracked();
  return images_.pushed() > images_.dropped() + done;
}

}  // namespace farpoint::daemon
