// SPDX-License-Identifier: Apache-2.0
#include "slam/geometry/point_alignment.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace farpoint::slam {

namespace {

Eigen::Vector3d mean(std::span<const Eigen::Vector3d> points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) sum += p;
  return sum / static_cast<double>(points.size());
}

}  // namespace

PointAlignment align_points(std::span<const Eigen::Vector3d> source, std::span<const Eigen::Vector3d> target,
                            AlignmentKind kind) {
  PointAlignment result;
  const size_t n = std::min(source.size(), target.size());
  if (n < 3) return result;
  source = source.first(n);
  target = target.first(n);
  const Eigen::Vector3d source_mean = mean(source), target_mean = mean(target);
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  double source_variance = 0.0;
  for (size_t i = 0; i < n; ++i) {
    const Eigen::Vector3d s = source[i] - source_mean;
    covariance += (target[i] - target_mean) * s.transpose();
    source_variance += s.squaredNorm();
  }
  covariance /= static_cast<double>(n);
  source_variance /= static_cast<double>(n);
  if (!covariance.allFinite() || !std::isfinite(source_variance)) return result;

  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  // The nearest orthogonal matrix may be a reflection; turning the weakest axis gives the nearest rotation.
  Eigen::Vector3d sign = Eigen::Vector3d::Ones();
  if (svd.matrixU().determinant() * svd.matrixV().determinant() < 0.0) sign(2) = -1.0;
  const Eigen::Matrix3d r = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();

  Sim3& s = result.S_target_source;
  if (kind == AlignmentKind::kSim3) {
    if (!(source_variance > 0.0)) return result;
    s.scale = svd.singularValues().dot(sign) / source_variance;
  }
  s.q = Eigen::Quaterniond(r).normalized();
  s.t = target_mean - s.scale * (s.q * source_mean);
  double sum = 0.0;
  for (size_t i = 0; i < n; ++i) sum += (target[i] - s * source[i]).squaredNorm();
  result.rmse = std::sqrt(sum / static_cast<double>(n));
  result.ok = true;
  return result;
}

}  // namespace farpoint::slam
