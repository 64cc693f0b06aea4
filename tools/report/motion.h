// SPDX-License-Identifier: Apache-2.0
// Poses and velocities of runs as curves, beside truth.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "tools/report/plot.h"
#include "tools/report/run_record.h"

namespace farpoint::tools::report {

struct Curve {
  std::string name;
  std::vector<Eigen::Vector2d> points;
  Style style;
};

// A vector at a time.
struct TimedVector {
  double time_s = 0.0;
  Eigen::Vector3d value;
};

// Way along a trajectory up to each pose.
[[nodiscard]] std::vector<double> way_along(const Trajectory& trajectory);
// The truth at the point of the vehicle that this run was compared at.
[[nodiscard]] Trajectory truth_for(const RunRecord& run, const Truth& truth);
// Every pose moved by the similarity.
[[nodiscard]] Trajectory moved_by(const slam::Sim3& similarity, Trajectory trajectory);
// Poses of one map.
[[nodiscard]] Trajectory of_map(std::int32_t map_id, const Trajectory& trajectory);

// x and y of each pose, with a break where poses are missing (three frame intervals) or the map changes.
[[nodiscard]] std::vector<Eigen::Vector2d> plan_of(const Trajectory& trajectory);

// Roll, pitch, yaw of R = Rz(yaw) Ry(pitch) Rx(roll), degrees, REP-103 axes.
[[nodiscard]] Eigen::Vector3d roll_pitch_yaw_deg(const Eigen::Quaterniond& q);
[[nodiscard]] std::vector<TimedVector> attitudes_deg(const Trajectory& trajectory);
// The mean direction of each component's angles, degrees.
[[nodiscard]] Eigen::Vector3d mean_angles_deg(const std::vector<TimedVector>& angles_deg);
// The same angles, each component within half a turn of the centre's.
[[nodiscard]] std::vector<TimedVector> angles_around(const Eigen::Vector3d& centre_deg,
                                                     std::vector<TimedVector> angles_deg);
// Rotation from truth to estimate about the body's axes, degrees.
[[nodiscard]] std::vector<TimedVector> attitude_errors_deg(const Trajectory& truth,
                                                           const Trajectory& estimate);

// Of the body in its axes, from poses a tenth of a second before and after; without orientation in the
// trajectory's axes.
[[nodiscard]] std::vector<TimedVector> velocities_of(const Trajectory& trajectory);
// Estimate minus the truth nearest in time, where that is within the pairing tolerance.
[[nodiscard]] std::vector<TimedVector> differences(const std::vector<TimedVector>& truth,
                                                   const std::vector<TimedVector>& estimate);

// One component over the time since start_s, between the two times; breaks where values are missing or an
// angle jumps by more than half a turn.
[[nodiscard]] std::vector<Eigen::Vector2d> component_over_time(const std::vector<TimedVector>& vectors,
                                                               int component, double start_s, double end_s);

}  // namespace farpoint::tools::report
