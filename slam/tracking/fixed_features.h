// SPDX-License-Identifier: Apache-2.0
// Features that keep their place in the image although the camera turned: of a bonnet, a rotor, dirt on the
// lens. A turn moves every part of the world in the image, however far it is; straight ahead far points stay
// too, and prove nothing.
#pragma once

#include <cstdint>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/geometry/se3.h"
#include "slam/image/feature_grid.h"

namespace farpoint::slam {

// Tracking's thread; makes no heap call after construction.
class FixedFeatures {
 public:
  // Largest share() of a world without anything fixed: features that look alike.
  static constexpr double kMostShare = 0.04;

  // Room for `features` of a frame.
  explicit FixedFeatures(std::size_t features);

  // A frame with a pose: its features, and the camera's orientation in the map.
  void add(const FeatureSet& set, const FeatureGrid& grid, const Camera& camera,
           const Eigen::Quaterniond& q_map_camera, std::int64_t utime);
  // The next frame's orientation does not continue from the last one's.
  void forget_reference() { reference_.features.clear(); }

  // Of the features that the last turns should have moved, those that kept their place. 0 before the first
  // two turns.
  [[nodiscard]] double share() const;

  [[nodiscard]] std::size_t bytes() const;

 private:
  void compare(const FeatureSet& set, const FeatureGrid& grid, const Camera& camera,
               const Eigen::Quaterniond& q_now_reference);
  void set_reference(const FeatureSet& set, const Eigen::Quaterniond& q_map_camera, std::int64_t utime);

  FeatureSet reference_;
  Eigen::Quaterniond q_map_reference_ = Eigen::Quaterniond::Identity();
  std::int64_t reference_utime_ = 0;
  double last_share_ = 0, share_before_ = 0;  // of the last two turns
};

}  // namespace farpoint::slam
