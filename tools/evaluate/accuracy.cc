// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluate/accuracy.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tools/evaluate/statistics.h"

namespace farpoint::tools {
namespace {

using slam::SE3;
using slam::Sim3;

constexpr double kDegreesPerRadian = 180.0 / std::numbers::pi;
constexpr std::size_t kMinPairs = 3;

// Index of the truth pose nearest to time_s. Precondition: truth is not empty.
std::size_t nearest_index(const std::vector<TimedPose>& truth, double time_s) {
  const auto later = std::lower_bound(truth.begin(), truth.end(), time_s,
                                      [](const TimedPose& p, double t) { return p.time_s < t; });
  const auto index = static_cast<std::size_t>(later - truth.begin());
  if (index == 0) return 0;
  if (index == truth.size()) return index - 1;
  const bool before = std::abs(truth[index - 1].time_s - time_s) < std::abs(truth[index].time_s - time_s);
  return before ? index - 1 : index;
}

// Columns of points, rows = 2 (planar) or 3.
Eigen::MatrixXd positions(const std::vector<PosePair>& pairs, bool of_truth, bool planar) {
  const Eigen::Index rows = planar ? 2 : 3;
  Eigen::MatrixXd points(rows, static_cast<Eigen::Index>(pairs.size()));
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Eigen::Vector3d& t = of_truth ? pairs[i].T_world_body.t : pairs[i].T_map_body.t;
    points.col(static_cast<Eigen::Index>(i)) = t.head(rows);
  }
  return points;
}

Sim3 similarity_of(const Eigen::MatrixXd& transform, double scale) {
  const Eigen::Index n = transform.rows() - 1;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  rotation.topLeftCorner(n, n) = transform.topLeftCorner(n, n) / scale;
  Sim3 similarity;
  similarity.scale = scale;
  similarity.q = Eigen::Quaterniond(rotation).normalized();
  similarity.t.head(n) = transform.topRightCorner(n, 1);
  return similarity;
}

std::vector<double> true_path_lengths(const std::vector<PosePair>& pairs) {
  std::vector<double> length_m(pairs.size(), 0.0);
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    length_m[i] = length_m[i - 1] + (pairs[i].T_world_body.t - pairs[i - 1].T_world_body.t).norm();
  }
  return length_m;
}

// What is left of the estimated motion a -> b after the true one is taken away.
SE3 motion_error(const SE3& truth_a, const SE3& truth_b, const SE3& estimate_a, const SE3& estimate_b,
                 double scale) {
  const SE3 truth = truth_a.inverse() * truth_b;
  SE3 estimate = estimate_a.inverse() * estimate_b;
  estimate.t *= scale;
  return estimate.inverse() * truth;
}

double rotation_angle_deg(const SE3& motion) {
  return slam::so3_log(motion.q).norm() * kDegreesPerRadian;
}

// Truth at time_s: between its two neighbours where they lie close enough together, else the nearest one.
std::optional<SE3> truth_at(const std::vector<TimedPose>& truth, double time_s, double tolerance_s) {
  const TimedPose& nearest = truth[nearest_index(truth, time_s)];
  if (std::abs(nearest.time_s - time_s) > tolerance_s) return std::nullopt;
  const auto later = std::lower_bound(truth.begin(), truth.end(), time_s,
                                      [](const TimedPose& p, double t) { return p.time_s < t; });
  if (later == truth.begin() || later == truth.end()) return nearest.pose;
  const TimedPose& a = *std::prev(later);
  const TimedPose& b = *later;
  const double gap_s = b.time_s - a.time_s;
  if (gap_s <= 0.0 || gap_s > 2.0 * tolerance_s) return nearest.pose;
  const double fraction = (time_s - a.time_s) / gap_s;
  return SE3{a.pose.q.slerp(fraction, b.pose.q), a.pose.t + fraction * (b.pose.t - a.pose.t)};
}

