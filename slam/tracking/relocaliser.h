// SPDX-License-Identifier: Apache-2.0
// The way back after frames without a pose: descriptors and perspective-n-point (PnP).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "slam/config.h"
#include "slam/geometry/pnp.h"
#include "slam/image/descriptor_search.h"
#include "slam/map/frame.h"
#include "slam/stages.h"
#include "slam/tracking/constant_velocity.h"
#include "slam/tracking/matcher.h"
#include "slam/tracking/pose_refiner.h"
#include "slam/tracking/track_outcome.h"

namespace farpoint::slam {

// Tracking's thread; makes no heap call after construction.
class Relocaliser {
 public:
  // `matcher` and `refiner` must outlive the relocaliser.
  Relocaliser(const EstimatorConfig& config, Matcher* matcher, PoseRefiner* refiner);
  void listen(StageListener* listener) { listener_ = listener; }

  // Searches the landmarks seen last, then the whole view, in each camera's image by itself: around where the
  // motion would have led, where the vehicle was last, and anywhere in the image. `last`: the last confirmed
  // motion. Needs a view. Not ok where too few landmarks are found, or those found contradict each other.
  TrackOutcome relocalise(const Frame& frame, const Motion& last);

  // Bytes of the work space.
  [[nodiscard]] std::size_t bytes() const;

 private:
  // A landmark and a feature that may show it.
  struct Correspondence {
    std::uint32_t view_index = 0;
    std::int32_t feature = -1;
  };

  // All in the image of one camera.
  void search_around(const Frame& frame, int camera, const SE3& T_world_body, double radius_px,
                     LandmarkSubset subset);
  void search_image(const Frame& frame, int index, LandmarkSubset subset);
  void search_landmark(const FrameView& image, std::uint32_t view_index, const DescriptorQuery& query);
  TrackOutcome pose_from_correspondences(const Frame& frame, int index);

  const TrackingConfig config_;
  const int levels_;  // of the pyramid
  Matcher& matcher_;
  PoseRefiner& refiner_;
  StageListener* listener_ = nullptr;

  std::vector<Correspondence> correspondences_;
  std::vector<Eigen::Vector3d> bearings_, points_;  // one a correspondence
  PnpWorkspace pnp_;
};

}  // namespace farpoint::slam
