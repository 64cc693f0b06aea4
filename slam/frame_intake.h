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
  FrameIntake(const EstimatorConfig& config, const Rig& rig);
  void listen(StageListener* listener) { listener_ = listener; }

  // Null where the frame cannot be used: wrong size, not camera 0, a time not after the last frame's, or no
  // room. An image with the pixels of the one before gives a frame without features: a camera that hangs
  // shows nothing of the present.
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

  [[nodiscard]] bool is_acceptable(std::int64_t utime, int camera);
  template <typename Input>
  [[nodiscard]] std::shared_ptr<Frame> take_frame(const Input& input);

  const EstimatorConfig config_;
  const Camera camera_;
  Extractor extractor_;
  SharedPool<Frame> frames_;
  SharedPool<PyramidBuffer> pyramids_;
  StageListener* listener_ = nullptr;

  std::uint64_t next_number_ = 0;
  std::int64_t utime_ = 0;
  bool any_frame_ = false;
  std::uint64_t image_hash_ = 0;  // of the last image
};

}  // namespace farpoint::slam
