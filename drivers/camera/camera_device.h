// What drives a live camera (live_camera.h): one device that is opened, streamed from and closed, any number
// of times. All calls are of the capture thread. Errors are negative errno, with *what (static text) telling
// what failed.
#pragma once

#include "drivers/camera/camera.h"
#include "drivers/camera/frame_intake.h"

namespace farpoint::drivers {

class CameraDevice {
 public:
  virtual ~CameraDevice() = default;

  // Looks for the camera anew and starts its stream: kStreaming with what was agreed upon, else kAbsent or
  // kRefused with the reason, and close() is to follow.
  [[nodiscard]] virtual CameraEvent open() = 0;
  // Of whatever state.
  virtual void close() = 0;

  // While it streams, all below. After the first images no heap call of Farpoint's.

  // Readable when take() has something to give or to tell.
  [[nodiscard]] virtual int fd() const = 0;
  // The oldest image that has come; its bytes hold until give_back(). -EAGAIN: none has come. Any other error
  // ends the stream.
  [[nodiscard]] virtual int take(RawFrame* raw, const char** what) = 0;
  // What take() gave. An error ends the stream.
  [[nodiscard]] virtual int give_back(const char** what) = 0;
  // An image that could be used was given back: where the exposure is AutoExposure's, it follows.
  virtual void adapt_exposure(const ipc::GreyImage& image) = 0;
  // For this stream and all later ones.
  virtual void set_exposure(const ExposureOptions& options) = 0;
};

}  // namespace farpoint::drivers
