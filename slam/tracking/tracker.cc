// SPDX-License-Identifier: Apache-2.0
#include "slam/tracking/tracker.h"

#include <array>
#include <optional>
#include <span>

#include "slam/tracking/work_space.h"

namespace farpoint::slam {

namespace {

// Descriptor ratio of the search around the prior.
constexpr float kPriorRatio = 0.9F;
// Of coarse_pose(): around the landmarks of the last frame first.
constexpr int kAttempts = 4, kAttemptsToConfirm = 2;

}  // namespace

Tracker::Tracker(const EstimatorConfig& config, int cameras)
    : config_(config.tracking),
      matcher_(config, cameras),
      refiner_(config, &matcher_, cameras),
      relocaliser_(config, &matcher_, &refiner_),
      counter_(static_cast<std::size_t>(config.capacity.landmarks)) {
  const auto features =
      static_cast<std::size_t>(cameras) * static_cast<std::size_t>(config.extractor.features);
  reserve_touched(&last_seen_, features);
  reserve_touched(&confirmed_seen_, features);
}

void Tracker::listen(StageListener* listener) {
  matcher_.listen(listener);
  refiner_.listen(listener);
  relocaliser_.listen(listener);
}

std::size_t Tracker::bytes() const {
  return matcher_.bytes() + refiner_.bytes() + relocaliser_.bytes() + counter_.bytes() +
         capacity_bytes(last_seen_) + capacity_bytes(confirmed_seen_);
}

double Tracker::set_view(std::shared_ptr<const LocalView> view) {
  const double scale = matcher_.view() ? motion_.correct(*matcher_.view(), *view) : 1.0;
  matcher_.set_view(std::move(view));
  matcher_.mark_seen(last_seen_);
  return scale;
}

void Tracker::adopt(std::shared_ptr<const LocalView> view, std::span<const LandmarkHandle> seen) {
  matcher_.set_view(std::move(view));
  if (matcher_.view()) matcher_.mark_seen(seen);
}

void Tracker::start(const SE3& T_world_body, std::int64_t utime) {
  motion_.start(T_world_body, utime);
  last_seen_.clear();
  confirmed_seen_.clear();
  matcher_.set_view(nullptr);
  counter_.clear();
}

TrackOutcome Tracker::track(const Frame& frame) {
  return track_within(frame, motion_model().predict(frame.utime), kAttempts);
}

TrackOutcome Tracker::confirm(const Frame& frame) {
  return track_within(frame, motion_model().predict(frame.utime), kAttemptsToConfirm);
}

TrackOutcome Tracker::track_from(const Frame& frame, const PosePrior& prior) {
  return track_within(frame, prior, kAttempts);
}

TrackOutcome Tracker::track_within(const Frame& frame, const PosePrior& prior, int attempts) {
  matcher_.begin(frame);
  if (!matcher_.view()) return {};
  SE3 T_world_body;
  if (!coarse_pose(frame, prior, attempts, &T_world_body)) return {};
  return refiner_.refine(frame, T_world_body, prior);
}

// Searches the landmarks of the last frame around the prior, then in a wider window, then those of the whole
// view.
bool Tracker::coarse_pose(const Frame& frame, const PosePrior& prior, int attempts, SE3* T_world_body) {
  const double base_px = config_.prior_search_px;
  struct Attempt {
    double radius_px;
    LandmarkSubset subset;
  };
  const std::array<Attempt, kAttempts> in_order{{{base_px, LandmarkSubset::kSeen},
                                                 {2.0 * base_px, LandmarkSubset::kSeen},
                                                 {2.0 * base_px, LandmarkSubset::kAll},
                                                 {4.0 * base_px, LandmarkSubset::kAll}}};
  std::optional<LandmarkSubset> projected;
  for (const Attempt& a : std::span(in_order).first(static_cast<std::size_t>(attempts))) {
    if (projected != a.subset) matcher_.project(frame, prior.T_world_body, a.subset);
    projected = a.subset;
    matcher_.begin(frame);
    if (matcher_.match(frame, a.radius_px, kPriorRatio) < config_.min_matches) continue;
    const PoseSolution s = refiner_.solve(prior.T_world_body, prior);
    if (!explains_matches(s)) continue;
    *T_world_body = s.T_world_body;
    return true;
  }
  return false;
}

// At least half of the matches must be inliers: a pose that explains a fifth of them explains nothing.
bool Tracker::explains_matches(const PoseSolution& solution) const {
  return solution.inliers >= config_.min_matches / 2 &&
         2 * solution.inliers >= static_cast<int>(matcher_.matches().size()) && solution.ok;
}

TrackOutcome Tracker::relocalise(const Frame& frame) {
  matcher_.begin(frame);
  if (!matcher_.view()) return {};
  matcher_.mark_seen(confirmed_seen_);
  return relocaliser_.relocalise(frame, motion_.confirmed());
}

void Tracker::accept(const Frame& frame, const TrackOutcome& outcome) {
  motion_.accept(outcome.T_world_body, frame.utime);
  note_seen();
  confirmed_seen_.assign(last_seen_.begin(), last_seen_.end());
}

void Tracker::accept_on_trial(const Frame& frame, const TrackOutcome& outcome) {
  motion_.accept_on_trial(outcome.T_world_body, frame.utime);
  note_seen();
}

void Tracker::note_seen() {
  const LocalView& view = *matcher_.view();
  for (const MatchCandidate& c : matcher_.candidates())
    counter_.add_visible(view.landmarks[c.view_index].handle);
  last_seen_.clear();
  for (const Match& m : matcher_.matches()) {
    if (!m.inlier || m.further) continue;
    const LandmarkHandle h = matcher_.landmark_of(m).handle;
    counter_.add_found(h);
    last_seen_.push_back(h);
  }
  matcher_.mark_seen(last_seen_);
}

void Tracker::sightings(std::vector<Sighting>* out) const {
  out->clear();
  for (const Match& m : matcher_.matches())
    if (m.inlier) out->push_back({matcher_.landmark_of(m).handle, m.feature, m.pixel, m.sigma_px, m.camera});
}

}  // namespace farpoint::slam