// Calls use(number of the length, error) for every segment of each length, begun every tenth pair.
template <typename Use>
void for_each_segment(const std::vector<PosePair>& pairs, double scale, const std::vector<double>& lengths_m,
                      Use&& use) {
  constexpr std::size_t kStep = 10;
  const std::vector<double> way_m = true_path_lengths(pairs);
  for (std::size_t first = 0; first < pairs.size(); first += kStep) {
    for (std::size_t i = 0; i < lengths_m.size(); ++i) {
      const auto end = std::upper_bound(way_m.begin() + static_cast<std::ptrdiff_t>(first), way_m.end(),
                                        way_m[first] + lengths_m[i]);
      if (end == way_m.end()) break;
      const auto last = static_cast<std::size_t>(end - way_m.begin());
      if (pairs[first].map_id != pairs[last].map_id) continue;
      use(i, motion_error(pairs[first].T_world_body, pairs[last].T_world_body, pairs[first].T_map_body,
                          pairs[last].T_map_body, scale));
    }
  }
}

void add_segment(const SE3& error, double length_m, SegmentError* sum) {
  sum->translation_percent += 100.0 * error.t.norm() / length_m;
  sum->rotation_deg_per_m += rotation_angle_deg(error) / length_m;
  ++sum->segments;
}

void divide_by_segments(SegmentError* sum) {
  sum->translation_percent /= static_cast<double>(sum->segments);
  sum->rotation_deg_per_m /= static_cast<double>(sum->segments);
}

double median_interval_s(const std::vector<PosePair>& pairs) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < pairs.size(); ++i) intervals.push_back(pairs[i].time_s - pairs[i - 1].time_s);
  return percentile(std::move(intervals), 50.0);
}

}  // namespace

const char* to_string(Alignment alignment) {
  switch (alignment) {
    case Alignment::kSim3:
      return "sim3";
    case Alignment::kSe3:
      return "se3";
    case Alignment::kNone:
      return "none";
  }
  return "?";
}

std::vector<PosePair> pair_nearest(const Trajectory& truth, const Trajectory& estimate, double tolerance_s) {
  std::vector<PosePair> pairs;
  if (truth.poses.empty()) return pairs;
  for (const TimedPose& p : estimate.poses) {
    const TimedPose& t = truth.poses[nearest_index(truth.poses, p.time_s)];
    if (std::abs(t.time_s - p.time_s) <= tolerance_s) pairs.push_back({p.time_s, t.pose, p.pose, p.map_id});
  }
  return pairs;
}

std::vector<PosePair> pair_interpolated(const Trajectory& truth, const Trajectory& estimate,
                                        double tolerance_s) {
  std::vector<PosePair> pairs;
  if (truth.poses.empty()) return pairs;
  for (const TimedPose& p : estimate.poses) {
    const std::optional<SE3> T_world_body = truth_at(truth.poses, p.time_s, tolerance_s);
    if (T_world_body) pairs.push_back({p.time_s, *T_world_body, p.pose, p.map_id});
  }
  return pairs;
}

std::optional<MapToWorld> align(const std::vector<PosePair>& pairs, Alignment alignment, bool planar) {
  if (pairs.size() < kMinPairs) return std::nullopt;
  if (alignment == Alignment::kNone) return MapToWorld{};
  const Eigen::MatrixXd source = positions(pairs, false, planar);
  const Eigen::MatrixXd target = positions(pairs, true, planar);
  const bool with_scale = alignment == Alignment::kSim3;
  const Eigen::VectorXd centre = source.rowwise().mean();
  if ((source.colwise() - centre).squaredNorm() <= 0.0) {  // neither rotation nor scale is defined
    MapToWorld moved;
    moved.S_world_map.t.head(source.rows()) = target.rowwise().mean() - centre;
    return moved;
  }
  const Eigen::MatrixXd transform = Eigen::umeyama(source, target, with_scale);
  const Eigen::Index n = transform.rows() - 1;
  const double scale = with_scale ? transform.topLeftCorner(n, n).col(0).norm() : 1.0;
  if (!std::isfinite(scale) || scale <= 0.0) return std::nullopt;
  return MapToWorld{similarity_of(transform, scale), scale};
}

