// SPDX-License-Identifier: Apache-2.0
#include "slam/tracking/initialiser.h"

#include <algorithm>

#include "slam/geometry/two_view.h"
#include "slam/image/descriptor_search.h"

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

}  // namespace

Initialiser::Initialiser(const EstimatorConfig& config, const Rig& rig, int camera)
    : config_(config), camera_(camera), rig_camera_(rig.cameras[static_cast<std::size_t>(camera)]) {
  history_.reserve(kHistoryFrames + 1);
}

void Initialiser::remember(std::shared_ptr<Frame> frame) {
  history_.push_back(std::move(frame));
  if (history_.size() > kHistoryFrames) history_.erase(history_.begin());
}

void Initialiser::clear() {
  history_.clear();
  reference_.reset();
  last_matches_ = 0;
}

void Initialiser::set_reference(std::shared_ptr<Frame> frame) {
  reference_ = std::move(frame);
  most_matches_ = 0;
  expected_px_.clear();
  for (const Feature& f : view_of(*reference_).set.features) expected_px_.emplace_back(f.u_px, f.v_px);
}

// Only a frame about half way between the reference and now can be the next reference. What is older never
// can again, and every second frame will do: the other pixels go back to the pool.
void Initialiser::forget_pixels(std::uint64_t age) {
  const std::uint64_t half = reference_->number + (age + 1) / 2;
  for (const std::shared_ptr<Frame>& f : history_)
    if (f != reference_ && f != history_.back() && (f->number < half || f->number % 2 == 1)) f->drop_pixels();
}

void Initialiser::match(const Frame& frame, std::vector<Pairing>* out) {
  out->clear();
  const float radius_px = kFirstWindow * static_cast<float>(rig_camera_.camera.width_px());
  const FrameView &first = view_of(*reference_), &second = view_of(frame);
  std::vector<std::int32_t> owner(second.set.features.size(), -1);
  std::vector<int> owner_distance(second.set.features.size(), 257);
  std::vector<std::int32_t> found(first.set.features.size(), -1);
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
    if (distance >= owner_distance[ju]) continue;
    if (owner[ju] >= 0) found[static_cast<std::size_t>(owner[ju])] = -1;
    owner[ju] = static_cast<std::int32_t>(i);
    owner_distance[ju] = distance;
    found[i] = j;
  }
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i] < 0) continue;
    const auto j = static_cast<std::size_t>(found[i]);
    out->push_back({i, j});
    expected_px_[i] = {second.set.features[j].u_px, second.set.features[j].v_px};
  }
}

std::optional<InitialPair> Initialiser::solve(const std::shared_ptr<Frame>& frame,
                                              const std::vector<Pairing>& pairs) const {
  const RigCamera& camera = rig_camera_;
  std::vector<Eigen::Vector3d> first, second;
  std::vector<Pairing> used;
  for (const Pairing& p : pairs) {
    const Feature& a = view_of(*reference_).set.features[p.feature_first];
    const Feature& b = view_of(*frame).set.features[p.feature_second];
    Eigen::Vector3d ba, bb;
    if (!camera.camera.unproject({a.u_px, a.v_px}, &ba) || !camera.camera.unproject({b.u_px, b.v_px}, &bb))
      continue;
    first.push_back(ba);
    second.push_back(bb);
    used.push_back(p);
  }
  const TwoViewResult r = estimate_two_view(first, second, kCornerSigma_px / camera.camera.focal_px());
  if (r.status != TwoViewStatus::kOk) return {};
  // A scene may be far for the most part: a quarter of the points near enough to fix the baseline is enough,
  // and in a sparse scene half of those that a map must have.
  const auto wide = std::count_if(r.parallax_rad.begin(), r.parallax_rad.end(), [&](const double& p) {
    return p > config_.initialisation.min_parallax_rad &&
           r.inlier[static_cast<std::size_t>(&p - r.parallax_rad.data())] != 0;
  });
  if (wide < std::max<std::ptrdiff_t>(config_.initialisation.min_landmarks / 2,
                                      static_cast<std::ptrdiff_t>(r.inliers / 4)))
    return {};
  InitialPair pair;
  pair.first = reference_;
  pair.second = frame;
  pair.camera = camera_;
  // T_2_1 is between cameras; with an unknown scale the lever arm to the body is zero by definition
  // (config.h).
  const SE3 T_c1_c2 = r.T_2_1.inverse();
  pair.T_first_second = camera.T_body_camera * T_c1_c2 * camera.T_body_camera.inverse();
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (r.inlier[i] == 0 || r.inverse_depth[i] <= 0.0) continue;
    pair.points.push_back({used[i].feature_first, used[i].feature_second, r.inverse_depth[i]});
  }
  if (static_cast<int>(pair.points.size()) < config_.initialisation.min_landmarks) return {};
  return pair;
}

std::optional<InitialPair> Initialiser::add(const std::shared_ptr<Frame>& frame) {
  remember(frame);
  if (!reference_) {
    set_reference(frame);
    return {};
  }
  match(*frame, &pairs_);
  last_matches_ = static_cast<int>(pairs_.size());
  const auto age = frame->number - reference_->number;
  most_matches_ = std::max(most_matches_, last_matches_);
  forget_pixels(age);
  const int wanted = std::max(kMinMatches, static_cast<int>(kMinMatchShare * most_matches_));
  if (last_matches_ < wanted || static_cast<double>(age) > config_.initialisation.max_frames) {
    // The reference has gone out of sight: a frame half way is the next one. Where that is too far as well,
    // or there is none, this one.
    const std::uint64_t half = reference_->number + (age + 1) / 2;
    const auto next = std::find_if(history_.begin(), history_.end(),
                                   [&](const auto& f) { return f->number >= half && f->has_pixels(); });
    set_reference(next != history_.end() && age > 1 ? *next : frame);
    match(*frame, &pairs_);
    last_matches_ = static_cast<int>(pairs_.size());
    most_matches_ = last_matches_;
    if (last_matches_ < wanted) set_reference(frame);
    return {};
  }
  return solve(frame, pairs_);
}

}  // namespace farpoint::slam
