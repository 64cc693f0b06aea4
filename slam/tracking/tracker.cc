#include "slam/tracking/tracker.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace farpoint::slam {

namespace {

constexpr double kBorderPx = 4.0;
constexpr double kMinViewCosine = 0.5;  // 60 degrees from the anchor's view a patch looks different
// Sizes beyond these cannot be matched: the patch has no pixels left, or too few.
constexpr float kMinScaleChange = 0.3F, kMaxScaleChange = 3.3F;

// Longer after the last frame its motion says nothing any more: of a frame that is tracked, and of the way
// back after a gap.
constexpr double kLongestStep_s = 1.0, kLongestGap_s = 3.0;
// After a gap a turn by so much was not foreseen: a vehicle sways by degrees and begins or ends its turns.
constexpr double kTurnOpen_rad = 0.03, kTurnOpen_rad_per_s = 0.12, kMostTurnOpen_rad = 0.3;
constexpr double kArcStep_s = 0.1;
// Among the corners of a wide window the second best is often nearly as good.
constexpr float kPairRatio = 0.8F;

double seconds_between(std::int64_t from_utime, std::int64_t to_utime) {
  return static_cast<double>(to_utime - from_utime) * 1e-6;
}

// Room for so many, in memory that has been written to.
template <typename T>
void touch(std::vector<T>* values, std::size_t count) {
  values->resize(count);
  values->clear();
}

template <typename T>
std::size_t capacity_bytes(const std::vector<T>& values) {
  return values.capacity() * sizeof(T);
}

bool scale_fits(float change) {
  return change > kMinScaleChange && change < kMaxScaleChange;
}

}  // namespace

Tracker::Tracker(const EstimatorConfig& config) : config_(config) {
  const auto landmarks = static_cast<std::size_t>(config.capacity.landmarks),
             in_view = static_cast<std::size_t>(config.capacity.view_landmarks),
             features = static_cast<std::size_t>(config.extractor.features);
  touch(&candidates_, in_view);
  touch(&matches_, features);
  touch(&feature_match_, features);
  touch(&measurements_, features);
  touch(&last_seen_, features);
  touch(&sure_seen_, features);
  touch(&seen_last_frame_, in_view);
  touch(&matched_, in_view);
  touch(&candidate_of_, in_view);
  touch(&motions_, features);
  touch(&pairs_, in_view);
  touch(&bearings_, in_view);
  touch(&points_, in_view);
  pnp_.reserve(in_view);
  touch(&counted_slots_, landmarks);
  view_index_of_slot_.assign(landmarks, 0);
  counts_.resize(landmarks);
  for (int l = 0; l < config.pyramid.levels; ++l)
    level_scale_.push_back(std::pow(config.pyramid.scale_factor, l));
}

std::size_t Tracker::bytes() const {
  return capacity_bytes(candidates_) + capacity_bytes(matches_) + capacity_bytes(feature_match_) +
         capacity_bytes(measurements_) + 2 * capacity_bytes(last_seen_) + capacity_bytes(seen_last_frame_) +
         capacity_bytes(matched_) + capacity_bytes(candidate_of_) + capacity_bytes(motions_) +
         capacity_bytes(pairs_) + capacity_bytes(bearings_) + 2 * capacity_bytes(points_) +
         capacity_bytes(pnp_.use) + capacity_bytes(pnp_.result.inlier) + capacity_bytes(counted_slots_) +
         capacity_bytes(view_index_of_slot_) + capacity_bytes(counts_);
}

void Tracker::set_view(std::shared_ptr<const LocalView> view) {
  if (view_ && view_->map_id == view->map_id) {
    // The pose hangs on the newest keyframe both views know: where that went, the pose goes.
    for (auto old = view_->keyframes.rbegin(); old != view_->keyframes.rend(); ++old) {
      const auto now = std::find_if(view->keyframes.begin(), view->keyframes.end(),
                                    [&](const ViewKeyframe& k) { return k.id == old->id; });
      if (now == view->keyframes.end()) continue;
      for (Motion* m : {&now_, &sure_})
        m->T_world_body = now->T_world_body * (old->T_world_body.inverse() * m->T_world_body);
      break;
    }
  }
  view_ = std::move(view);
  mark_seen(last_seen_);
}

