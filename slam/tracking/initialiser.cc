// SPDX-License-Identifier: Apache-2.0
#include "slam/tracking/initialiser.h"

#include <algorithm>
#include <cmath>

#include "slam/image/descriptor_search.h"
#include "slam/tracking/constant_velocity.h"
#include "slam/tracking/fixed_features.h"
#include "slam/tracking/work_space.h"

namespace farpoint::slam {

namespace {

// A corner moves less than this share of the image's width from frame to frame; later searches start where
// the last one found it.
constexpr float kFirstWindow = 0.08F;
constexpr int kMinMatches = 80;
// Descriptors find some corners again in any picture of the same kind: below this share of what the frame
// next to the reference gave, chance matches prevail.
constexpr double kMinMatchShare = 0.35;
constexpr double kCornerSigma_px = 1.0;  // corners are not aligned yet
// A rotation by less is a vehicle that stands and shakes.
constexpr double kTurn_rad = 0.02;
// A frame that comes a little early counts as in time.
constexpr double kEarly_s = 0.001;

// By the motion that most matches agree with; without any there is no share to name.
Refusal poor_model(const TwoViewResult& motion) {
  const TwoViewOptions options;
  const auto agreeing = static_cast<double>(std::max(motion.inliers, motion.essential_inliers));
  if (agreeing <= 0.0) return {.reason = Reason::kNoCommonMotion};
  const auto matches = static_cast<double>(motion.matches);
  return {Reason::kNoCommonMotion, agreeing / matches,
          std::max(options.min_inlier_share, static_cast<double>(options.min_inliers) / matches)};
}

}  // namespace

Initialiser::Initialiser(const EstimatorConfig& config, const Rig& rig, int camera)
    : config_(config), camera_(camera), rig_camera_(rig.cameras[static_cast<std::size_t>(camera)]) {
  const auto features = static_cast<std::size_t>(config.extractor.features);
  history_.reserve(kHistoryFrames + 1);
  reserve_touched(&expected_px_, features);
  reserve_touched(&pairs_, features);
  reserve_touched(&pair_.points, features);
  reserve_touched(&owner_, features);
  reserve_touched(&found_, features);
  reserve_touched(&owner_distance_, features);
  reserve_touched(&first_, features);
  reserve_touched(&second_, features);
  reserve_touched(&used_, features);
  reserve_touched(&parallax_rad_, features);
  two_view_.reserve(features);
}

std::size_t Initialiser::bytes() const {
  return capacity_bytes(expected_px_) + capacity_bytes(pairs_) + capacity_bytes(pair_.points) +
         capacity_bytes(owner_) + capacity_bytes(found_) + capacity_bytes(owner_distance_) +
         capacity_bytes(first_) + capacity_bytes(second_) + capacity_bytes(used_) +
         capacity_bytes(parallax_rad_) + two_view_.bytes();
}

void Initialiser::remember(std::shared_ptr<Frame> frame) {
  history_.push_back(std::move(frame));
  if (history_.size() > kHistoryFrames) history_.erase(history_.begin());
}

void Initialiser::clear() {
  history_.clear();
  reference_.reset();
  pair_.first.reset();
  pair_.second.reset();
  last_matches_ = 0;
}

void Initialiser::set_reference(std::shared_ptr<Frame> frame) {
  reference_ = std::move(frame);
  most_matches_ = 0;
  expected_px_.clear();
  for (const Feature& f : view_of(*reference_).set.features) expected_px_.emplace_back(f.u_px, f.v_px);
}

// Only a frame about half way between the reference and now can be the next reference. Pixels of older ones
// go back to the pool, and of those nearer than kCandidateSpacing_s to the candidate before.
void Initialiser::forget_pixels(std::int64_t half_utime) {
  std::int64_t last_utime = reference_->utime;
  for (const std::shared_ptr<Frame>& f : history_) {
    if (f == reference_ || f == history_.back()) continue;
    const bool candidate = f->utime >= half_utime && f->has_pixels() &&
                           seconds_between(last_utime, f->utime) > kCandidateSpacing_s - kEarly_s;
    if (candidate)
      last_utime = f->utime;
    else
      f->drop_pixels();
  }
}

void Initialiser::match(const Frame& frame) {
  pairs_.clear();
  const float radius_px = kFirstWindow * static_cast<float>(rig_camera_.camera.width_px());
  const FrameView &first = view_of(*reference_), &second = view_of(frame);
  owner_.assign(second.set.features.size(), -1);
  owner_distance_.assign(second.set.features.size(), 257);
  found_.assign(first.set.features.size(), -1);
  for (std::size_t i = 0; i < first.set.features.size(); ++i) {
    const Feature& f = first.set.features[i];
    DescriptorQuery q;
    q.descriptor = first.set.descriptors[i];
    q.u_px = expected_px_[i].x();
    q.v_px = expected_px_[i].y();
    q.radius_px = radius_px;
    q.min_level = f.level - 1;
    q.max_level = f.level + 1;
    q.max_hamming = config_.tracking.max_hamming * 3 / 4;
    q.ratio = 0.85F;
    int distance = 0;
    const int j = find_descriptor(
        second.set, second.grid, q, [](std::size_t) { return true; }, &distance);
    if (j < 0) continue;
    const auto ju = static_cast<std::size_t>(j);
    if (distance >= owner_distance_[ju]) continue;
    if (owner_[ju] >= 0) found_[static_cast<std::size_t>(owner_[ju])] = -1;
    owner_[ju] = static_cast<std::int32_t>(i);
    owner_distance_[ju] = distance;
    found_[i] = j;
  }
  for (std::size_t i = 0; i < found_.size(); ++i) {
    if (found_[i] < 0) continue;
    const auto j = static_cast<std::size_t>(found_[i]);
    pairs_.push_back({i, j});
    expected_px_[i] = {second.set.features[j].u_px, second.set.features[j].v_px};
  }
}

void Initialiser::unproject_pairs(const Frame& frame) {
  const Camera& camera = rig_camera_.camera;
  first_.clear();
  second_.clear();
  used_.clear();
  for (const Pairing& p : pairs_) {
    const Feature& a = view_of(*reference_).set.features[p.feature_first];
    const Feature& b = view_of(frame).set.features[p.feature_second];
    Eigen::Vector3d ba, bb;
    if (!camera.unproject({a.u_px, a.v_px}, &ba) || !camera.unproject({b.u_px, b.v_px}, &bb)) continue;
    first_.push_back(ba);
    second_.push_back(bb);
    used_.push_back(p);
  }
}

// A scene may be far for the most part: a quarter of the points near enough to fix the baseline is enough,
// and in a sparse scene half of those that a map must have.
bool Initialiser::shows_parallax(const TwoViewResult& motion) const {
  std::ptrdiff_t wide = 0;
  for (std::size_t i = 0; i < motion.parallax_rad.size(); ++i)
    wide += motion.parallax_rad[i] > config_.initialisation.min_parallax_rad && motion.inlier[i] != 0 ? 1 : 0;
  return wide >= std::max<std::ptrdiff_t>(config_.initialisation.min_landmarks / 2,
                                          static_cast<std::ptrdiff_t>(motion.inliers / 4));
}

// Most matches keep their place. Where many others flow, they belong to something that moves with the camera:
// of a scene that a standing camera sees, a smaller part moves.
Refusal Initialiser::standing_or_blocked(const Frame& frame) const {
  constexpr float kStill_px = 1.5F, kFlow_px = 5.0F;
  constexpr double kFlowingShare = 0.2;
  int still = 0, flowing = 0;
  for (const Pairing& p : used_) {
    const Feature& a = view_of(*reference_).set.features[p.feature_first];
    const Feature& b = view_of(frame).set.features[p.feature_second];
    const float moved_px = std::hypot(b.u_px - a.u_px, b.v_px - a.v_px);
    still += moved_px < kStill_px ? 1 : 0;
    flowing += moved_px > kFlow_px ? 1 : 0;
  }
  const auto matches = static_cast<double>(used_.size());
  if (flowing < kFlowingShare * matches) return {.reason = Reason::kStanding};
  return {Reason::kMovesWithCamera, still / matches, FixedFeatures::kMostShare};
}

Refusal Initialiser::refusal_of(const TwoViewResult& motion, const Frame& frame) {
  switch (motion.status) {
    case TwoViewStatus::kTooFewMatches:
      return {Reason::kFewMatches, static_cast<double>(last_matches_), kMinMatches};
    case TwoViewStatus::kNoParallax: {
      const double turn_rad = Eigen::AngleAxisd(motion.T_2_1.q).angle();
      if (turn_rad > kTurn_rad) return {Reason::kTurningOnly, turn_rad};
      return standing_or_blocked(frame);
    }
    case TwoViewStatus::kAmbiguous:
      return {.reason = Reason::kAmbiguousStart};
    case TwoViewStatus::kPoorModel:
      return poor_model(motion);
    case TwoViewStatus::kOk:
      break;
  }
  parallax_rad_.clear();
  for (std::size_t i = 0; i < motion.parallax_rad.size(); ++i)
    if (motion.inlier[i] != 0) parallax_rad_.push_back(motion.parallax_rad[i]);
  if (parallax_rad_.empty()) return {.reason = Reason::kAmbiguousStart};
  const auto quarter = parallax_rad_.begin() + static_cast<std::ptrdiff_t>(3 * parallax_rad_.size() / 4);
  std::nth_element(parallax_rad_.begin(), quarter, parallax_rad_.end());
  return {Reason::kLittleParallax, *quarter, config_.initialisation.min_parallax_rad};
}

bool Initialiser::solve(const std::shared_ptr<Frame>& frame) {
  unproject_pairs(*frame);
  const TwoViewResult& r =
      estimate_two_view(first_, second_, kCornerSigma_px / rig_camera_.camera.focal_px(), {}, &two_view_);
  if (r.status != TwoViewStatus::kOk || !shows_parallax(r)) {
    refusal_ = refusal_of(r, *frame);
    return false;
  }
  pair_.first = reference_;
  pair_.second = frame;
  pair_.camera = camera_;
  // T_2_1 is between cameras; with an unknown scale the lever arm to the body is zero by definition
  // (config.h).
  const SE3 T_c1_c2 = r.T_2_1.inverse();
  pair_.T_first_second = rig_camera_.T_body_camera * T_c1_c2 * rig_camera_.T_body_camera.inverse();
  pair_.points.clear();
  for (std::size_t i = 0; i < used_.size(); ++i) {
    if (r.inlier[i] == 0 || r.inverse_depth[i] <= 0.0) continue;
    pair_.points.push_back({used_[i].feature_first, used_[i].feature_second, r.inverse_depth[i]});
  }
  const int points = static_cast<int>(pair_.points.size());
  refusal_ = {Reason::kFewMatches, static_cast<double>(points),
              static_cast<double>(config_.initialisation.min_landmarks)};
  return points >= config_.initialisation.min_landmarks;
}

const InitialPair* Initialiser::add(const std::shared_ptr<Frame>& frame) {
  pair_.first.reset();
  pair_.second.reset();
  remember(frame);
  if (!reference_) {
    set_reference(frame);
    refusal_ = {.reason = Reason::kStanding};
    return nullptr;
  }
  match(*frame);
  last_matches_ = static_cast<int>(pairs_.size());
  const std::int64_t age_us = frame->utime - reference_->utime;
  const std::int64_t half_utime = reference_->utime + age_us / 2;
  most_matches_ = std::max(most_matches_, last_matches_);
  forget_pixels(half_utime);
  const int wanted = std::max(kMinMatches, static_cast<int>(kMinMatchShare * most_matches_));
  if (last_matches_ < wanted || 1e-6 * static_cast<double>(age_us) > config_.initialisation.max_age_s) {
    // The reference has gone out of sight: a frame half way is the next one. Where that is too far as well,
    // or there is none, this one.
    const auto next = std::find_if(history_.begin(), history_.end(), [&](const auto& f) {
      return f != reference_ && f->utime >= half_utime && f->has_pixels();
    });
    set_reference(next != history_.end() ? *next : frame);
    match(*frame);
    last_matches_ = static_cast<int>(pairs_.size());
    most_matches_ = last_matches_;
    refusal_ = {Reason::kFewMatches, static_cast<double>(last_matches_), static_cast<double>(wanted)};
    if (last_matches_ < wanted) set_reference(frame);
    return nullptr;
  }
  return solve(frame) ? &pair_ : nullptr;
}

}  // namespace farpoint::slam
