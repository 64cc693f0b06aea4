// SPDX-License-Identifier: Apache-2.0
// Draws a scene over one exposure of a camera. A software rasteriser finds the visible face of each pixel,
// then shades exact rays of the real lens model on that face.
//
// Anti-aliasing and motion blur come from several passes a frame, each at another place within the pixels and
// at another time of the exposure; their mean is the image. Between the passes the mip level is dithered, so
// that their mean is trilinear, and the level is chosen for the passes' own spacing, which is a threefold
// anisotropy for free. A rolling shutter is drawn in bands of a few rows, each with its own pose.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/geometry/se3.h"
#include "tools/simulate/world/scene.h"

namespace farpoint::tools::simulate {

// T_world_camera at a time.
using CameraPath = std::function<slam::SE3(double time_s)>;

struct Shutter {
  double mid_s = 0.0;       // middle of the exposure of the middle row
  double exposure_s = 0.0;  // of each row
  double row_time_s = 0.0;  // rolling shutter: one row to the next; 0 global
};

struct RendererOptions {
  int passes = 4;
  double blur_px = 1.2;  // width over which the passes of one pixel are spread: the lens
};

// The surface along the ray of a pixel.
struct SeenPoint {
  double distance_m = 0.0;  // along the ray, from the camera's centre; infinite for sky and clouds
  bool is_moving = false;   // on a moving object
  // The same for the pixel's neighbourhood; they differ at outlines.
  double nearest_m = 0.0, farthest_m = 0.0;
};

class Renderer {
 public:
  Renderer(const slam::Camera& camera, const RendererOptions& options);
  ~Renderer();
  Renderer(const Renderer&) = delete;
  Renderer& operator=(const Renderer&) = delete;

  // Radiance of each pixel, row by row, before lens fall-off and sensor; valid until the next call.
  const std::vector<float>& render(const Scene& scene, const CameraPath& path, const Shutter& shutter);

  // Truth: the surfaces along the given pixels' rays in the middle of their exposure. `radius_px` sizes the
  // neighbourhood.
  [[nodiscard]] std::vector<SeenPoint> look(const Scene& scene, const CameraPath& path,
                                            const Shutter& shutter,
                                            const std::vector<Eigen::Vector2d>& pixels, int radius_px = 2);

 private:
  class Impl;
  slam::Camera camera_;
  std::unique_ptr<Impl> impl_;
};

}  // namespace farpoint::tools::simulate