void Tracker::adopt(std::shared_ptr<const LocalView> view, std::span<const LandmarkHandle> seen) {
  view_ = std::move(view);
  if (view_) mark_seen(seen);
}

void Tracker::mark_seen(std::span<const LandmarkHandle> seen) {
  seen_last_frame_.assign(view_->landmarks.size(), 0);
  for (std::size_t i = 0; i < view_->landmarks.size(); ++i)
    view_index_of_slot_[view_->landmarks[i].handle.index] = static_cast<std::uint32_t>(i);
  for (const LandmarkHandle& h : seen) {
    // What an older view left there names another landmark, or none.
    const std::uint32_t i = view_index_of_slot_[h.index];
    if (i < view_->landmarks.size() && view_->landmarks[i].handle == h) seen_last_frame_[i] = 1;
  }
}

void Tracker::start(const SE3& T_world_body, std::int64_t utime) {
  now_ = {.T_world_body = T_world_body, .utime = utime};
  sure_ = now_;
  last_seen_.clear();
  sure_seen_.clear();
  view_.reset();
  for (const std::uint32_t slot : counted_slots_) counts_[slot] = {};
  counted_slots_.clear();
}

SE3 Tracker::predict_pose(std::int64_t utime) const {
  if (!now_.has_velocity) return now_.T_world_body;
  const double dt_s = seconds_between(now_.utime, utime);
  if (dt_s <= 0.0 || dt_s > kLongestStep_s) return now_.T_world_body;
  return now_.T_world_body.boxplus(now_.velocity * dt_s);
}

bool Tracker::is_among(std::size_t view_index, Among among) const {
  if (among == Among::kAll || seen_last_frame_[view_index] != 0) return true;
  return among == Among::kRecent && view_->landmarks[view_index].in_reference;
}

void Tracker::project_view(const Frame& frame, const SE3& T_world_body, Among among,
                           std::vector<Candidate>* out) const {
  const StageSpan span(listener_, Stage::kMatching);
  out->clear();
  const RigCamera& camera = view_->rig.cameras[static_cast<std::size_t>(frame.camera)];
  const Predictor predictor(camera.camera, (T_world_body * camera.T_body_camera).inverse());
  Candidate c;
  for (std::size_t i = 0; i < view_->landmarks.size(); ++i) {
    if (!is_among(i, among)) continue;
    const ViewLandmark& l = view_->landmarks[i];
    if (!predictor.predict(l.point_w, l.anchor_w, l.d_point_d_pixel, kBorderPx, &c.prediction)) continue;
    if (c.prediction.view_cosine < kMinViewCosine || !scale_fits(c.prediction.scale_change)) continue;
    c.view_index = static_cast<std::uint32_t>(i);
    c.level = predicted_level(l.host_level, c.prediction.scale_change,
                              static_cast<float>(config_.pyramid.scale_factor), config_.pyramid.levels);
    out->push_back(c);
  }
}

Match Tracker::match_of(const Frame& frame, std::uint32_t view_index, std::int32_t feature) const {
  const Feature& f = frame.set.features[static_cast<std::size_t>(feature)];
  Match m;
  m.view_index = view_index;
  m.feature = feature;
  m.pixel = {f.u_px, f.v_px};
  m.sigma_px = static_cast<float>(level_scale_[f.level]);
  m.inlier = true;
  return m;
}

