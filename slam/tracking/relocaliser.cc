// SPDX-License-Identifier: Apache-2.0
#include "slam/tracking/relocaliser.h"

#include <algorithm>
#include <array>

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
// The whole view anywhere in the image is searched in slices, every fourth landmark in each.
constexpr std::size_t kSlices = 4;
// Work after which a frame begins no further search, except the first of those in turn
// (Relocaliser::kMostWork). A unit is about one nanosecond of a core in use. It is counted, not measured: all
// machines search alike.
constexpr double kWorkOfFrame = 0.7e6;
// Work of the steps: a word compared, a descriptor compared, a sample of PnP, a match refined.
constexpr double kWorkOfWord = 1.5, kWorkOfDescriptor = 3.0, kWorkOfSample = 1500.0, kWorkOfMatch = 5000.0;
// Least share of right matches. Of matches at random a tenth fits some pose.
constexpr double kLeastRight = 0.2;
// 300 samples miss a pose with one chance in 2000 where three in ten matches are right.
constexpr int kSamples = 300;
// Least share of the landmarks usually found that a place must show. Tracking finds half of them, and in 99
// of 100 frames a fifth; a place that looks like the old one shows a tenth or less (FINDINGS.md, the way
// back).
constexpr double kLeastShareByMotion = 0.1, kLeastShareAnywhere = 0.12;

// How far the motion may have led the landmarks astray in the image.
double window_px(double gap_s, const Camera& camera) {
  return std::min(kTurnOpen_rad + kTurnOpen_rad_per_s * gap_s, kMostTurnOpen_rad) * camera.focal_px();
}

// Whether a pose can be measured by it.
bool has_place(const ViewLandmark& landmark) {
  return landmark.confirmed && landmark.point_w[3] > 0.0;
}

}  // namespace

Relocaliser::Relocaliser(const EstimatorConfig& config, Matcher* matcher, PoseRefiner* refiner)
    : config_(config.tracking), matcher_(*matcher), refiner_(*refiner) {
  const auto in_view = static_cast<std::size_t>(config.capacity.view_landmarks);
  scan_.reserve(static_cast<std::size_t>(config.extractor.features));
  reserve_touched(&correspondences_, in_view);
  reserve_touched(&bearings_, in_view);
  reserve_touched(&points_, in_view);
  pnp_.reserve(in_view);
}

std::size_t Relocaliser::bytes() const {
  return scan_.bytes() + capacity_bytes(correspondences_) + capacity_bytes(bearings_) +
         capacity_bytes(points_) + capacity_bytes(pnp_.points) + capacity_bytes(pnp_.use) +
         capacity_bytes(pnp_.result.inlier);
}

TrackOutcome Relocaliser::relocalise(const Frame& frame, const Motion& last) {
  if (last.utime != lost_since_utime_) {
    lost_since_utime_ = last.utime;
    next_ = 0;
  }
  const double gap_s =
      std::clamp(seconds_between(last.utime, frame.utime), 0.0, ConstantVelocity::kLongestGap_s);
  const SE3 moved = last.extrapolated(gap_s), stood = last.T_world_body;
  // Landmarks seen last are there for certain; many of the whole view are hidden, and others look like them.
  using enum LandmarkSubset;
  const std::array<Search, 2> always{{{kRecent, &moved}, {kRecent, nullptr}}};
  const Search around{kAll, &moved};
  static_assert(kSlices == 4, "each slice stands once below");
  const std::array<Search, 1 + 2 * kSlices> in_turn{{around,
                                                     {kAll, nullptr, 0, kSlices},
                                                     around,
                                                     {kAll, nullptr, 1, kSlices},
                                                     {kRecent, &stood},
                                                     around,
                                                     {kAll, nullptr, 2, kSlices},
                                                     around,
                                                     {kAll, nullptr, 3, kSlices}}};
  work_ = 0.0;
  for (std::size_t k = 0; k < always.size() + in_turn.size(); ++k) {
    if (work_ > (k <= always.size() ? kMostWork : kWorkOfFrame)) break;
    const Search& search = k < always.size() ? always[k] : in_turn[next_];
    if (k >= always.size()) next_ = (next_ + 1) % in_turn.size();
    for (int c = 0; c < frame.views.size(); ++c) {
      TrackOutcome out = run(frame, c, search, gap_s);
      if (out.ok) return out;
    }
  }
  return {};
}

TrackOutcome Relocaliser::run(const Frame& frame, int camera, const Search& search, double gap_s) {
  if (frame.views[camera].set.features.empty()) return {};
  const bool anywhere = search.around == nullptr;
  if (anywhere)
    search_image(frame, camera, search);
  else
    search_around(frame, camera, search, gap_s);
  TrackOutcome out = pose_from_correspondences(frame, camera);
  out.ok = out.ok && out.found_share() >= (anywhere ? kLeastShareAnywhere : kLeastShareByMotion);
  return out;
}

// Searches each landmark around its projection from a pose.
void Relocaliser::search_around(const Frame& frame, int camera, const Search& search, double gap_s) {
  matcher_.project(frame, *search.around, search.subset);
  const StageSpan span(listener_, Stage::kMatching);
  correspondences_.clear();
  DescriptorQuery q;
  q.radius_px = static_cast<float>(window_px(gap_s, matcher_.camera(camera).camera));
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
void Relocaliser::search_image(const Frame& frame, int camera, const Search& search) {
  const StageSpan span(listener_, Stage::kMatching);
  correspondences_.clear();
  scan_.set(frame.views[camera].set);
  const std::vector<ViewLandmark>& landmarks = matcher_.view()->landmarks;
  for (std::size_t i = search.first; i < landmarks.size(); i += search.step) {
    if (!matcher_.in_subset(i, search.subset) || !has_place(landmarks[i])) continue;
    work_ += kWorkOfWord * static_cast<double>(frame.views[camera].set.features.size());
    const int feature = scan_.find(landmarks[i].descriptor, config_.max_hamming * 3 / 4, kImageRatio);
    if (feature >= 0) correspondences_.push_back({static_cast<std::uint32_t>(i), feature});
  }
}

void Relocaliser::search_landmark(const FrameView& image, std::uint32_t view_index,
                                  const DescriptorQuery& query) {
  const ViewLandmark& landmark = matcher_.view()->landmarks[view_index];
  if (!has_place(landmark)) return;
  DescriptorQuery q = query;
  q.descriptor = landmark.descriptor;
  const int feature = find_descriptor(image.set, image.grid, q, [this](std::size_t) {
    work_ += kWorkOfDescriptor;
    return true;
  });
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
  const PnpResult& pnp = solve_pnp(bearings_, points_, kCornerSigma_px / camera.camera.focal_px(),
                                   {.min_inlier_share = kLeastRight, .max_samples = kSamples}, &pnp_);
  work_ += kWorkOfSample * pnp.samples;
  if (!pnp.ok) return {};
  for (std::size_t i = 0; i < correspondences_.size(); ++i)
    if (pnp.inlier[i] != 0)
      matcher_.add(frame, correspondences_[i].view_index, index, correspondences_[i].feature);
  const PoseSolution s = refiner_.solve((camera.T_body_camera * pnp.T_camera_world).inverse());
  if (!s.ok) return {};
  TrackOutcome out = refiner_.refine(frame, s.T_world_body);
  work_ += kWorkOfMatch * out.matches;
  for (const MatchCandidate& c : matcher_.candidates())
    out.usually_found += double{matcher_.view()->landmarks[c.view_index].found_share};
  out.ok = out.ok && out.inliers >= config_.min_inliers && out.agreed();
  return out;
}

}  // namespace farpoint::slam
