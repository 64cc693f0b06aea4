// SPDX-License-Identifier: Apache-2.0
// Errors of an estimated trajectory against truth: pairing, alignment, absolute and relative errors.
//
// Pairing and absolute error are defined as in the independent check that the tests run beside this code:
// nearest truth pose within a tolerance, Umeyama alignment (Umeyama 1991) over all paired positions, RMS of
// what remains.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "slam/geometry/se3.h"
#include "tools/trajectory/trajectory.h"

namespace farpoint::tools {

enum class Alignment { kSim3, kSe3, kNone };
[[nodiscard]] const char* to_string(Alignment alignment);

inline constexpr double kPairingTolerance_s = 0.02;

struct PosePair {
  double time_s = 0.0;     // of the estimate
  slam::SE3 T_world_body;  // truth nearest in time
  slam::SE3 T_map_body;    // estimate
  std::int32_t map_id = 0;
};

// Returns one pair for each estimate with a truth pose within tolerance_s; of two equally near ones the
// later.
[[nodiscard]] std::vector<PosePair> pair_nearest(const Trajectory& truth, const Trajectory& estimate,
                                                 double tolerance_s = kPairingTolerance_s);

// The same with truth interpolated at exactly the estimate's times.
[[nodiscard]] std::vector<PosePair> pair_interpolated(const Trajectory& truth, const Trajectory& estimate,
                                                      double tolerance_s = kPairingTolerance_s);

// The similarity from map to world coordinates: p_world = scale * R * p_map + t.
struct MapToWorld {
  slam::Sim3 S_world_map;
  double scale = 1.0;  // of S_world_map; 1 for se3 and none
};

// Least squares over all pairs (Umeyama). planar: only x and y count, and z is only scaled. An estimate in a
// single point is only moved (scale 1). Empty with fewer than three pairs, and for truth in a single point
// when a scale is requested.
[[nodiscard]] std::optional<MapToWorld> align(const std::vector<PosePair>& pairs, Alignment alignment,
                                              bool planar);

struct AbsoluteError {
  std::size_t n = 0;    // pairs
  double path_m = 0.0;  // length of the truth through the paired poses
  double scale = 1.0;
  double rmse_m = 0.0, median_m = 0.0, max_m = 0.0;
  double percent = 0.0;  // rmse of the path
  MapToWorld map_to_world;
};
[[nodiscard]] std::optional<AbsoluteError> absolute_error(const std::vector<PosePair>& pairs,
                                                          Alignment alignment, bool planar);

// Relative errors over segments of 100, 200, .. 800 m of the true path, begun every tenth pair (KITTI's
// odometry measure): the mean over all segments of all lengths.
struct SegmentError {
  std::size_t segments = 0;
  double translation_percent = 0.0;
  double rotation_deg_per_m = 0.0;
};
// `scale`: the alignment's, applied to the estimate's translations. Empty for a path under 100 m.
[[nodiscard]] std::optional<SegmentError> segment_error(const std::vector<PosePair>& pairs, double scale);

// Mean relative errors over segments of one length of the true path.
struct LengthError {
  double length_m = 0.0;
  SegmentError error;
};
// One entry a length that at least one segment has, in the given ascending order.
[[nodiscard]] std::vector<LengthError> segment_errors(const std::vector<PosePair>& pairs, double scale,
                                                      const std::vector<double>& lengths_m);

// Relative errors over one second. Truth is interpolated at the estimate's times (a hand-held camera turns by
// degrees within the pairing tolerance). Pairs of poses of different maps are no pairs.
struct OneSecondError {
  std::size_t pairs = 0;  // one second apart, to half a frame
  double translation_rmse_m = 0.0;
  double rotation_rmse_deg = 0.0;
  double rotation_max_deg = 0.0;   // over all pairs at most one second apart, so that every pose is judged
  double translation_max_m = 0.0;  // the same
};
[[nodiscard]] std::optional<OneSecondError> one_second_error(const Trajectory& truth,
                                                             const Trajectory& estimate, double scale,
                                                             double tolerance_s = kPairingTolerance_s);

}  // namespace farpoint::tools
