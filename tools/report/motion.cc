// SPDX-License-Identifier: Apache-2.0
#include "tools/report/motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tools/evaluate/statistics.h"

namespace farpoint::tools::report {
namespace {

constexpr double kDegreesPerRadian = 180.0 / std::numbers::pi;
// Neighbours further apart than this many frame intervals have something missing between them.
constexpr double kMissingIntervals = 3.0;

const Eigen::Vector2d& line_break() {
  static const Eigen::Vector2d kBreak(NAN, NAN);
  return kBreak;
}

template <typename Timed>
double longest_step_s(const std::vector<Timed>& items) {
  std::vector<double> steps_s;
  for (std::size_t i = 1; i < items.size(); ++i) steps_s.push_back(items[i].time_s - items[i - 1].time_s);
  return kMissingIntervals * percentile(std::move(steps_s), 50.0);
}

}  // namespace

std::vector<double> way_along(const Trajectory& trajectory) {
  std::vector<double> way;
  for (std::size_t i = 0; i < trajectory.poses.size(); ++i) {
    const double step = i == 0 ? 0.0 : (trajectory.poses[i].pose.t - trajectory.poses[i - 1].pose.t).norm();
    way.push_back(i == 0 ? 0.0 : way.back() + step);
  }
  return way;
}

Trajectory truth_for(const RunRecord& run, const Truth& truth) {
  Trajectory moved = truth.body;
  if (run.metrics && std::string(run.metrics->truth_point) == "camera0")
    move_reference_point({Eigen::Quaterniond::Identity(), truth.T_body_camera0.t}, &moved);
  return moved;
}

Trajectory moved_by(const slam::Sim3& similarity, Trajectory trajectory) {
  for (TimedPose& p : trajectory.poses) p.pose = similarity * p.pose;
  return trajectory;
}

Trajectory of_map(std::int32_t map_id, const Trajectory& trajectory) {
  Trajectory part = trajectory;
  std::erase_if(part.poses, [map_id](const TimedPose& p) { return p.map_id != map_id; });
  return part;
}

std::vector<Eigen::Vector2d> plan_of(const Trajectory& trajectory) {
  const double longest_s = longest_step_s(trajectory.poses);
  std::vector<Eigen::Vector2d> points;
  for (std::size_t i = 0; i < trajectory.poses.size(); ++i) {
    const TimedPose& p = trajectory.poses[i];
    if (i > 0) {
      const TimedPose& before = trajectory.poses[i - 1];
      if (p.time_s - before.time_s > longest_s || p.map_id != before.map_id) points.push_back(line_break());
    }
    points.emplace_back(p.pose.t.head<2>());
  }
  return points;
}

Eigen::Vector3d roll_pitch_yaw_deg(const Eigen::Quaterniond& q) {
  const Eigen::Matrix3d R = q.toRotationMatrix();
  return kDegreesPerRadian * Eigen::Vector3d(std::atan2(R(2, 1), R(2, 2)),
                                             std::asin(std::clamp(-R(2, 0), -1.0, 1.0)),
                                             std::atan2(R(1, 0), R(0, 0)));
}

std::vector<TimedVector> attitudes_deg(const Trajectory& trajectory) {
  std::vector<TimedVector> attitudes;
  attitudes.reserve(trajectory.poses.size());
  for (const TimedPose& p : trajectory.poses) attitudes.push_back({p.time_s, roll_pitch_yaw_deg(p.pose.q)});
  return attitudes;
}

Eigen::Vector3d mean_angles_deg(const std::vector<TimedVector>& angles_deg) {
  Eigen::Vector3d sines = Eigen::Vector3d::Zero(), cosines = Eigen::Vector3d::Zero(), means;
  for (const TimedVector& a : angles_deg) {
    sines += (a.value / kDegreesPerRadian).array().sin().matrix();
    cosines += (a.value / kDegreesPerRadian).array().cos().matrix();
  }
  for (int i = 0; i < 3; ++i) means[i] = kDegreesPerRadian * std::atan2(sines[i], cosines[i]);
  return means;
}

std::vector<TimedVector> angles_around(const Eigen::Vector3d& centre_deg,
                                       std::vector<TimedVector> angles_deg) {
  constexpr double kTurn_deg = 360.0;
  for (TimedVector& a : angles_deg) {
    for (int i = 0; i < 3; ++i)
      a.value[i] = centre_deg[i] + std::remainder(a.value[i] - centre_deg[i], kTurn_deg);
  }
  return angles_deg;
}

std::vector<TimedVector> attitude_errors_deg(const Trajectory& truth, const Trajectory& estimate) {
  std::vector<TimedVector> errors;
  for (const PosePair& pair : pair_interpolated(truth, estimate)) {
    const Eigen::Quaterniond turn = pair.T_world_body.q.conjugate() * pair.T_map_body.q;
    errors.push_back({pair.time_s, kDegreesPerRadian * slam::so3_log(turn.normalized())});
  }
  return errors;
}

std::vector<TimedVector> velocities_of(const Trajectory& trajectory) {
  constexpr double kHalf_s = 0.1 - 1e-3, kLongest_s = 2.5;
  const std::vector<TimedPose>& poses = trajectory.poses;
  std::vector<TimedVector> velocities;
  std::size_t before = 0, after = 0;
  for (const TimedPose& p : poses) {
    while (before + 1 < poses.size() && poses[before + 1].time_s <= p.time_s - kHalf_s) ++before;
    while (after + 1 < poses.size() && poses[after].time_s < p.time_s + kHalf_s) ++after;
    const double span_s = poses[after].time_s - poses[before].time_s;
    if (!(span_s >= kHalf_s) || span_s > kLongest_s) continue;
    const Eigen::Vector3d velocity = (poses[after].pose.t - poses[before].pose.t) / span_s;
    velocities.push_back({p.time_s, p.pose.q.conjugate() * velocity});
  }
  return velocities;
}

std::vector<TimedVector> differences(const std::vector<TimedVector>& truth,
                                     const std::vector<TimedVector>& estimate) {
  std::vector<TimedVector> errors;
  for (const TimedVector& e : estimate) {
    auto nearest = std::lower_bound(truth.begin(), truth.end(), e.time_s,
                                    [](const TimedVector& t, double time_s) { return t.time_s < time_s; });
    const bool earlier_is_nearer =
        nearest != truth.begin() &&
        (nearest == truth.end() || e.time_s - std::prev(nearest)->time_s < nearest->time_s - e.time_s);
    if (earlier_is_nearer) --nearest;
    if (nearest == truth.end() || std::abs(nearest->time_s - e.time_s) > kPairingTolerance_s) continue;
    errors.push_back({e.time_s, e.value - nearest->value});
  }
  return errors;
}

std::vector<Eigen::Vector2d> component_over_time(const std::vector<TimedVector>& vectors, int component,
                                                 double start_s, double end_s) {
  constexpr double kHalfTurn_deg = 180.0;
  const double longest_s = longest_step_s(vectors);
  std::vector<Eigen::Vector2d> points;
  const TimedVector* before = nullptr;
  for (const TimedVector& v : vectors) {
    if (v.time_s < start_s || v.time_s > end_s) continue;
    const bool is_apart =
        before != nullptr && (v.time_s - before->time_s > longest_s ||
                              std::abs(v.value[component] - before->value[component]) > kHalfTurn_deg);
    if (is_apart) points.push_back(line_break());
    points.emplace_back(v.time_s - start_s, v.value[component]);
    before = &v;
  }
  return points;
}

}  // namespace farpoint::tools::report
