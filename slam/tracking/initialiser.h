// SPDX-License-Identifier: Apache-2.0
// Waits for two frames whose matches say how the camera moved and where the points are. Invents nothing:
// rotation alone, a plane that can be read two ways, or too little parallax mean waiting.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "slam/config.h"
#include "slam/map/request.h"

namespace farpoint::slam {

class Initialiser {
 public:
  // Frames that are kept to be posed once there is a map.
  static constexpr std::size_t kHistoryFrames = 60;

  // `camera`: whose images are used.
  Initialiser(const EstimatorConfig& config, const Rig& rig, int camera = 0);

  // A pair once there is one. The frame joins the history either way.
  std::optional<InitialPair> add(const std::shared_ptr<Frame>& frame);
  // The frame joins the history, and nothing is searched: a pair is being made into a map.
  void remember(std::shared_ptr<Frame> frame);
  void clear();
  // Frames waited with, oldest first: to be posed once there is a map.
  [[nodiscard]] const std::vector<std::shared_ptr<Frame>>& history() const { return history_; }
  [[nodiscard]] int last_matches() const { return last_matches_; }

 private:
  struct Pairing {
    std::size_t feature_first = 0, feature_second = 0;
  };
  [[nodiscard]] const FrameView& view_of(const Frame& frame) const { return frame.views[camera_]; }
  void set_reference(std::shared_ptr<Frame> frame);
  void forget_pixels(std::uint64_t age);
  void match(const Frame& frame, std::vector<Pairing>* out);
  std::optional<InitialPair> solve(const std::shared_ptr<Frame>& frame,
                                   const std::vector<Pairing>& pairs) const;

  const EstimatorConfig config_;
  const int camera_;
  const RigCamera rig_camera_;
  std::vector<std::shared_ptr<Frame>> history_;
  std::shared_ptr<Frame> reference_;
  std::vector<Eigen::Vector2f> expected_px_;  // where each reference feature was seen last
  std::vector<Pairing> pairs_;
  int last_matches_ = 0;
  int most_matches_ = 0;  // with the present reference
};

}  // namespace farpoint::slam