int Tracker::match_candidates(const Frame& frame, const std::vector<Candidate>& candidates, double radius_px,
                              float ratio) {
  const StageSpan span(listener_, Stage::kMatching);
  int found = 0;
  matched_.assign(view_->landmarks.size(), 0);
  for (const Match& m : matches_) matched_[m.view_index] = 1;
  for (const Candidate& c : candidates) {
    const ViewLandmark& l = view_->landmarks[c.view_index];
    if (matched_[c.view_index] != 0) continue;
    // What the depth leaves open widens the window.
    const double depth_px =
        std::min(20.0, 2.0 * c.prediction.d_pixel_d_inverse_depth.norm() * l.inverse_depth_sigma);
    DescriptorQuery q;
    q.descriptor = l.descriptor;
    q.u_px = static_cast<float>(c.prediction.pixel.x());
    q.v_px = static_cast<float>(c.prediction.pixel.y());
    q.radius_px = static_cast<float>(radius_px * level_scale_[static_cast<std::size_t>(c.level)] + depth_px);
    q.min_level = c.level - 1;
    q.max_level = c.level + 1;
    q.max_hamming = config_.tracking.max_hamming;
    q.ratio = ratio;
    const int feature =
        find_descriptor(frame.set, frame.grid, q, [&](std::size_t f) { return feature_match_[f] < 0; });
    if (feature < 0) continue;
    feature_match_[static_cast<std::size_t>(feature)] = static_cast<std::int32_t>(matches_.size());
    matches_.push_back(match_of(frame, c.view_index, feature));
    ++found;
  }
  return found;
}

void Tracker::align_matches(const Frame& frame, const std::vector<Candidate>& candidates) {
  if (!frame.image) return;
  const StageSpan span(listener_, Stage::kAlignment);
  candidate_of_.assign(view_->landmarks.size(), -1);
  for (std::size_t i = 0; i < candidates.size(); ++i)
    candidate_of_[candidates[i].view_index] = static_cast<std::int32_t>(i);
  std::size_t kept = 0;
  for (Match m : matches_) {
    const std::int32_t index = candidate_of_[m.view_index];
    if (index < 0) continue;
    const Candidate& c = candidates[static_cast<std::size_t>(index)];
    const Feature& f = frame.set.features[static_cast<std::size_t>(m.feature)];
    const auto level_scale = static_cast<float>(level_scale_[f.level]);
    const Alignment a = frame.image->align(view_->landmarks[m.view_index].patch, c.prediction.A_target_host,
                                           {f.u_px, f.v_px}, 2.0F * level_scale);
    if (a.ok) {
      m.pixel = a.pixel;
      m.sigma_px = std::hypot(a.sigma_px, static_cast<float>(config_.tracking.pixel_sigma_px));
      m.aligned = true;
      matches_[kept++] = m;
    } else {
      feature_match_[static_cast<std::size_t>(m.feature)] = -1;
    }
  }
  matches_.resize(kept);
}

PoseSolution Tracker::pose_from_matches(const Frame& frame, const SE3& start) {
  const StageSpan span(listener_, Stage::kPose);
  measurements_.clear();
  for (const Match& m : matches_) {
    const ViewLandmark& l = view_->landmarks[m.view_index];
    PoseMeasurement pm;
    pm.point_w = l.point_w;
    pm.anchor_w = l.anchor_w;
    pm.inverse_depth_sigma = l.inverse_depth_sigma;
    pm.pixel = m.pixel.cast<double>();
    pm.sigma_px = m.sigma_px;
    pm.camera = frame.camera;
    measurements_.push_back(pm);
  }
  PoseSolution s = solve_pose(view_->rig, start, measurements_);
  for (std::size_t i = 0; i < matches_.size(); ++i) matches_[i].inlier = measurements_[i].inlier;
  return s;
}

// First pose: the landmarks of the last frame near where the prior expects them, then further away, then the
// whole view.
bool Tracker::coarse_pose(const Frame& frame, SE3* T_world_body) {
  const double base = config_.tracking.prior_search_px;
  struct Attempt {
    double radius_px;
    Among among;
  };
  const Attempt attempts[] = {{base, Among::kLastFrame},
                              {2.0 * base, Among::kLastFrame},
                              {2.0 * base, Among::kAll},
                              {4.0 * base, Among::kAll}};
  std::optional<Among> projected;
  for (const Attempt& a : attempts) {
    if (projected != a.among) project_view(frame, *T_world_body, a.among, &candidates_);
    projected = a.among;
    matches_.clear();
    std::fill(feature_match_.begin(), feature_match_.end(), -1);
    if (match_candidates(frame, candidates_, a.radius_px, 0.9F) < config_.tracking.min_matches) continue;
    const PoseSolution s = pose_from_matches(frame, *T_world_body);
    // Half of what was matched must agree: a pose that explains a fifth of the matches explains nothing.
    if (s.inliers >= config_.tracking.min_matches / 2 && 2 * s.inliers >= static_cast<int>(matches_.size()) &&
        s.ok) {
      *T_world_body = s.T_world_body;
      return true;
    }
  }
  return false;
}

