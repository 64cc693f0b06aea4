// SPDX-License-Identifier: Apache-2.0
// The simulated drives: camera, motion, surroundings and noise.
#pragma once

#include <string>
#include <vector>

#include "slam/config.h"
#include "tests/scenes/world.h"

namespace farpoint::sim {

// Errors of the image processing.
struct NoiseConfig {
  double corner_sigma_px = 0.5;  // of a corner, in pixels of its level, before it snaps to a whole one
  double align_sigma_px = 0.2;   // of an aligned patch, in pixels of the level it is aligned on
  // Bias of a real patch whose size changes, the same for one host patch: level pixels (1 sigma) for a
  // change by e. Not part of the reported sigma.
  double align_bias_px = 0.0;
  double align_failure = 0.04;    // an alignment that gives up although the point is there
  double alike_alignment = 0.5;   // a patch that settles on a point that looks alike
  double detection = 0.85;        // a visible corner is found
  double occlusion = 0.1;         // a point is hidden for a while ...
  double occlusion_s = 1.5;       // ... of this length
  double outliers = 0.10;         // corners without a point, share of all
  int flip_words = 4;             // descriptor bits flip with probability 2^-flip_words
  double angle_sigma_rad = 0.09;  // orientation of a corner
  double level_jitter = 0.15;     // a corner found one level off
};

enum class Motion { kVehicle, kDrone, kHoverThenFly, kRotation };

struct Scene {
  std::string name;
  slam::Camera::Parameters camera;
  slam::SE3 T_body_camera;
  double rate_hz = 10;
  int frames = 300;
  int features = 1000;       // corners a frame
  double focal_error = 0.0;  // the estimator's focal length is larger by this share
  Motion motion = Motion::kVehicle;
  int still_frames = 0;  // at the start, without any translation: no monocular map can pose them
  double speed_m_s = 10;
  std::vector<Path::Segment> path;
  Path::Beyond beyond = Path::Beyond::kStraight;
  std::vector<Layer> layers;
  double repetition = 0.12;
  NoiseConfig noise;
  bool far = true;  // has points far enough for virtual map points to matter

  [[nodiscard]] slam::Rig rig() const;
  // The rig that the estimator is given.
  [[nodiscard]] slam::Rig believed_rig() const;
  // The shipped configuration, for this camera and number of corners.
  [[nodiscard]] slam::EstimatorConfig estimator(slam::LandmarkMode mode) const;
};

// straight, highway, turning, hovering, rotating, endless, hover_start. Throws std::invalid_argument for
// other names.
[[nodiscard]] Scene make_scene(const std::string& name);
[[nodiscard]] std::vector<std::string> scene_names();

// Where the body is, seconds after the start.
class MotionModel {
 public:
  MotionModel(const Scene& scene, std::uint64_t seed);
  [[nodiscard]] slam::SE3 T_world_body(double t_s, Path* path) const;
  // Arc length along the path.
  [[nodiscard]] double travelled_m(double t_s) const;

 private:
  Motion motion_;
  double speed_m_s_;
  double phase_[6] = {};
};

}  // namespace farpoint::sim