std::optional<AbsoluteError> absolute_error(const std::vector<PosePair>& pairs, Alignment alignment,
                                            bool planar) {
  const std::optional<MapToWorld> map_to_world = align(pairs, alignment, planar);
  if (!map_to_world) return std::nullopt;
  AbsoluteError result;
  result.n = pairs.size();
  result.scale = map_to_world->scale;
  result.map_to_world = *map_to_world;
  const Eigen::Index rows = planar ? 2 : 3;
  std::vector<double> errors_m;
  errors_m.reserve(pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Eigen::Vector3d moved = map_to_world->S_world_map * pairs[i].T_map_body.t;
    errors_m.push_back((moved - pairs[i].T_world_body.t).head(rows).norm());
    if (i > 0) result.path_m += (pairs[i].T_world_body.t - pairs[i - 1].T_world_body.t).head(rows).norm();
  }
  result.rmse_m = root_mean_square(errors_m);
  result.median_m = percentile(errors_m, 50.0);
  result.max_m = *std::max_element(errors_m.begin(), errors_m.end());
  result.percent = 100.0 * result.rmse_m / std::max(result.path_m, 1e-9);
  return result;
}

std::optional<SegmentError> segment_error(const std::vector<PosePair>& pairs, double scale) {
  const std::vector<double> lengths_m = {100, 200, 300, 400, 500, 600, 700, 800};
  SegmentError result;
  for_each_segment(pairs, scale, lengths_m,
                   [&](std::size_t i, const SE3& error) { add_segment(error, lengths_m[i], &result); });
  if (result.segments == 0) return std::nullopt;
  divide_by_segments(&result);
  return result;
}

std::vector<LengthError> segment_errors(const std::vector<PosePair>& pairs, double scale,
                                        const std::vector<double>& lengths_m) {
  std::vector<LengthError> errors;
  errors.reserve(lengths_m.size());
  for (const double length_m : lengths_m) errors.push_back({length_m, {}});
  for_each_segment(pairs, scale, lengths_m, [&](std::size_t i, const SE3& error) {
    add_segment(error, lengths_m[i], &errors[i].error);
  });
  std::erase_if(errors, [](const LengthError& e) { return e.error.segments == 0; });
  for (LengthError& e : errors) divide_by_segments(&e.error);
  return errors;
}

std::optional<OneSecondError> one_second_error(const Trajectory& truth, const Trajectory& estimate,
                                               double scale, double tolerance_s) {
  const std::vector<PosePair> pairs = pair_interpolated(truth, estimate, tolerance_s);
  if (pairs.size() < 2) return std::nullopt;
  // Far above any camera's rate. Poses of a damaged log may all lie within one second.
  constexpr std::size_t kMostPosesASecond = 1000;
  const double half_frame_s = 0.5 * median_interval_s(pairs);
  OneSecondError result;
  std::vector<double> translations_m, rotations_deg;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    double best_offset_s = half_frame_s;
    std::optional<SE3> one_second;
    const std::size_t end = std::min(pairs.size(), i + kMostPosesASecond);
    for (std::size_t j = i + 1; j < end && pairs[j].time_s - pairs[i].time_s <= 1.0 + half_frame_s; ++j) {
      if (pairs[j].map_id != pairs[i].map_id) continue;
      const SE3 error = motion_error(pairs[i].T_world_body, pairs[j].T_world_body, pairs[i].T_map_body,
                                     pairs[j].T_map_body, scale);
      result.rotation_max_deg = std::max(result.rotation_max_deg, rotation_angle_deg(error));
      result.translation_max_m = std::max(result.translation_max_m, error.t.norm());
      const double offset_s = std::abs(pairs[j].time_s - pairs[i].time_s - 1.0);
      if (offset_s > best_offset_s) continue;
      best_offset_s = offset_s;
      one_second = error;
    }
    if (!one_second) continue;
    translations_m.push_back(one_second->t.norm());
    rotations_deg.push_back(rotation_angle_deg(*one_second));
  }
  result.pairs = rotations_deg.size();
  result.translation_rmse_m = root_mean_square(translations_m);  // NaN where no pair is a second apart
  result.rotation_rmse_deg = root_mean_square(rotations_deg);
  return result;
}

}  // namespace farpoint::tools
