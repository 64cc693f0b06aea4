// SPDX-License-Identifier: Apache-2.0
// The way back after frames without a pose: descriptors and perspective-n-point (PnP).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "slam/config.h"
#include "slam/geometry/pnp.h"
#include "slam/image/descriptor_scan.h"
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

  // Searches the landmarks seen last, in each camera's image by itself: around where the motion would have
  // led, then anywhere in the image. Then searches a part of the whole view, or the landmarks seen last
  // around where the vehicle stood. The next frame goes on where the work of this one ended. `last`: the last
  // confirmed motion. Needs a view. Not ok where too few of the landmarks that should be found are found, or
  // those found contradict each other.
  TrackOutcome relocalise(const Frame& frame, const Motion& last);

  // Work of the last frame, in units of about a nanosecond. Beyond kMostWork a frame begins no search in
  // turn.
  [[nodiscard]] double work() const { return work_; }
  static constexpr double kMostWork = 1.5e6;

  // Bytes of the work space.
  [[nodiscard]] std::size_t bytes() const;

 private:
  // A landmark and a feature that may show it.
  struct Correspondence {
    std::uint32_t view_index = 0;
    std::int32_t feature = -1;
  };

  struct Search {
    LandmarkSubset subset;
    const SE3* around;                // null: anywhere in the image
    std::size_t first = 0, step = 1;  // of the view's landmarks
  };

  // In the image of one camera.
  TrackOutcome run(const Frame& frame, int camera, const Search& search, double gap_s);
  void search_around(const Frame& frame, int camera, const Search& search, double gap_s);
  void search_image(const Frame& frame, int camera, const Search& search);
  void search_landmark(const FrameView& image, std::uint32_t view_index, const DescriptorQuery& query);
  TrackOutcome pose_from_correspondences(const Frame& frame, int index);

  const TrackingConfig config_;
  Matcher& matcher_;
  PoseRefiner& refiner_;
  StageListener* listener_ = nullptr;

  std::int64_t lost_since_utime_ = 0;  // time of the last confirmed motion: another one begins a search anew
  std::size_t next_ = 0;               // search of the next frame, after those that each begins with
  double work_ = 0;                    // of this frame, see kWorkOfFrame

  DescriptorScan scan_;
  std::vector<Correspondence> correspondences_;
  std::vector<Eigen::Vector3d> bearings_, points_;  // one a correspondence
  PnpWorkspace pnp_;
};

}  // namespace farpoint::slam
