// SPDX-License-Identifier: Apache-2.0
#include "slam/tracking/relocaliser.h"

#include <algorithm>

#include "slam/tracking/work_space.h"

namespace farpoint::slam {

namespace {

// The turn during a gap that the motion does not foresee: a vehicle sways by degrees and begins or ends its
// turns.
constexpr double kTurnOpen_rad = 0.03, kTurnOpen_rad_per_s = 0.12, kMostTurnOpen_rad = 0.3;
// Levels that the size of a corner may be off, since the distance travelled in a gap is open.
constexpr int kLevelsOpen = 2;
// Among the corners of a wide window, and of the whole image, the second best is often nearly as good.
constexpr float kWindowRatio = 0.8F, kImageRatio = 0.75F;
constexpr double kCornerSigma_px = 2.0;

// How far the motion may have led the landmarks astray in the image.
double window_px(double gap_s, const Camera& camera) {
  return std::min(kTurnOpen_rad + kTurnOpen_rad_per_s * gap_s, kMostTurnOpen_rad) * camera.focal_px();
}

}  // namespace

Relocaliser::Relocaliser(const EstimatorConfig& config, Matcher* matcher, PoseRefiner* refiner)
    : config_(config.tracking), levels_(config.pyramid.levels), matcher_(*matcher), refiner_(*refiner) {
  const auto in_view = static_cast<std::size_t>(config.capacity.view_landmarks);
  reserve_touched(&correspondences_, in_view);
  reserve_touched(&bearings_, in_view);
  reserve_touched(&points_, in_view);
  pnp_.reserve(in_view);
}

std::size_t Relocaliser::bytes() const {
  return capacity_bytes(correspondences_) + capacity_bytes(bearings_) + capacity_bytes(points_) +
         capacity_bytes(pnp_.points) + capacity_bytes(pnp_.use) + capacity_bytes(pnp_.result.inlier);
}

TrackOutcome Relocaliser::relocalise(const Frame& frame, const Motion& last) {
  const double gap_s =
      std::clamp(seconds_between(last.utime, frame.utime), 0.0, ConstantVelocity::kLongestGap_s);
  const SE3 moved = last.extrapolated(gap_s), stood = last.T_world_body;
  struct Search {
    LandmarkSubset subset;
    const SE3* around;  // null: anywhere in the image
  };
  // Landmarks seen last are there for certain; many of the whole view are hidden, and others look like them.
  const Search searches[] = {{LandmarkSubset::kRecent, &moved},
                             {LandmarkSubset::kRecent, &stood},
                             {LandmarkSubset::kRecent, nullptr},
                             {LandmarkSubset::kAll, &moved},
                             {LandmarkSubset::kAll, nullptr}};
  for (const Search& s : searches)
    for (int c = 0; c < frame.views.size(); ++c) {
      if (frame.views[c].set.features.empty()) continue;
      if (s.around != nullptr)
        search_around(frame, c, *s.around, window_px(gap_s, matcher_.camera(c).camera), s.subset);
      else
        search_image(frame, c, s.subset);
      TrackOutcome out = pose_from_correspondences(frame, c);
      if (out.ok) return out;
    }
  return {};
}

// Searches each landmark around its projection from a pose.
void Relocaliser::search_around(const Frame& frame, int camera, const SE3& T_world_body, double radius_px,
                                LandmarkSubset subset) {
  matcher_.project(frame, T_world_body, subset);
  const StageSpan span(listener_, Stage::kMatching);
  correspondences_.clear();
  DescriptorQuery q;
  q.radius_px = static_cast<float>(radius_px);
  q.max_hamming = config_.max_hamming;
  q.ratio = kWindowRatio;
  for (const MatchCandidate& c : matcher_.candidates()) {
    if (c.camera != camera) continue;
    q.u_px = static_cast<float>(c.prediction.pixel.x());
    q.v_px = static_cast<float>(c.prediction.pixel.y());
    q.min_level = c.level - kLevelsOpen;
    q.max_level = c.level + kLevelsOpen;
    search_landmark(frame.views[camera], c.view_index, q);
  }
}

// Searches each landmark in the whole image.
void Relocaliser::search_image(const Frame& frame, int index, LandmarkSubset subset) {
  const StageSpan span(listener_, Stage::kMatching);
  const Camera& camera = matcher_.camera(index).camera;
  correspondences_.clear();
  DescriptorQuery q;
  q.u_px = static_cast<float>(camera.width_px()) / 2;
  q.v_px = static_cast<float>(camera.height_px()) / 2;
  q.radius_px = 1e6F;
  q.max_hamming = config_.max_hamming * 3 / 4;
  q.ratio = kImageRatio;
  q.max_level = levels_ - 1;
  const std::size_t landmarks = matcher_.view()->landmarks.size();
  for (std::size_t i = 0; i < landmarks; ++i)
    if (matcher_.in_subset(i, subset)) search_landmark(frame.views[index], static_cast<std::uint32_t>(i), q);
}

void Relocaliser::search_landmark(const FrameView& image, std::uint32_t view_index,
                                  const DescriptorQuery& query) {
  const ViewLandmark& landmark = matcher_.view()->landmarks[view_index];
  if (!landmark.confirmed || landmark.point_w[3] <= 0.0) return;
  DescriptorQuery q = query;
  q.descriptor = landmark.descriptor;
  const int feature = find_descriptor(image.set, image.grid, q, [](std::size_t) { return true; });
  if (feature >= 0) correspondences_.push_back({view_index, feature});
}

TrackOutcome Relocaliser::pose_from_correspondences(const Frame& frame, int index) {
  const RigCamera& camera = matcher_.camera(index);
  matcher_.begin(frame);
  bearings_.clear();
  points_.clear();
  std::erase_if(correspondences_, [&](const Correspondence& c) {
    const Feature& f = frame.views[index].set.features[static_cast<std::size_t>(c.feature)];
    Eigen::Vector3d bearing;
    if (!camera.camera.unproject({f.u_px, f.v_px}, &bearing)) return true;
    const Eigen::Vector4d& point = matcher_.view()->landmarks[c.view_index].point_w;
    bearings_.push_back(bearing);
    points_.emplace_back(point.head<3>() / point[3]);
    return false;
  });
  const PnpResult& pnp =
      solve_pnp(bearings_, points_, kCornerSigma_px / camera.camera.focal_px(), PnpOptions{}, &pnp_);
  if (!pnp.ok) return {};
  for (std::size_t i = 0; i < correspondences_.size(); ++i)
    if (pnp.inlier[i] != 0)
      matcher_.add(frame, correspondences_[i].view_index, index, correspondences_[i].feature);
  const PoseSolution s = refiner_.solve((camera.T_body_camera * pnp.T_camera_world).inverse());
  if (!s.ok) return {};
  TrackOutcome out = refiner_.refine(frame, s.T_world_body);
  out.ok = out.ok && out.inliers >= config_.min_inliers && out.agreed();
  return out;
}

}  // namespace farpoint::slam
