// SPDX-License-Identifier: Apache-2.0
#include "daemon/input/second_camera.h"

namespace farpoint::daemon {
namespace {

constexpr int kTurn_ms = 100;

}  // namespace

SecondCamera::SecondCamera(std::unique_ptr<drivers::Camera> camera) : camera_(std::move(camera)) {
  events_.listen_to(camera_.get());
}

void SecondCamera::run() {
  while (!stop_.load(std::memory_order_relaxed)) turn();
}

void SecondCamera::turn() {
  drivers::CameraFrame frame;
  const bool came = camera_->next(kTurn_ms, &image_, &frame);
  tell(came ? &frame : nullptr);
  Recorder* recorder = recorder_.load(std::memory_order_acquire);
  if (came && recorder != nullptr) recorder->offer(kIndex, image_, frame);
}

void SecondCamera::tell(const drivers::CameraFrame* frame) {
  const bool is_streaming = camera_->is_streaming();
  if (frame == nullptr && is_streaming == told_streaming_ && untold_ == told_untold_) return;
  News* news = news_.begin_push();
  if (news == nullptr) {
    if (frame != nullptr) ++untold_;
    return;
  }
  *news = {frame != nullptr, frame != nullptr ? frame->utime : 0, is_streaming, camera_->counts(), untold_};
  told_streaming_ = is_streaming;
  told_untold_ = untold_;
  news_.end_push();
}

bool SecondCamera::take_news(News* news) {
  const News* oldest = news_.front();
  if (oldest == nullptr) return false;
  *news = *oldest;
  news_.pop();
  return true;
}

}  // namespace farpoint::daemon
