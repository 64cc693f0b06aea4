// SPDX-License-Identifier: Apache-2.0
// Waits for two frames whose matches say how the camera moved and where the points are. Invents nothing:
// rotation alone, a plane that can be read two ways, or too little parallax mean waiting.
//
// Tracking's thread; makes no heap call after construction while frames keep to the configured capacities.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "slam/config.h"
#include "slam/geometry/two_view.h"
#include "slam/map/refusal.h"
#include "slam/map/request.h"

namespace farpoint::slam {

class Initialiser {
 public:
  // Frames that are kept to be posed once there is a map.
  static constexpr std::size_t kHistoryFrames = 60;
  // Least time between two frames of which one may become the next reference: these keep their pixels.
  static constexpr double kCandidateSpacing_s = 0.2;

  // `camera`: whose images are used.
  Initialiser(const EstimatorConfig& config, const Rig& rig, int camera = 0);

  // A pair once there is one, in use until the next call; null before. The frame joins the history either
  // way.
  const InitialPair* add(const std::shared_ptr<Frame>& frame);
  // The frame joins the history, and nothing is searched: a pair is being made into a map.
  void remember(std::shared_ptr<Frame> frame);
  void clear();
  // Frames waited with, oldest first: to be posed once there is a map.
  [[nodiscard]] const std::vector<std::shared_ptr<Frame>>& history() const { return history_; }
  [[nodiscard]] int last_matches() const { return last_matches_; }
  // Why the last frame gave no pair.
  [[nodiscard]] const Refusal& refusal() const { return refusal_; }
  // Bytes of the work space.
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Pairing {
    std::size_t feature_first = 0, feature_second = 0;
  };
  [[nodiscard]] const FrameView& view_of(const Frame& frame) const { return frame.views[camera_]; }
  void set_reference(std::shared_ptr<Frame> frame);
  void forget_pixels(std::int64_t half_utime);
  // Fills pairs_.
  void match(const Frame& frame);
  // Fills pair_ from pairs_. False where they give no motion or too few points.
  [[nodiscard]] bool solve(const std::shared_ptr<Frame>& frame);
  void unproject_pairs(const Frame& frame);
  [[nodiscard]] bool shows_parallax(const TwoViewResult& motion) const;
  [[nodiscard]] Refusal refusal_of(const TwoViewResult& motion, const Frame& frame);
  [[nodiscard]] Refusal standing_or_blocked(const Frame& frame) const;

  const EstimatorConfig config_;
  const int camera_;
  const RigCamera rig_camera_;
  std::vector<std::shared_ptr<Frame>> history_;
  std::shared_ptr<Frame> reference_;
  std::vector<Eigen::Vector2f> expected_px_;  // where each reference feature was seen last
  std::vector<Pairing> pairs_;
  InitialPair pair_;
  Refusal refusal_;
  int last_matches_ = 0;
  int most_matches_ = 0;  // with the present reference
  // Work space of one match.
  std::vector<std::int32_t> owner_, found_;  // one a feature of the frame, one of the reference
  std::vector<int> owner_distance_;          // one a feature of the frame
  // Work space of one solution: one entry a pair of which both features have a ray.
  std::vector<Eigen::Vector3d> first_, second_;
  std::vector<Pairing> used_;
  std::vector<double> parallax_rad_;  // of inliers
  TwoViewWorkspace two_view_;
};

}  // namespace farpoint::slam
