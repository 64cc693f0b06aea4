// Where images come from: one interface, whether it is a recording or, later, a camera.
#pragma once

#include <cstdint>
#include <string>

#include "daemon/input/counts.h"
#include "daemon/system/stage_clock.h"
#include "ipc/image_codec.h"
#include "ipc/message.h"
#include "slam/frame_result.h"

namespace farpoint::daemon {

// One decoded image; the source's until its next call.
struct SourceFrame {
  std::int64_t utime = 0;  // mid-exposure, microseconds
  std::int64_t sequence = 0;
  const ipc::GreyImage* image = nullptr;

  [[nodiscard]] slam::ImageView view() const {
    return {image->data(), image->width_px, image->height_px, image->width_px};
  }
};

class FrameSource {
 public:
  virtual ~FrameSource() = default;

  // The next image of the tracked camera that can be used; false at the end. Refused ones are counted.
  // `clock` gets the time of decoding. Throws InputError where what is needed is not there,
  // std::runtime_error where reading fails.
  [[nodiscard]] virtual bool next(SourceFrame* frame, StageClock* clock) = 0;
  // Gives the image that next() gave last in exchange for another, without copying it.
  virtual void swap_image(ipc::GreyImage* image) = 0;
  // Known once next() has given the first image.
  [[nodiscard]] virtual const calibration_t& calibration() const = 0;
  [[nodiscard]] virtual InputCounts counts() const = 0;
  // How much of the source has been given out, 0..1; negative where its length is not known.
  [[nodiscard]] virtual double progress() const = 0;
};

}  // namespace farpoint::daemon
