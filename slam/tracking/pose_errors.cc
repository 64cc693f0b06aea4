// SPDX-License-Identifier: Apache-2.0
#include "slam/tracking/pose_errors.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>

#include "slam/geometry/robust.h"
#include "slam/tracking/work_space.h"

namespace farpoint::slam {

namespace {

// Landmarks beside each other have errors in common: textures, the calibration's field, the same host. As
// many of them hold the pose as one with an error of its own would.
constexpr double kPatchesAsOne = 4.0;
// The depths of one frame's landmarks come from few keyframes, whose places they share. Against those of
// landmarks in use they average less.
constexpr double kDepthsAsOne = 1.0, kExchangedDepthsAsOne = 16.0;
// No measurement is better than a tenth of its claimed sigma: what is left over of it is not seen.
constexpr double kLeastVariance = 0.01;
// Between two frames landmarks come in, and as many go.
constexpr double kComeAndGo = 2.0;
// Frames over which the variances are averaged.
constexpr int kLearning = 20;
// Fewest landmarks seen twice in a row that say something of the variances.
constexpr int kFewestRepeated = 20;

}  // namespace

struct PoseErrorModel::Sums {
  Matrix6d information = Matrix6d::Zero(), noise = Matrix6d::Zero();
  double translation = 0, distance = 0;        // information, and its product with the distance
  double square = 0, change2 = 0, common = 0;  // of residuals, of their changes, products of neighbours
  int residuals = 0, repeated = 0;
};

PoseErrorModel::PoseErrorModel(std::size_t landmarks, std::size_t matches, std::size_t view_landmarks)
    : used_(landmarks) {
  reserve_touched(&pulls_, matches);
  reserve_touched(&pull_of_, view_landmarks);
}

std::size_t PoseErrorModel::bytes() const {
  return capacity_bytes(used_) + capacity_bytes(pulls_) + capacity_bytes(pull_of_);
}

void PoseErrorModel::begin_map() {
  std::fill(used_.begin(), used_.end(), Used{});
  frames_learned_ = 0;
  errors_ = {};
}

PoseErrorModel::Pull& PoseErrorModel::pull_of(const Matcher& matcher, const Match& match) {
  std::int32_t& index = pull_of_[match.view_index];
  if (index < 0) {
    const LandmarkHandle landmark = matcher.landmark_of(match).handle;
    index = static_cast<std::int32_t>(pulls_.size());
    const Used& used = used_[landmark.index];
    const bool is_new = used.landmark != landmark;
    pulls_.push_back(
        {is_new, is_new || used.frame + 1 != frame_, Eigen::Matrix<double, 6, 2>::Zero(), Vector6d::Zero()});
  }
  return pulls_[static_cast<std::size_t>(index)];
}

void PoseErrorModel::measure(const SE3& T_world_body, const Matcher& matcher,
                             std::span<const PoseMeasurement> measurements) {
  ++frame_;
  pulls_.clear();
  pull_of_.assign(matcher.view()->landmarks.size(), -1);
  Sums sums;
  for (std::size_t i = 0; i < measurements.size(); ++i) {
    const PoseMeasurement& m = measurements[i];
    Eigen::Vector2d r, d_rho;
    Eigen::Matrix<double, 2, 6> J;
    if (!m.inlier || !pose_residual(matcher.view()->rig, T_world_body, m, &r, &J, &d_rho)) continue;
    const Eigen::Vector2d depth_px = d_rho * m.inverse_depth_sigma;
    const Eigen::Matrix2d covariance =
        m.sigma_px * m.sigma_px * Eigen::Matrix2d::Identity() + depth_px * depth_px.transpose();
    const Eigen::Matrix2d W = covariance.inverse();
    const Eigen::Matrix<double, 6, 2> gain = huber_weight(r.dot(W * r)) * J.transpose() * W;
    const Matrix6d information = gain * J;
    sums.information += information;
    sums.noise += m.sigma_px * m.sigma_px * gain * gain.transpose();
    const double holds = information.topLeftCorner<3, 3>().trace();
    sums.translation += holds;
    sums.distance += holds * (m.point_w.head<3>() / std::max(m.point_w[3], 1e-9) - T_world_body.t).norm();
    Pull& pull = pull_of(matcher, matcher.matches()[i]);
    pull.by_patch += m.sigma_px * gain;
    pull.by_depth += gain * depth_px;
    const Match& match = matcher.matches()[i];
    if (!match.further) compare_residuals(matcher.landmark_of(match).handle, r / m.sigma_px, &sums);
  }
  learn_variances(sums);
  solve(sums);
}

void PoseErrorModel::compare_residuals(LandmarkHandle landmark, const Eigen::Vector2d& residual, Sums* sums) {
  Used& used = used_[landmark.index];
  sums->square += residual.squaredNorm();
  ++sums->residuals;
  if (used.landmark == landmark && used.frame + 1 == frame_) {
    const Eigen::Vector2d before = used.residual.cast<double>();
    sums->change2 += (residual - before).squaredNorm();
    sums->common += residual.dot(before);
    ++sums->repeated;
  }
  used = {landmark, frame_, residual.cast<float>()};
}

// A landmark's residual in two frames in a row: what they have in common is the landmark's error, what
// changes is noise of either. A map's first frame has no other; all counts as the landmarks'.
void PoseErrorModel::learn_variances(const Sums& sums) {
  if (sums.residuals == 0) return;
  double own = 0.0, shared = 0.5 * sums.square / sums.residuals;
  if (sums.repeated >= kFewestRepeated) {
    own = 0.25 * sums.change2 / sums.repeated;
    shared = 0.5 * sums.common / sums.repeated;
    frames_learned_ = std::min(frames_learned_ + 1, kLearning);
  } else if (frames_learned_ > 0) {
    return;
  }
  const double share = 1.0 / std::max(frames_learned_, 1);
  own_variance_ += share * (own - own_variance_);
  shared_variance_ += share * (std::max(shared, kLeastVariance) - shared_variance_);
}

void PoseErrorModel::solve(const Sums& sums) {
  Matrix6d all = Matrix6d::Zero(), exchanged = Matrix6d::Zero(), changed = Matrix6d::Zero();
  for (const Pull& pull : pulls_) {
    const Matrix6d patch = kPatchesAsOne * pull.by_patch * pull.by_patch.transpose();
    const Matrix6d depth = pull.by_depth * pull.by_depth.transpose();
    all += patch + kDepthsAsOne * depth;
    if (pull.is_new) exchanged += patch + kExchangedDepthsAsOne * depth;
    if (pull.is_changed) changed += patch + kExchangedDepthsAsOne * depth;
  }
  const Matrix6d inverse = sums.information.ldlt().solve(Matrix6d::Identity());
  const auto of_pose = [&](double variance, const Matrix6d& pull) -> Matrix6d {
    const Matrix6d c = variance * inverse * pull * inverse;
    return 0.5 * (c + c.transpose());
  };
  errors_.own = of_pose(own_variance_, kPatchesAsOne * sums.noise);
  errors_.noise = errors_.own + of_pose(shared_variance_, all);
  errors_.step = errors_.own + kComeAndGo * of_pose(shared_variance_, changed);
  errors_.exchanged = of_pose(shared_variance_, exchanged);
  errors_.holding_distance = sums.translation > 0.0 ? sums.distance / sums.translation : 0.0;
  errors_.known = errors_.noise.allFinite() && errors_.exchanged.allFinite() && sums.translation > 0.0;
}

}  // namespace farpoint::slam
