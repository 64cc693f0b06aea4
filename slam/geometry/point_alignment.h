// SPDX-License-Identifier: Apache-2.0
// Alignment of two sets of points: trajectories against truth, maps against maps.
#pragma once

#include <Eigen/Core>
#include <span>

#include "slam/geometry/se3.h"

namespace farpoint::slam {

enum class AlignmentKind { kSim3, kSe3 };

struct PointAlignment {
  // False for fewer than three pairs, for numbers that are not finite, and for a sim3 whose source points
  // coincide.
  bool ok = false;
  Sim3 S_target_source;  // scale 1 for kSe3
  double rmse = 0.0;     // of the distances after alignment, units of the target
};

// Least-squares alignment target[i] ~ S * source[i]: Umeyama, "Least-squares estimation of transformation
// parameters between two point patterns", PAMI 1991, with the correction that keeps a reflection out. Points
// on one line leave the turn about it open; any of the equally good solutions is returned then.
[[nodiscard]] PointAlignment align_points(std::span<const Eigen::Vector3d> source,
                                          std::span<const Eigen::Vector3d> target, AlignmentKind kind);

}  // namespace farpoint::slam