TrackOutcome Tracker::fine_pose(const Frame& frame, const SE3& start) {
  TrackOutcome out;
  out.T_world_body = start;
  // Matches that the first pose rejected free their features.
  std::size_t kept = 0;
  for (const Match& m : matches_) {
    if (m.inlier)
      matches_[kept++] = m;
    else
      feature_match_[static_cast<std::size_t>(m.feature)] = -1;
  }
  matches_.resize(kept);
  for (std::size_t i = 0; i < kept; ++i)
    feature_match_[static_cast<std::size_t>(matches_[i].feature)] = static_cast<std::int32_t>(i);

  project_view(frame, start, Among::kAll, &candidates_);
  out.expected = static_cast<int>(candidates_.size());
  match_candidates(frame, candidates_, config_.tracking.local_search_px, 0.8F);
  align_matches(frame, candidates_);
  out.matches = static_cast<int>(matches_.size());
  if (out.matches < config_.tracking.min_matches / 2) return out;
  const PoseSolution s = pose_from_matches(frame, start);
  out.T_world_body = s.T_world_body;
  out.covariance = s.covariance;
  out.inliers = s.inliers;
  out.rms = s.rms;
  for (const Match& m : matches_) {
    if (!m.inlier) continue;
    if (m.aligned) ++out.aligned;
    const ViewLandmark& l = view_->landmarks[m.view_index];
    if (!l.in_reference || !l.confirmed) continue;
    ++out.reference_inliers;
    out.reference_nearness += l.nearness;
  }
  out.ok = s.ok && s.inliers >= config_.tracking.min_inliers / 2;
  if (out.ok) out.median_motion_px = motion_since_reference(frame, s.T_world_body);
  return out;
}

double Tracker::motion_since_reference(const Frame& frame, const SE3& T_world_body) {
  // Parallax in pixels: where landmarks are now against where rotation alone would have put them.
  const RigCamera& camera = view_->rig.cameras[static_cast<std::size_t>(frame.camera)];
  const Eigen::Vector3d centre = (T_world_body * camera.T_body_camera).t;
  const Eigen::Vector3d reference = (view_->T_world_reference * camera.T_body_camera).t;
  motions_.clear();
  for (const Match& m : matches_) {
    if (!m.inlier || !view_->landmarks[m.view_index].confirmed) continue;
    const Eigen::Vector4d& p = view_->landmarks[m.view_index].point_w;
    const Eigen::Vector3d now = p.head<3>() - p[3] * centre, then = p.head<3>() - p[3] * reference;
    motions_.push_back(std::atan2(now.cross(then).norm(), now.dot(then)) * camera.camera.focal_px());
  }
  if (motions_.empty()) return 0.0;
  std::nth_element(motions_.begin(), motions_.begin() + static_cast<std::ptrdiff_t>(motions_.size() / 2),
                   motions_.end());
  return motions_[motions_.size() / 2];
}

TrackOutcome Tracker::track(const Frame& frame) {
  return track_from(frame, predict_pose(frame.utime));
}

TrackOutcome Tracker::track_from(const Frame& frame, const SE3& prior) {
  begin_matching(frame);
  if (!view_) return {};
  SE3 T = prior;
  if (!coarse_pose(frame, &T)) return {};
  return fine_pose(frame, T);
}

void Tracker::begin_matching(const Frame& frame) {
  feature_match_.assign(frame.set.features.size(), -1);
  matches_.clear();
}

