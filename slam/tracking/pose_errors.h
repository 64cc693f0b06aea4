// SPDX-License-Identifier: Apache-2.0
// What a pose's error is made of: noise of the frame's own measurements, and errors of the landmarks, which
// all frames that see them share.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "slam/map/landmark.h"
#include "slam/tracking/matcher.h"
#include "slam/tracking/pose_solver.h"

namespace farpoint::slam {

// Covariances of a body pose, order (dt, dphi) of se3.h, map units.
struct PoseErrors {
  // Of the frame's measurements and of the landmarks that they are of.
  Matrix6d noise = Matrix6d::Zero();
  // The part of it that is the frame's own.
  Matrix6d own = Matrix6d::Zero();
  // Against the frame before: its own part, and that of landmarks which only one of both used.
  Matrix6d step = Matrix6d::Zero();
  // Between the landmarks that earlier frames have used and those that this frame is the first to use: what a
  // full exchange of the former by the latter adds to the error of the way.
  Matrix6d exchanged = Matrix6d::Zero();
  // Distance at which landmarks hold the translation: the mean, weighted by their information. Map units.
  double holding_distance = 0;
  bool known = false;
};

// Tracking's thread; makes no heap call after construction.
class PoseErrorModel {
 public:
  // `landmarks`: slots of the map's pool. `matches`: most of a frame. `view_landmarks`: most of a local view.
  PoseErrorModel(std::size_t landmarks, std::size_t matches, std::size_t view_landmarks);

  // A new map begins: no landmark has been used.
  void begin_map();
  // The accepted pose of a frame, its matches, and the measurements in the same order.
  void measure(const SE3& T_world_body, const Matcher& matcher,
               std::span<const PoseMeasurement> measurements);
  // Of the last frame measured.
  [[nodiscard]] const PoseErrors& errors() const { return errors_; }

  [[nodiscard]] std::size_t bytes() const;

 private:
  // What the last frame that used a landmark left of it in the image, in claimed sigmas.
  struct Used {
    LandmarkHandle landmark;
    std::uint32_t frame = 0;
    Eigen::Vector2f residual = Eigen::Vector2f::Zero();
  };
  // How the errors of a landmark pull the pose, before the solver's inverse: the place of its patch in two
  // directions, its depth; one claimed sigma each.
  struct Pull {
    bool is_new = false;      // no frame has used it
    bool is_changed = false;  // the frame before has not
    Eigen::Matrix<double, 6, 2> by_patch;
    Vector6d by_depth;
  };
  struct Sums;

  [[nodiscard]] Pull& pull_of(const Matcher& matcher, const Match& match);
  void compare_residuals(LandmarkHandle landmark, const Eigen::Vector2d& residual, Sums* sums);
  void learn_variances(const Sums& sums);
  void solve(const Sums& sums);

  std::vector<Used> used_;             // one a landmark slot of the map
  std::vector<Pull> pulls_;            // of the frame's landmarks
  std::vector<std::int32_t> pull_of_;  // one a landmark of the view: index in pulls_, or -1
  std::uint32_t frame_ = 0;
  // Means over the last frames, in squares of the claimed sigmas.
  double own_variance_ = 0, shared_variance_ = 0;
  int frames_learned_ = 0;
  PoseErrors errors_;
};

}  // namespace farpoint::slam
