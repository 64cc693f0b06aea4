// SPDX-License-Identifier: Apache-2.0
#include "slam/tracking/matcher.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "slam/image/descriptor_search.h"
#include "slam/tracking/work_space.h"

namespace farpoint::slam {

namespace {

constexpr double kBorderPx = 4.0;  // of the image, and of its mask
// Sigmas of a landmark's depth that the search window takes in, and the most that they widen it.
constexpr double kDepthSigmas = 2.0, kMostDepthPx = 20.0;
// How far alignment may move from the corner, pixels of the corner's level.
constexpr float kMaxAlignmentShiftPx = 2.0F;

}  // namespace

Matcher::Matcher(const EstimatorConfig& config, int cameras)
    : config_(config.tracking), pyramid_(config.pyramid) {
  const auto landmarks = static_cast<std::size_t>(config.capacity.landmarks),
             in_view = static_cast<std::size_t>(config.capacity.view_landmarks),
             features = static_cast<std::size_t>(config.extractor.features);
  const auto images = static_cast<std::size_t>(cameras);
  reserve_touched(&candidates_, images * in_view);
  reserve_touched(&matches_, images * features);
  reserve_touched(&taken_, images * features);
  reserve_touched(&seen_, in_view);
  reserve_touched(&matched_, images * in_view);
  reserve_touched(&candidate_of_, images * in_view);
  view_index_of_slot_.assign(landmarks, 0);
  for (int l = 0; l < pyramid_.levels; ++l) level_scale_.push_back(std::pow(pyramid_.scale_factor, l));
}

std::size_t Matcher::bytes() const {
  return capacity_bytes(candidates_) + capacity_bytes(matches_) + capacity_bytes(taken_) +
         capacity_bytes(seen_) + capacity_bytes(matched_) + capacity_bytes(candidate_of_) +
         capacity_bytes(view_index_of_slot_);
}

void Matcher::set_view(std::shared_ptr<const LocalView> view) {
  view_ = std::move(view);
  if (!view_) return;
  for (std::size_t i = 0; i < view_->landmarks.size(); ++i)
    view_index_of_slot_[view_->landmarks[i].handle.index] = static_cast<std::uint32_t>(i);
  mark_seen({});
}

void Matcher::mark_seen(std::span<const LandmarkHandle> seen) {
  seen_.assign(view_->landmarks.size(), 0);
  for (const LandmarkHandle& h : seen) {
    // An entry of an older view names another landmark, or none.
    const std::uint32_t i = view_index_of_slot_[h.index];
    if (i < view_->landmarks.size() && view_->landmarks[i].handle == h) seen_[i] = 1;
  }
}

void Matcher::begin(const Frame& frame) {
  features_ = 0;
  for (int c = 0; c < frame.views.size(); ++c)
    features_ = std::max(features_, frame.views[c].set.features.size());
  taken_.assign(static_cast<std::size_t>(frame.views.size()) * features_, 0);
  matches_.clear();
}

void Matcher::project(const Frame& frame, const SE3& T_world_body, LandmarkSubset subset) {
  const StageSpan span(listener_, Stage::kMatching);
  candidates_.clear();
  for (int c = 0; c < frame.views.size(); ++c)
    if (!frame.views[c].set.features.empty()) project_into(c, T_world_body, subset);
}

void Matcher::project_into(int index, const SE3& T_world_body, LandmarkSubset subset) {
  const RigCamera& rig_camera = camera(index);
  const Predictor predictor(rig_camera.camera, (T_world_body * rig_camera.T_body_camera).inverse());
  MatchCandidate c;
  c.camera = index;
  for (std::size_t i = 0; i < view_->landmarks.size(); ++i) {
    if (!in_subset(i, subset)) continue;
    const ViewLandmark& l = view_->landmarks[i];
    if (!predictor.predict(l.point_w, l.anchor_w, l.d_point_d_pixel, kBorderPx, &c.prediction)) continue;
    if (!is_matchable(c.prediction) || rig_camera.is_masked(c.prediction.pixel, kBorderPx)) continue;
    c.view_index = static_cast<std::uint32_t>(i);
    c.level = predicted_level(l.host_level, c.prediction.scale_change,
                              static_cast<float>(pyramid_.scale_factor), pyramid_.levels);
    candidates_.push_back(c);
  }
}

Match Matcher::make_match(const Frame& frame, std::uint32_t view_index, int camera,
                          std::int32_t feature) const {
  const Feature& f = frame.views[camera].set.features[static_cast<std::size_t>(feature)];
  Match m;
  m.camera = static_cast<std::uint8_t>(camera);
  m.view_index = view_index;
  m.feature = feature;
  m.pixel = {f.u_px, f.v_px};
  m.sigma_px = static_cast<float>(level_scale_[f.level]);
  m.inlier = true;
  return m;
}

int Matcher::match(const Frame& frame, double radius_px, float ratio) {
  const StageSpan span(listener_, Stage::kMatching);
  int found = 0;
  matched_.assign(slot(frame.views.size(), 0), 0);
  for (const Match& m : matches_) matched_[slot(m.camera, m.view_index)] = 1;
  for (const MatchCandidate& c : candidates_) {
    const ViewLandmark& l = view_->landmarks[c.view_index];
    if (matched_[slot(c.camera, c.view_index)] != 0) continue;
    const double depth_px = std::min(
        kMostDepthPx, kDepthSigmas * c.prediction.d_pixel_d_inverse_depth.norm() * l.inverse_depth_sigma);
    DescriptorQuery q;
    q.descriptor = l.descriptor;
    q.u_px = static_cast<float>(c.prediction.pixel.x());
    q.v_px = static_cast<float>(c.prediction.pixel.y());
    q.radius_px = static_cast<float>(radius_px * level_scale_[static_cast<std::size_t>(c.level)] + depth_px);
    q.min_level = c.level - 1;
    q.max_level = c.level + 1;
    q.max_hamming = config_.max_hamming;
    q.ratio = ratio;
    const FrameView& image = frame.views[c.camera];
    const std::uint8_t* taken_here = &taken(c.camera, 0);
    const int feature =
        find_descriptor(image.set, image.grid, q, [&](std::size_t f) { return taken_here[f] == 0; });
    if (feature < 0) continue;
    taken(c.camera, feature) = 1;
    matches_.push_back(make_match(frame, c.view_index, c.camera, feature));
    ++found;
  }
  return found;
}

void Matcher::add(const Frame& frame, std::uint32_t view_index, int camera, std::int32_t feature) {
  if (std::exchange(taken(camera, feature), std::uint8_t{1}) != 0) return;
  matches_.push_back(make_match(frame, view_index, camera, feature));
}

void Matcher::align(const Frame& frame) {
  if (!frame.has_pixels()) return;
  const StageSpan span(listener_, Stage::kAlignment);
  candidate_of_.assign(slot(frame.views.size(), 0), -1);
  for (std::size_t i = 0; i < candidates_.size(); ++i)
    candidate_of_[slot(candidates_[i].camera, candidates_[i].view_index)] = static_cast<std::int32_t>(i);
  std::size_t kept = 0;
  for (Match m : matches_) {
    const std::int32_t candidate = candidate_of_[slot(m.camera, m.view_index)];
    if (candidate < 0) continue;
    if (align_one(frame, candidates_[static_cast<std::size_t>(candidate)].prediction, &m))
      matches_[kept++] = m;
    else
      taken(m.camera, m.feature) = 0;
  }
  matches_.resize(kept);
}

bool Matcher::align_one(const Frame& frame, const Prediction& prediction, Match* match) const {
  const FrameView& image = frame.views[match->camera];
  if (!image.image) return true;  // this camera's pixels are not kept
  const Feature& f = image.set.features[static_cast<std::size_t>(match->feature)];
  const auto level_scale = static_cast<float>(level_scale_[f.level]);
  const Alignment a = image.image->align(landmark_of(*match).patch, prediction.A_target_host,
                                         {f.u_px, f.v_px}, kMaxAlignmentShiftPx * level_scale);
  if (!a.ok) return false;
  match->pixel = a.pixel;
  match->sigma_px = std::hypot(a.sigma_px, static_cast<float>(config_.pixel_sigma_px));
  match->aligned = true;
  return true;
}

void Matcher::measure_further(const Frame& frame, const SE3& T_world_body) {
  if (frame.views.size() < 2 || !view_->judgement.metric) return;
  const StageSpan span(listener_, Stage::kAlignment);
  const std::size_t matches = matches_.size();
  for (int c = 1; c < frame.views.size(); ++c)
    if (frame.views[c].image && frame.views[c].set.features.empty())
      measure_in(frame, c, T_world_body, matches);
}

void Matcher::measure_in(const Frame& frame, int index, const SE3& T_world_body, std::size_t matches) {
  const RigCamera& rig_camera = camera(index);
  const Predictor predictor(rig_camera.camera, (T_world_body * rig_camera.T_body_camera).inverse());
  for (std::size_t i = 0; i < matches; ++i) {
    const Match& first = matches_[i];
    if (!first.aligned || first.camera != 0) continue;
    const ViewLandmark& l = landmark_of(first);
    const std::int32_t candidate = candidate_of_[slot(0, first.view_index)];
    const Prediction& seen = candidates_[static_cast<std::size_t>(candidate)].prediction;
    Prediction p;
    if (!predictor.predict(l.point_w, l.anchor_w, l.d_point_d_pixel, kBorderPx, &p) || !is_matchable(p))
      continue;
    // The pose's error moves the landmark in both images alike; so much is known from the first.
    const Eigen::Matrix2d between = (p.A_target_host * seen.A_target_host.inverse()).cast<double>();
    const Eigen::Vector2d moved = between * (first.pixel.cast<double>() - seen.pixel);
    const double open_px = kDepthSigmas * l.inverse_depth_sigma *
                           (p.d_pixel_d_inverse_depth - between * seen.d_pixel_d_inverse_depth).norm();
    const double reach_px =
        kMaxAlignmentShiftPx *
        level_scale_[static_cast<std::size_t>(predicted_level(
            l.host_level, p.scale_change, static_cast<float>(pyramid_.scale_factor), pyramid_.levels))];
    if (!(open_px <= reach_px)) continue;
    const Alignment a = frame.views[index].image->align(
        l.patch, p.A_target_host, (p.pixel + moved).cast<float>(), static_cast<float>(reach_px));
    if (!a.ok) continue;
    Match m = first;
    m.camera = static_cast<std::uint8_t>(index);
    m.further = true;
    m.pixel = a.pixel;
    m.sigma_px = std::hypot(a.sigma_px, static_cast<float>(config_.pixel_sigma_px));
    m.inlier = true;
    matches_.push_back(m);
  }
}

void Matcher::drop_outliers() {
  std::size_t kept = 0;
  for (const Match& m : matches_) {
    if (m.inlier)
      matches_[kept++] = m;
    else
      taken(m.camera, m.feature) = 0;
  }
  matches_.resize(kept);
}

}  // namespace farpoint::slam