// --- the way back
// -----------------------------------------------------------------------------------------------

// Going on as before, along the arc that the velocity describes.
SE3 Tracker::gone_on(double gone_s) const {
  SE3 T = sure_.T_world_body;
  const int steps = static_cast<int>(std::ceil(gone_s / kArcStep_s));
  for (int i = 0; i < steps; ++i) T = T.boxplus(sure_.velocity * (gone_s / steps));
  return T;
}

TrackOutcome Tracker::relocalise(const Frame& frame) {
  begin_matching(frame);
  if (!view_) return {};
  mark_seen(sure_seen_);
  const RigCamera& camera = view_->rig.cameras[static_cast<std::size_t>(frame.camera)];
  const double gone_s = std::clamp(seconds_between(sure_.utime, frame.utime), 0.0, kLongestGap_s);
  const double radius_px =
      std::min(kTurnOpen_rad + kTurnOpen_rad_per_s * gone_s, kMostTurnOpen_rad) * camera.camera.focal_px();
  const SE3 moved = gone_on(gone_s), stood = sure_.T_world_body;
  struct Search {
    Among among;
    const SE3* around;
  };
  // Landmarks seen last are surely there; of the whole view many are hidden, and others look like them.
  const Search searches[] = {{Among::kRecent, &moved},
                             {Among::kRecent, &stood},
                             {Among::kRecent, nullptr},
                             {Among::kAll, &moved},
                             {Among::kAll, nullptr}};
  for (const Search& s : searches) {
    if (s.around != nullptr)
      pair_around(frame, *s.around, radius_px, s.among);
    else
      pair_anywhere(frame, s.among);
    TrackOutcome out = pose_from_pairs(frame);
    if (out.ok) return out;
  }
  return {};
}

// Landmarks around where they would be seen from a pose.
void Tracker::pair_around(const Frame& frame, const SE3& T_world_body, double radius_px, Among among) {
  project_view(frame, T_world_body, among, &candidates_);
  const StageSpan span(listener_, Stage::kMatching);
  pairs_.clear();
  DescriptorQuery q;
  q.radius_px = static_cast<float>(radius_px);
  q.max_hamming = config_.tracking.max_hamming;
  q.ratio = kPairRatio;
  for (const Candidate& c : candidates_) {
    q.u_px = static_cast<float>(c.prediction.pixel.x());
    q.v_px = static_cast<float>(c.prediction.pixel.y());
    // How far the vehicle went is open too, and with it the size.
    q.min_level = c.level - 2;
    q.max_level = c.level + 2;
    pair_one(frame, c.view_index, q);
  }
}

// The same in the whole image.
void Tracker::pair_anywhere(const Frame& frame, Among among) {
  const StageSpan span(listener_, Stage::kMatching);
  const Camera& camera = view_->rig.cameras[static_cast<std::size_t>(frame.camera)].camera;
  pairs_.clear();
  DescriptorQuery q;
  q.u_px = static_cast<float>(camera.width_px()) / 2;
  q.v_px = static_cast<float>(camera.height_px()) / 2;
  q.radius_px = 1e6F;
  q.max_hamming = config_.tracking.max_hamming * 3 / 4;
  q.ratio = 0.75F;
  q.max_level = config_.pyramid.levels - 1;
  for (std::size_t i = 0; i < view_->landmarks.size(); ++i)
    if (is_among(i, among)) pair_one(frame, static_cast<std::uint32_t>(i), q);
}

void Tracker::pair_one(const Frame& frame, std::uint32_t view_index, const DescriptorQuery& query) {
  const ViewLandmark& landmark = view_->landmarks[view_index];
  if (!landmark.confirmed || landmark.point_w[3] <= 0.0) return;
  DescriptorQuery q = query;
  q.descriptor = landmark.descriptor;
  const int feature = find_descriptor(frame.set, frame.grid, q, [](std::size_t) { return true; });
  if (feature >= 0) pairs_.push_back({view_index, feature});
}

