// SPDX-License-Identifier: Apache-2.0
// The driver below a live camera (live_camera.h): one device that is opened, streamed from and closed, any
// number of times. Capture thread only. Errors are negative errno; *what (static text) names the failed step.
#pragma once

#include "drivers/camera/camera.h"
#include "drivers/camera/frame_intake.h"

namespace farpoint::drivers {

class CameraDevice {
 public:
  virtual ~CameraDevice() = default;

  // Searches the camera and starts its stream. Returns kStreaming with the negotiated format, else kAbsent or
  // kRefused with the reason; the caller then calls close().
  [[nodiscard]] virtual CameraEvent open() = 0;
  // Allowed in every state.
  virtual void close() = 0;

  // All calls below require a running stream. Farpoint makes no heap call in them after the first images.

  // Readable when take() has a frame or an error.
  [[nodiscard]] virtual int fd() const = 0;
  // Takes the oldest finished frame; its bytes are valid until give_back(). -EAGAIN: none is finished. Any
  // other error ends the stream.
  [[nodiscard]] virtual int take(RawFrame* raw, const char** what) = 0;
  // Returns the frame of take() to the driver. An error ends the stream.
  [[nodiscard]] virtual int give_back(const char** what) = 0;
  // Feeds AutoExposure, where it is in use, with an accepted image. Called after give_back().
  virtual void adapt_exposure(const ipc::GreyImage& image) = 0;
  // Applies to this stream and all later ones.
  virtual void set_exposure(const ExposureOptions& options) = 0;
};

}  // namespace farpoint::drivers
