// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/landmark_maker.h"

#include <algorithm>
#include <cmath>

#include "slam/geometry/robust.h"
#include "slam/geometry/triangulation.h"
#include "slam/map/predict.h"
#include "slam/mapping/measurement.h"

namespace farpoint::slam {

namespace {

// Depth of the nearest points searched, as a share of the depth that nine tenths of the keyframe's landmarks
// lie beyond. Nearer points leave the image before they are of use. A share of the median would exclude the
// near landmarks, which hold the translation, from a map of distant ones.
constexpr double kNearQuantile = 0.9;  // of inverse depth
constexpr double kNearShare = 0.3;
// Least baseline of two keyframes, as a share of that depth: a shorter one shows no parallax.
constexpr double kMinBaselineShare = 0.002;
// Largest factor between a pair's change of size and the change that its depth predicts.
constexpr double kScaleTolerance = 1.8;
// The orientation of a corner repeats to about 10 degrees: three times that. The frame's roll counts as
// small.
constexpr float kMaxAngleDifference_rad = 0.6F;
// Error of neighbouring keyframes' poses in the image, 1 sigma.
constexpr double kPoseSigma_px = 0.5;
constexpr std::uint64_t kBearingLife_keyframes = 12;
constexpr int kMaxFailures = 3;
// Largest distance of a feature from its epipolar line, pixels of its pyramid level.
constexpr float kBand_level_px = 3.0F;
// Most pyramid levels between a corner and the level that its size predicts.
constexpr int kLevelReach = 3;
// Other keyframes that are searched for a point of two keyframes, most shared landmarks first. One in
// kFoundOneIn must show it: a patch may be hidden, blurred, or seen from another side. With all neighbours
// asked, five sixths of the right points of simulated roads and streets passed this share, and 6 to 12 % of
// the wrong ones.
constexpr int kWitnesses = 8;
constexpr int kFoundOneIn = 3;
// Range of the size in the witness against the host's within which the patch can be found.
constexpr float kMinWitnessScale = 0.55F, kMaxWitnessScale = 1.8F;
constexpr float kWitnessSearch_level_px = 2.0F;
constexpr double kWitnessBorder_px = 12.0;  // from the image's edge and its mask: half a patch is in it
// Largest ratio of a match's distance to the second best on the line: every depth on it is as likely.
constexpr float kSecondBest = 0.85F;

}  // namespace

LandmarkMaker::LandmarkMaker(const EstimatorConfig& config, Map* map, MappingCounts* counts)
    : config_(config), map_(*map), counts_(*counts) {
  for (int l = 0; l < config.pyramid.levels; ++l)
    level_scale_.push_back(static_cast<float>(std::pow(config.pyramid.scale_factor, l)));
  seen_by_.assign(map->landmarks().capacity(), 0);
}

bool LandmarkMaker::wanted(LandmarkHandle handle) const {
  if (handle.is_null()) return true;
  const Landmark* l = map_.landmarks().get(handle);
  return l != nullptr && l->state == LandmarkState::kBearing;
}

void LandmarkMaker::process(KeyframeHandle newer, const std::vector<KeyframeHandle>& neighbours) {
  witnesses_ = neighbours;
  for (const KeyframeHandle older : neighbours) {
    const int cameras = map_.keyframes()[newer].views.size();
    for (int c = 0; c < cameras; ++c) pair_views({newer, c}, {older, c});
  }
}

void LandmarkMaker::pair_views(Observer newer, Observer older) {
  if (!view_of(older).has_pixels() || !view_of(newer).has_pixels()) return;
  if (!view_of(older).has_corners() || !view_of(newer).has_corners()) return;
  const PairGeometry geometry = relate(newer, older);
  if (!geometry.valid) return;
  find_pairs(newer, older, geometry, &pairs_);
  for (const Pair& pair : pairs_) consume(newer, older, geometry, pair);
}

LandmarkMaker::PairGeometry LandmarkMaker::relate(Observer newer, Observer older) const {
  PairGeometry g;
  const SE3 T_world_old = map_.T_world_camera(map_.keyframes()[older.keyframe], older.camera);
  g.T_new_old = map_.T_world_camera(map_.keyframes()[newer.keyframe], newer.camera).inverse() * T_world_old;
  const SE3 T_old_new = g.T_new_old.inverse();
  g.R_old_new = T_old_new.rotation();
  g.t_old_new = T_old_new.t;
  const double baseline = g.T_new_old.t.norm();
  // Depth of the scene as the older view shows it.
  std::vector<double> inverse_depths;
  const std::vector<LandmarkHandle>& seen = view_of(older).landmarks;
  const SE3 T_old_world = T_world_old.inverse();
  // A share of the landmarks gives the quantile well enough.
  constexpr std::size_t kStride = 3;
  for (std::size_t i = 0; i < seen.size(); i += kStride) {
    const Landmark* l = map_.landmarks().get(seen[i]);
    if (l == nullptr || l->state == LandmarkState::kBearing) continue;
    const Eigen::Vector4d p = map_.world_point(*l);
    const double distance = (T_old_world.q * p.head<3>() + p[3] * T_old_world.t).norm();
    inverse_depths.push_back(p[3] / std::max(distance, 1e-9));
  }
  if (inverse_depths.size() < 4) return g;
  const auto near = inverse_depths.begin() +
                    static_cast<std::ptrdiff_t>(kNearQuantile * static_cast<double>(inverse_depths.size()));
  std::nth_element(inverse_depths.begin(), near, inverse_depths.end());
  const double near_inverse_depth = *near;
  g.max_inverse_depth = near_inverse_depth / kNearShare;
  // Without a base there is neither an epipolar line nor parallax.
  g.valid = baseline * near_inverse_depth > kMinBaselineShare;
  return g;
}

bool LandmarkMaker::epipolar_segment(const Eigen::Vector3f& bearing_new, const Camera& camera_old,
                                     const PairGeometry& g, Eigen::Vector2d* far, Eigen::Vector2d* near) {
  const Eigen::Vector3d direction = g.R_old_new * bearing_new.cast<double>();
  if (!camera_old.project(direction, far)) return false;
  double rho = g.max_inverse_depth;
  bool visible = camera_old.project(direction + rho * g.t_old_new, near);
  for (int i = 0; i < 6 && !visible; ++i) {
    rho *= 0.5;
    visible = camera_old.project(direction + rho * g.t_old_new, near);
  }
  return visible;
}

void LandmarkMaker::find_pairs(Observer newer_view, Observer older_view, const PairGeometry& geometry,
                               std::vector<Pair>* out) {
  out->clear();
  const KeyframeView &newer = view_of(newer_view), &older = view_of(older_view);
  const Camera& camera = map_.camera(older_view.camera).camera;
  best_of_old_.assign(older.set.features.size(), -1);
  wanted_old_.resize(older.set.features.size());
  ++round_;
  for (std::size_t j = 0; j < older.landmarks.size(); ++j) {
    const LandmarkHandle h = older.landmarks[j];
    wanted_old_[j] = wanted(h) ? 1 : 0;
    if (!h.is_null()) seen_by_[h.index] = round_;
  }
  index_.build(older.set, wanted_old_, camera.width_px(), camera.height_px());
  EpipolarQuery query;
  query.max_hamming = config_.tracking.max_hamming;
  query.ratio = kSecondBest;
  query.max_turn_rad = kMaxAngleDifference_rad;
  for (std::size_t i = 0; i < newer.set.features.size(); ++i) {
    const LandmarkHandle at_new = newer.landmarks[i];
    if (!wanted(at_new)) continue;
    // A VMP that the older keyframe sees already has nothing to find there.
    if (!at_new.is_null() && seen_by_[at_new.index] == round_) continue;
    if (!epipolar_segment(newer.bearings[i], camera, geometry, &query.from_px, &query.to_px)) continue;
    const Feature& f = newer.set.features[i];
    query.half_width_px = kBand_level_px * level_scale_[f.level];
    query.min_level = f.level - kLevelReach;
    query.max_level = f.level + kLevelReach;
    query.angle_rad = f.angle_rad;
    query.descriptor = &newer.set.descriptors[i];
    const EpipolarMatch match = index_.find(older.set, query);
    if (match.feature < 0) continue;
    int& best = best_of_old_[static_cast<std::size_t>(match.feature)];
    const Pair pair{i, static_cast<std::size_t>(match.feature), match.distance};
    if (best < 0) {
      best = static_cast<int>(out->size());
      out->push_back(pair);
    } else if (match.distance < (*out)[static_cast<std::size_t>(best)].distance) {
      (*out)[static_cast<std::size_t>(best)] = pair;
    }
  }
}

void LandmarkMaker::consume(Observer newer, Observer older, const PairGeometry& geometry, const Pair& pair) {
  // Earlier pairs may have changed what hangs on these features.
  const LandmarkHandle at_new = view_of(newer).landmarks[pair.feature_new];
  const LandmarkHandle at_old = view_of(older).landmarks[pair.feature_old];
  if (!wanted(at_new) || !wanted(at_old)) return;
  if (at_new.is_null() && at_old.is_null()) {
    create(newer, older, geometry, pair);
  } else if (at_old.is_null()) {
    attach(at_new, older, pair.feature_old);
  } else if (at_new.is_null()) {
    attach(at_old, newer, pair.feature_new);
  } else if (at_new != at_old) {
    merge(at_old, at_new);
  }
}

void LandmarkMaker::create(Observer newer, Observer older, const PairGeometry& g, const Pair& pair) {
  const Keyframe& k_new = map_.keyframes()[newer.keyframe];
  const Eigen::Vector3d f_new = view_of(newer).bearings[pair.feature_new].cast<double>();
  const Eigen::Vector3d f_old = view_of(older).bearings[pair.feature_old].cast<double>();
  const InverseDepth first = triangulate_inverse_depth(f_old, g.T_new_old, f_new);
  const double parallax_rad = parallax_angle(g.T_new_old.q * f_old, f_new);
  const bool baseline = config_.landmarks.mode == LandmarkMode::kBaseline;
  if (baseline && (parallax_rad < config_.landmarks.promote_parallax_rad || !first.ok)) return;

  const LandmarkHandle handle = map_.add_landmark(older.keyframe, older.camera, pair.feature_old);
  if (handle.is_null()) return;
  Landmark& l = map_.landmarks()[handle];
  l.inverse_depth = first.ok ? std::max(0.0, first.inverse_depth) : 0.0;
  l.created_keyframe = k_new.id;
  l.created_utime = k_new.utime;
  Observation o;
  if (!measure_observation(config_, map_, l, newer.keyframe, newer.camera, pair.feature_new, &o) ||
      !map_.add_observation(handle, o)) {
    map_.remove_landmark(handle);
    return;
  }
  try_promote(handle, false);
  const Landmark* made = map_.landmarks().get(handle);
  if (made == nullptr) return;
  if (made->state != LandmarkState::kBearing) return;
  if (baseline)
    map_.remove_landmark(handle);
  else
    ++counts_.vmp_made;
}

void LandmarkMaker::attach(LandmarkHandle handle, Observer observer, std::size_t feature) {
  const Landmark& l = map_.landmarks()[handle];
  Observation o;
  if (!measure_observation(config_, map_, l, observer.keyframe, observer.camera, feature, &o) ||
      !map_.add_observation(handle, o))
    return;
  ++counts_.vmp_attached;
  try_promote(handle, true);
}

void LandmarkMaker::reconsider(LandmarkHandle handle) {
  if (map_.landmarks()[handle].state != LandmarkState::kBearing) return;
  ++counts_.vmp_attached;
  try_promote(handle, true);
}

void LandmarkMaker::merge(LandmarkHandle into, LandmarkHandle from) {
  // Consistent when the patch of the one is found where the other was seen, in each of its keyframes.
  const Landmark source = map_.landmarks()[from];
  std::vector<Observation> moved;
  for (const Observation& o : source.observations) {
    if (o.feature < 0 || Map::find_observation(map_.landmarks()[into], o.keyframe, o.camera) != nullptr)
      continue;
    Observation measured;
    if (!measure_observation(config_, map_, map_.landmarks()[into], o.keyframe, o.camera,
                             static_cast<std::size_t>(o.feature), &measured))
      return;
    moved.push_back(measured);
  }
  map_.remove_landmark(from);
  for (const Observation& o : moved) map_.add_observation(into, o);
  ++counts_.vmp_merged;
  try_promote(into, true);
}

LandmarkMaker::DepthFit LandmarkMaker::fit_depth(const Landmark& l) const {
  DepthFit fit;
  const SE3 T_world_anchor = map_.T_world_anchor(l);
  struct View {
    const Camera* camera;
    SE3 T_camera_anchor;
    const Observation* observation;
  };
  std::vector<View> views;
  views.reserve(l.observations.size());
  for (const Observation& o : l.observations) {
    if (o.sigma_px <= 0.0F) continue;
    const Keyframe& k = map_.keyframes()[o.keyframe];
    views.push_back(
        {&map_.camera(o.camera).camera, map_.T_world_camera(k, o.camera).inverse() * T_world_anchor, &o});
  }
  // Start from the best pair, then Gauss-Newton on the one unknown.
  double rho = l.inverse_depth;
  double best_base = -1.0;
  for (const View& v : views) {
    Eigen::Vector3d bearing;
    const double base = v.T_camera_anchor.t.cross(v.T_camera_anchor.q * l.bearing).norm();
    if (base <= best_base || !v.camera->unproject(v.observation->pixel.cast<double>(), &bearing)) continue;
    best_base = base;
    rho = std::max(0.0, triangulate_inverse_depth(l.bearing, v.T_camera_anchor, bearing).inverse_depth);
  }
  double information = 0.0;
  for (int iteration = 0; iteration < 6; ++iteration) {
    information = 0.0;
    double gradient = 0.0;
    fit.max_chi2 = 0.0;
    fit.worst = {};
    for (const View& v : views) {
      const Eigen::Vector3d p = v.T_camera_anchor.q * l.bearing + rho * v.T_camera_anchor.t;
      Eigen::Vector2d pixel;
      Matrix23d J;
      const double variance = static_cast<double>(v.observation->sigma_px * v.observation->sigma_px) +
                              kPoseSigma_px * kPoseSigma_px;
      if (!v.camera->project(p, &pixel, &J)) {
        fit.max_chi2 = 1e9;
        fit.worst = {v.observation->keyframe, v.observation->camera};
        continue;
      }
      const Eigen::Vector2d r = pixel - v.observation->pixel.cast<double>();
      const Eigen::Vector2d d = J * v.T_camera_anchor.t;
      information += d.squaredNorm() / variance;
      gradient += d.dot(r) / variance;
      const double chi2 = r.squaredNorm() / variance;
      if (chi2 > fit.max_chi2)
        fit.max_chi2 = chi2, fit.worst = {v.observation->keyframe, v.observation->camera};
    }
    if (information <= 0.0) return fit;
    const double step = -gradient / information;
    if (rho + step < 0.0 && rho == 0.0) break;
    rho = std::max(0.0, rho + step);
    if (std::fabs(step) < 1e-3 / std::sqrt(information)) break;
  }
  fit.inverse_depth = rho;
  fit.sigma = 1.0 / std::sqrt(information);
  fit.ok = fit.max_chi2 < kChi2TwoDof;
  return fit;
}

bool LandmarkMaker::enough_information(const Landmark& l, const DepthFit& fit) const {
  const bool wide = map_.is_wide(l);
  if (wide || config_.landmarks.mode == LandmarkMode::kBaseline) return wide;
  // Short of the angle, three keyframes must agree on the depth as well as two under the angle would. A
  // mismatch along the epipolar line does not survive the third. A laxer bound (0.15) made KITTI 03 half
  // worse by a tenth to a fifth: points are then promoted when noise makes them look near.
  return l.observations.size() >= 3 &&
         fit.sigma < config_.landmarks.promote_relative_sigma * fit.inverse_depth;
}

bool LandmarkMaker::found_elsewhere(const Landmark& l) const {
  const PredictionInput input = prediction_input(map_, l);
  int asked = 0, found = 0, left = static_cast<int>(witnesses_.size());
  for (const KeyframeHandle witness : witnesses_) {
    // Ends once the keyframes that are left cannot change the answer.
    const int more = std::min(left--, kWitnesses - asked);
    const bool certain = kFoundOneIn * found >= asked + more;
    if (more == 0 || certain || kFoundOneIn * (found + more) < asked + more) break;
    const Keyframe* k = map_.keyframes().get(witness);
    if (k == nullptr || Map::find_observation(l, witness) != nullptr) continue;
    const std::optional<bool> answer = shows(*k, l, input);
    if (!answer) continue;
    ++asked;
    if (*answer) ++found;
  }
  return kFoundOneIn * found >= asked;
}

std::optional<bool> LandmarkMaker::shows(const Keyframe& witness, const Landmark& l,
                                         const PredictionInput& input) const {
  for (int c = 0; c < witness.views.size(); ++c) {
    const KeyframeView& view = witness.views[c];
    if (!view.has_pixels()) continue;
    Prediction p;
    if (!predict(input, map_.camera(c).camera, map_.T_world_camera(witness, c).inverse(), kWitnessBorder_px,
                 &p))
      continue;
    if (map_.camera(c).is_masked(p.pixel, kWitnessBorder_px)) continue;
    if (p.scale_change < kMinWitnessScale || p.scale_change > kMaxWitnessScale) continue;
    const float search_px =
        kWitnessSearch_level_px * std::max(1.0F, level_scale_[l.host_level] * p.scale_change);
    return view.image->align(l.patch, p.A_target_host, p.pixel.cast<float>(), search_px).ok;
  }
  return std::nullopt;
}

void LandmarkMaker::try_promote(LandmarkHandle handle, bool through_vmp) {
  Landmark& l = map_.landmarks()[handle];
  const DepthFit fit = fit_depth(l);
  if (!fit.ok) {
    // Removes the worst observation, and the landmark after a few failures.
    ++l.failures;
    if (l.failures >= kMaxFailures || l.observations.size() <= 2) {
      map_.remove_landmark(handle);
      if (through_vmp) ++counts_.vmp_rejected;
    } else if (!map_.remove_observation(handle, fit.worst.keyframe, fit.worst.camera) && through_vmp) {
      ++counts_.vmp_rejected;
    }
    return;
  }
  l.inverse_depth = fit.inverse_depth;
  l.inverse_depth_sigma = fit.sigma;
  if (!enough_information(l, fit)) return;
  // Two sightings fit any mismatch along the epipolar line; three have passed the test of the fit.
  if (l.observations.size() == 2 && !found_elsewhere(l)) return;

  // Size in the images against size by depth.
  const Observation& newest = l.observations.back();
  const Keyframe& k = map_.keyframes()[newest.keyframe];
  const SE3 T_camera_anchor = map_.T_world_camera(k, newest.camera).inverse() * map_.T_world_anchor(l);
  const double scale_change =
      1.0 / (T_camera_anchor.q * l.bearing + l.inverse_depth * T_camera_anchor.t).norm();
  const double seen_change = std::pow(config_.pyramid.scale_factor, newest.level - l.host_level);
  const double ratio = scale_change / seen_change;
  if (ratio > kScaleTolerance || ratio < 1.0 / kScaleTolerance) {
    map_.remove_landmark(handle);
    if (through_vmp) ++counts_.vmp_rejected;
    return;
  }
  l.state = l.observations.size() > 2 ? LandmarkState::kFull : LandmarkState::kWeak;
  l.through_vmp = through_vmp;
  if (k.id > l.created_keyframe) {
    l.created_keyframe = k.id;
    l.created_utime = k.utime;
  }
  l.creation_depth = 1.0 / (scale_change * l.inverse_depth);
  l.creation_relative_sigma = fit.sigma / fit.inverse_depth;
  ++counts_.landmarks_made;
  if (through_vmp) ++counts_.vmp_promoted;
}

void LandmarkMaker::evict_bearings(KeyframeHandle newest) {
  const std::uint64_t now = map_.keyframes()[newest].id;
  const std::int32_t map_id = map_.keyframes()[newest].map_id;
  struct Aged {
    LandmarkHandle handle;
    std::uint64_t last_seen;
    double parallax_rad;
  };
  std::vector<Aged> alive;
  map_.landmarks().for_each([&](LandmarkHandle h, const Landmark& l) {
    if (l.state != LandmarkState::kBearing) return;
    if (l.map_id != map_id || l.last_seen_keyframe + kBearingLife_keyframes < now) {
      map_.remove_landmark(h);
      ++counts_.vmp_evicted;
      return;
    }
    alive.push_back({h, l.last_seen_keyframe, l.max_parallax_rad});
  });
  const auto limit = static_cast<std::size_t>(config_.landmarks.max_bearing);
  if (alive.size() <= limit) return;
  std::stable_sort(alive.begin(), alive.end(), [](const Aged& a, const Aged& b) {
    return a.last_seen != b.last_seen ? a.last_seen < b.last_seen : a.parallax_rad < b.parallax_rad;
  });
  for (std::size_t i = 0; i + limit < alive.size(); ++i) {
    map_.remove_landmark(alive[i].handle);
    ++counts_.vmp_evicted;
  }
}

}  // namespace farpoint::slam