TrackOutcome Tracker::pose_from_pairs(const Frame& frame) {
  const RigCamera& camera = view_->rig.cameras[static_cast<std::size_t>(frame.camera)];
  begin_matching(frame);
  bearings_.clear();
  points_.clear();
  std::erase_if(pairs_, [&](const Pair& p) {
    const Feature& f = frame.set.features[static_cast<std::size_t>(p.feature)];
    Eigen::Vector3d bearing;
    if (!camera.camera.unproject({f.u_px, f.v_px}, &bearing)) return true;
    const Eigen::Vector4d& point = view_->landmarks[p.view_index].point_w;
    bearings_.push_back(bearing);
    points_.emplace_back(point.head<3>() / point[3]);
    return false;
  });
  const PnpResult& pnp = solve_pnp(bearings_, points_, 2.0 / camera.camera.focal_px(), PnpOptions{}, &pnp_);
  if (!pnp.ok) return {};
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    if (pnp.inlier[i] == 0) continue;
    std::int32_t& taken = feature_match_[static_cast<std::size_t>(pairs_[i].feature)];
    if (taken >= 0) continue;
    taken = static_cast<std::int32_t>(matches_.size());
    matches_.push_back(match_of(frame, pairs_[i].view_index, pairs_[i].feature));
  }
  const PoseSolution s = pose_from_matches(frame, (camera.T_body_camera * pnp.T_camera_world).inverse());
  if (!s.ok) return {};
  TrackOutcome out = fine_pose(frame, s.T_world_body);
  out.ok = out.ok && out.inliers >= config_.tracking.min_inliers && out.agreed();
  return out;
}

void Tracker::accept(const Frame& frame, const TrackOutcome& outcome) {
  note_pose(frame, outcome, kLongestStep_s);
  sure_ = now_;
  sure_seen_.assign(last_seen_.begin(), last_seen_.end());
}

void Tracker::accept_on_trial(const Frame& frame, const TrackOutcome& outcome) {
  now_ = sure_;
  note_pose(frame, outcome, kLongestGap_s);
}

// Beyond `longest_s` since the last pose the mean motion says nothing of the present one.
void Tracker::note_pose(const Frame& frame, const TrackOutcome& outcome, double longest_s) {
  const double dt_s = seconds_between(now_.utime, frame.utime);
  Motion m{.T_world_body = outcome.T_world_body, .utime = frame.utime};
  if (dt_s > 0.0 && dt_s < longest_s) {
    m.velocity = now_.T_world_body.boxminus_to(outcome.T_world_body) / dt_s;
    m.has_velocity = true;
  }
  now_ = m;
  count_sightings();
}

void Tracker::count_sightings() {
  last_seen_.clear();
  std::fill(seen_last_frame_.begin(), seen_last_frame_.end(), std::uint8_t{0});
  const auto slot_of = [this](LandmarkHandle h) -> SightingCount& {
    SightingCount& c = counts_[h.index];
    if (c.landmark != h) {
      if (c.landmark.is_null()) counted_slots_.push_back(h.index);
      c = {h, 0, 0};
    }
    return c;
  };
  for (const Candidate& c : candidates_) ++slot_of(view_->landmarks[c.view_index].handle).visible;
  for (const Match& m : matches_) {
    if (!m.inlier) continue;
    const LandmarkHandle h = view_->landmarks[m.view_index].handle;
    ++slot_of(h).found;
    last_seen_.push_back(h);
    seen_last_frame_[m.view_index] = 1;
  }
}

void Tracker::sightings(std::vector<Sighting>* out) const {
  out->clear();
  for (const Match& m : matches_)
    if (m.inlier) out->push_back({view_->landmarks[m.view_index].handle, m.feature, m.pixel, m.sigma_px});
}

void Tracker::take_counts(std::vector<SightingCount>* out) {
  out->clear();
  for (const std::uint32_t slot : counted_slots_) {
    out->push_back(counts_[slot]);
    counts_[slot] = {};
  }
  counted_slots_.clear();
}

}  // namespace farpoint::slam
