// SPDX-License-Identifier: Apache-2.0
// Renders images before they are due, a small bounded number of frames ahead.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

#include "farpoint/image_t.hpp"

namespace farpoint::tools::simulate {

// One image a camera.
using FrameImages = std::vector<image_t>;

// Source of frames, in order.
class FrameSource {
 public:
  virtual ~FrameSource() = default;
  // Returns true when all frames that fit are prepared. Waits some tenths of a second at most.
  [[nodiscard]] virtual bool is_ahead() = 0;
  // Takes the next frame; false if it is not ready within some tenths of a second.
  [[nodiscard]] virtual bool next(FrameImages* images) = 0;
};

// Renders on a thread of its own.
class FramesAhead final : public FrameSource {
 public:
  using Render = std::function<FrameImages(std::int64_t frame)>;
  FramesAhead(Render render, std::int64_t frames, std::size_t ahead);
  ~FramesAhead() override;  // waits for the frame that is being rendered
  FramesAhead(const FramesAhead&) = delete;
  FramesAhead& operator=(const FramesAhead&) = delete;

  // Both rethrow an error of rendering after the frames before it were taken.
  [[nodiscard]] bool is_ahead() override;
  [[nodiscard]] bool next(FrameImages* images) override;

 private:
  static constexpr std::chrono::milliseconds kPatience{100};
  void run();
  [[nodiscard]] bool wait_for_room(std::unique_lock<std::mutex>* lock);

  Render render_;
  std::int64_t frames_;
  std::size_t ahead_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<FrameImages> ready_;
  std::exception_ptr failure_;
  bool ended_ = false;  // nothing more is rendered
  bool stopping_ = false;
  std::thread thread_;  // last: begins when all else is there
};

}  // namespace farpoint::tools::simulate
