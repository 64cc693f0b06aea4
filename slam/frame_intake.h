// SPDX-License-Identifier: Apache-2.0
// From an image to a frame with features: checks, numbers and extracts. Frames and pyramids come from fixed
// pools; no heap call after construction.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "slam/config.h"
#include "slam/frame_result.h"
#include "slam/image/extractor.h"
#include "slam/image/pyramid.h"
#include "slam/map/frame.h"
#include "slam/map/shared_pool.h"
#include "slam/stages.h"

namespace farpoint::slam {

class FrameIntake {
 public:
  // Takes images of the first `cameras` cameras of the rig. Camera 0 gives features and pixels; further ones
  // give pixels, in which the features of camera 0 are measured.
  FrameIntake(const EstimatorConfig& config, const Rig& rig, int cameras = 1);
  ~FrameIntake();
  FrameIntake(const FrameIntake&) = delete;
  FrameIntake& operator=(const FrameIntake&) = delete;
  void listen(StageListener* listener) { listener_ = listener; }

  // Null where the frame cannot be used: a wrong size of the first image, a camera whose images are not
  // taken, a time not after the last frame's, or no room. A further camera's image of a wrong size, or
  // without room, is left out: the frame is one of fewer cameras. An image with the pixels of the one before
  // gives a view without features: a camera that hangs shows nothing of the present.
  [[nodiscard]] std::shared_ptr<Frame> take(const FrameInput& input);
  [[nodiscard]] std::shared_ptr<Frame> take(FeatureInput&& input);

  // Of the newest frame. Numbers count from 0.
  [[nodiscard]] std::uint64_t number() const { return next_number_ - 1; }
  [[nodiscard]] std::int64_t utime() const { return utime_; }

  // Gives up the pools. No frame can be taken afterwards.
  void release();
  [[nodiscard]] std::vector<std::pair<std::string, std::size_t>> memory_table() const;

 private:
  struct PyramidBuffer;

  // One camera's pixels.
  struct CameraIntake;

  [[nodiscard]] bool takes(int camera) const {
    return camera >= 0 && camera < static_cast<int>(cameras_.size());
  }
  [[nodiscard]] bool takes(const CameraImage& image) const;
  // Notes the time of a frame. False where it is not after the last frame's.
  [[nodiscard]] bool advance(std::int64_t utime);
  [[nodiscard]] bool fill_view(const CameraImage& input, int most_features, Frame* frame);
  void fill_pixels(const CameraImage& input, Frame* frame);
  template <typename Input>
  [[nodiscard]] std::shared_ptr<Frame> take_frame(const Input& input);

  const EstimatorConfig config_;
  Extractor extractor_;                                 // of camera 0
  std::vector<std::unique_ptr<CameraIntake>> cameras_;  // by camera
  SharedPool<Frame> frames_;
  StageListener* listener_ = nullptr;

  std::uint64_t next_number_ = 0;
  std::int64_t utime_ = 0;
  bool any_frame_ = false;
};

}  // namespace farpoint::slam
