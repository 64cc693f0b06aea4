// SPDX-License-Identifier: Apache-2.0
// A source of images made by hand.
#pragma once

#include <chrono>
#include <stdexcept>
#include <thread>
#include <vector>

#include "daemon/input/capture_source.h"
#include "daemon/system/stage_clock.h"
#include "tests/daemon/synthetic_log.h"

namespace farpoint::daemon {

// Gives N images, `pause` apart, then ends or throws.
class HandMadeSource final : public CaptureSource {
 public:
  HandMadeSource(int images, std::chrono::microseconds pause) : images_(images), pause_(pause) {
    for (int i = 0; i < kPictures; ++i) {
      const image_t picture = test::synthetic_image({}, i);
      pictures_.push_back({picture.width, picture.height, picture.data});
    }
  }
  void throw_at_end() { throws_ = true; }

  CaptureStatus next(const std::atomic<bool>& stop, CapturedImage* image) override {
    std::this_thread::sleep_for(pause_);
    if (stop) return CaptureStatus::kEnd;
    if (given_ == images_) {
      if (throws_) throw std::runtime_error("the source broke");
      return CaptureStatus::kEnd;
    }
    image->image = pictures_[static_cast<std::size_t>(given_ % kPictures)];
    image->meta.utime = 1'000'000 + given_ * 100'000;
    image->meta.sequence = given_++;
    image->in = {};
    image->in.images = given_;
    image->due_s = steady_s();
    return CaptureStatus::kImage;
  }

 private:
  static constexpr int kPictures = 25;
  const int images_;
  const std::chrono::microseconds pause_;
  bool throws_ = false;
  int given_ = 0;
  std::vector<ipc::GreyImage> pictures_;
};

}  // namespace farpoint::daemon
