// SPDX-License-Identifier: Apache-2.0
// Source of images: one interface for all recordings.
#pragma once

#include <cstdint>
#include <string>

#include "daemon/input/counts.h"
#include "daemon/system/stage_clock.h"
#include "drivers/camera/camera.h"
#include "ipc/image_codec.h"
#include "ipc/message.h"
#include "slam/frame_result.h"

namespace farpoint::daemon {

// One decoded image, valid until the source's next call.
struct SourceFrame {
  drivers::CameraFrame meta;
  const ipc::GreyImage* image = nullptr;
  const ipc::GreyImage* second = nullptr;  // of the second camera, exposed with it; null: none

  [[nodiscard]] slam::ImageView view() const { return view_of(*image); }
  [[nodiscard]] static slam::ImageView view_of(const ipc::GreyImage& image) {
    return {image.data(), image.width_px, image.height_px, image.width_px};
  }
};

class FrameSource {
 public:
  virtual ~FrameSource() = default;

  // Returns the next accepted image of the tracked camera; false at the end. Refused ones are counted.
  // `clock` gets the time of decoding. Throws InputError for missing input, std::runtime_error for a failed
  // read.
  [[nodiscard]] virtual bool next(SourceFrame* frame, StageClock* clock) = 0;
  // Swaps the last image of next() with another, without a copy.
  virtual void swap_image(ipc::GreyImage* image) = 0;
  // The same of the second camera's. Precondition: next() gave one.
  virtual void swap_second(ipc::GreyImage* image) = 0;
  // Valid after the first image of next().
  [[nodiscard]] virtual const calibration_t& calibration() const = 0;
  [[nodiscard]] virtual InputCounts counts() const = 0;
  // Consumed share of the source, 0..1; negative for an unknown length.
  [[nodiscard]] virtual double progress() const = 0;
};

}  // namespace farpoint::daemon
