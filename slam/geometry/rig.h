// The cameras on the body and where each of them stands.
#pragma once

#include <string>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/geometry/se3.h"

namespace farpoint::slam {

// One camera on the body. T_body_camera maps camera coordinates into the body's.
struct RigCamera {
  std::string name;
  Camera camera;
  SE3 T_body_camera;
};

// All cameras of one body. A map of unknown scale cannot express the lever arm between body and camera
// (metres) in its units: the body then stands at camera 0 with the body's axes.
struct Rig {
  std::vector<RigCamera> cameras;
};

}  // namespace farpoint::slam
