// SPDX-License-Identifier: Apache-2.0
// The window of local bundle adjustment: from the map to a problem for the solver, and back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "slam/config.h"
#include "slam/map/map.h"
#include "slam/mapping/counts.h"
#include "slam/solver/bundle_problem.h"

namespace farpoint::slam {

// Free poses are those of a keyframe and its most covisible neighbours. Older observers of their landmarks
// are fixed and hold the gauge.
class Window {
 public:
  // All three must outlive this. Allocates room for the largest window.
  Window(const EstimatorConfig& config, Map* map, MappingCounts* counts);

  // Builds the problem around `centre`, within the limits of MappingConfig. Precondition: `centre` is alive.
  // `further_sigma_factor`: of the sigmas of further cameras' measurements (FurtherTrust).
  void build(KeyframeHandle centre, double further_sigma_factor = 1.0);

  // To be solved in place. Poses: those of keyframes() in their order, then fixed ones.
  [[nodiscard]] BundleProblem& problem() { return problem_; }
  [[nodiscard]] const BundleProblem& problem() const { return problem_; }
  [[nodiscard]] const std::vector<KeyframeHandle>& keyframes() const { return keyframes_; }
  // By keyframe slot: index of its pose in the problem, or -1.
  [[nodiscard]] const std::vector<int>& pose_index() const { return pose_index_; }
  // By point of the problem.
  [[nodiscard]] const std::vector<LandmarkHandle>& landmarks() const { return landmarks_; }

  // Writes poses, inverse depths and sigmas of the solved problem into the map, then removes the sightings
  // whose chi2 exceeds kChi2TwoDof. Returns the median factor of the inverse depths.
  // Precondition: the map has not changed since build().
  std::optional<double> take_back();

  // By point: derivative of the bearing by the host pixel, anchor axes; zero where another camera is the
  // anchor. Takes the measurements from points whose landmark take_back() removed.
  [[nodiscard]] std::vector<Eigen::Matrix<double, 3, 2>> bearing_derivatives(int camera);

  [[nodiscard]] std::size_t bytes() const { return problem_.bytes(); }

 private:
  void select_keyframes(KeyframeHandle centre);
  void select_landmarks();
  void select_landmarks_of(const KeyframeView& view);
  void add_pose(KeyframeHandle keyframe, bool fixed);
  void fix_observers();
  void fix_oldest();
  void add_points();
  void add_point(const Landmark& landmark);
  // Whether the sighting is a measurement of the problem.
  [[nodiscard]] bool is_measured(const Observation& o) const {
    return o.sigma_px > 0.0F && pose_index_[o.keyframe.index] >= 0;
  }
  void take_back_poses();
  void remove_outliers(LandmarkHandle handle, const BundleProblem::Point& point);

  const EstimatorConfig& config_;
  Map& map_;
  MappingCounts& counts_;
  BundleProblem problem_;
  double further_sigma_factor_ = 1.0;
  std::vector<KeyframeHandle> keyframes_;  // of the free poses
  std::vector<LandmarkHandle> landmarks_;
  std::vector<int> pose_index_;  // by keyframe slot: index in problem_.poses, or -1
  // Work space.
  std::vector<std::uint8_t> is_taken_;  // by landmark slot
  std::vector<int> uses_;               // by keyframe slot
  std::vector<KeyframeHandle> observers_;
  std::vector<Observer> outliers_;
  std::vector<double> scale_changes_;
};

}  // namespace farpoint::slam
