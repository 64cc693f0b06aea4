// SPDX-License-Identifier: Apache-2.0
// The wheels in the map: their motion between keyframes, held against the images' motion, as factors of local
// bundle adjustment. A map without a metre gets theirs; by the metre that two cameras gave they are judged.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "slam/config.h"
#include "slam/fusion/wheel_factor.h"
#include "slam/fusion/wheel_track.h"
#include "slam/solver/motion_factors.h"

namespace farpoint::slam {

class WheelFusion final : public MotionFactors {
 public:
  // Driving time over which wheels and images are compared: longer than a wheel slips, shorter than the
  // images' scale drifts by a share that matters.
  static constexpr double kCompared_s = 20.0;
  // Largest sigma of a scale that is called metric.
  static constexpr double kMetricSigma = 0.05;

  // `point_m`: where the wheels measure, from the map's body, body axes.
  WheelFusion(const WheelConfig& config, const Eigen::Vector3d& point_m);

  // Samples in the order of time, as they left the sensor.
  void add(std::span<const WheelSample> samples);

  void add_to(const Map& map, std::span<const int> pose_index, const MapJudgement& judgement,
              BundleProblem* problem) override;
  MotionVerdict judge(Map* map, KeyframeHandle newest, const MapJudgement& judgement) override;

 private:
  // One interval of the chain, wheels against images.
  struct Comparison {
    ChainLink* link = nullptr;
    double log_ratio = 0;  // of wheels to images, metres a map unit
    double sigma = 0;      // its own
    bool yaw_agrees = true;
  };
  // What the intervals say together.
  struct Consensus {
    double log_ratio = 0, sigma = 0;
    int intervals = 0;  // that agree
    double share = 0;   // of all that were compared
  };
  struct Turning {
    double images = 0, both = 0;  // sums of squares and products of the turns, rad^2
    double turned_rad = 0;
  };

  void fill_links(Map* map, KeyframeHandle newest);
  [[nodiscard]] std::optional<WheelMotion> motion_of(const ChainLink& link) const;
  void compare(Map* map, KeyframeHandle newest);
  void add_comparison(const SE3& T_world_a, const SE3& T_world_b, ChainLink* link);
  void note_turn(const WheelMotion& wheels, double turn_rad);
  [[nodiscard]] bool turns_otherwise() const;
  // Whether the interval agrees with a ratio of this sigma.
  [[nodiscard]] bool agrees(const Comparison& c, double log_ratio, double sigma) const;
  [[nodiscard]] double median();
  [[nodiscard]] std::optional<Consensus> consensus();
  void mark_slips(const Consensus& consensus);
  void judge_factor(const Consensus& consensus, MotionVerdict* verdict) const;
  void judge_unit(const Consensus& consensus, const MapJudgement& judgement, MotionVerdict* verdict) const;

  const WheelConfig config_;
  const Eigen::Vector3d point_m_;
  WheelTrack track_;
  std::deque<WheelFactor> factors_;  // of the present problem
  std::vector<Comparison> comparisons_;
  std::vector<std::pair<double, double>> sorted_;  // log ratio, weight
  Turning turning_;
};

}  // namespace farpoint::slam
