// SPDX-License-Identifier: Apache-2.0
#include "tools/simulate/render/frames_ahead.h"

#include <utility>

namespace farpoint::tools::simulate {

FramesAhead::FramesAhead(Render render, std::int64_t frames, std::size_t ahead)
    : render_(std::move(render)), frames_(frames), ahead_(ahead), thread_([this] { run(); }) {}

FramesAhead::~FramesAhead() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void FramesAhead::run() {
  std::unique_lock lock(mutex_);
  try {
    for (std::int64_t frame = 0; frame < frames_ && wait_for_room(&lock); ++frame) {
      lock.unlock();
      FrameImages images = render_(frame);
      lock.lock();
      ready_.push_back(std::move(images));
      changed_.notify_all();
    }
  } catch (...) {
    if (!lock.owns_lock()) lock.lock();
    failure_ = std::current_exception();
  }
  ended_ = true;
  changed_.notify_all();
}

// False where it is to stop instead.
bool FramesAhead::wait_for_room(std::unique_lock<std::mutex>* lock) {
  changed_.wait(*lock, [this] { return stopping_ || ready_.size() < ahead_; });
  return !stopping_;
}

bool FramesAhead::is_ahead() {
  std::unique_lock lock(mutex_);
  const bool is = changed_.wait_for(lock, kPatience, [this] { return ended_ || ready_.size() >= ahead_; });
  if (ready_.empty() && failure_) std::rethrow_exception(failure_);
  return is;
}

bool FramesAhead::next(FrameImages* images) {
  std::unique_lock lock(mutex_);
  (void)changed_.wait_for(lock, kPatience, [this] { return ended_ || !ready_.empty(); });
  if (ready_.empty() && failure_) std::rethrow_exception(failure_);
  if (ready_.empty()) return false;
  *images = std::move(ready_.front());
  ready_.pop_front();
  changed_.notify_all();
  return true;
}

}  // namespace farpoint::tools::simulate
