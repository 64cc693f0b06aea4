// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/mapper.h"

#include <algorithm>
#include <stdexcept>

#include "slam/mapping/forgetting.h"
#include "slam/mapping/neighbours.h"

namespace farpoint::slam {

namespace {

// The first adjustment of a map starts further from its optimum than later ones.
constexpr int kFirstIterations = 20;
// The camera whose calibration is refined.
constexpr int kRefinedCamera = 0;

MapOptions map_options(const EstimatorConfig& config, const Rig& rig) {
  MapOptions options;
  options.views_per_keyframe = static_cast<int>(rig.cameras.size());
  options.wide_parallax_rad = config.landmarks.promote_parallax_rad;
  options.features = static_cast<std::size_t>(config.extractor.features);
  // Twice the longest list in use: keyframes that are removed leave gaps until the next update.
  const int longest = std::max(config.mapping.neighbours, config.mapping.window_keyframes);
  options.covisible = 2 * std::max(ViewBuilder::kNeighbours, static_cast<std::size_t>(longest));
  return options;
}

}  // namespace

Mapper::Mapper(const EstimatorConfig& config, const Rig& rig)
    : config_(config),
      map_(config.capacity, rig, map_options(config, rig)),
      keyframe_maker_(&map_, &counts_),
      duplicates_(config_, &map_, &counts_),
      landmark_maker_(config_, &map_, &counts_),
      rig_depth_(config_, &map_, &landmark_maker_, &counts_),
      probation_(&map_, &counts_),
      window_(config_, &map_, &counts_),
      solver_(static_cast<std::size_t>(config.mapping.window_landmarks),
              static_cast<std::size_t>(config.mapping.window_sightings)),
      calibrator_(config.calibration, rig.cameras[kRefinedCamera].camera, kRefinedCamera),
      view_builder_(config_, &map_) {
  if (rig.cameras.size() > 1) rig_calibrator_.emplace(config.calibration, rig);
  if (config.mapping.solver == "ceres" && config.mapping.solve_instead == nullptr)
    throw std::invalid_argument("mapping.solver: ceres: no solver was given with it");
}

// -------------------------------------------------------------------------------------------------------------
// A new map

std::shared_ptr<const LocalView> Mapper::start_map(const InitialPair& pair, std::int32_t map_id) {
  settling_.start_map();
  probation_.clear();
  if (pair.second == nullptr) return start_metric_map(*pair.first, map_id);
  const KeyframeHandle first = keyframe_maker_.make(*pair.first, SE3{}, map_id);
  const KeyframeHandle second = keyframe_maker_.make(*pair.second, pair.T_first_second, map_id);
  if (first.is_null() || second.is_null()) {
    map_.discard_map(map_id);
    return nullptr;
  }
  add_initial_landmarks(pair, first, second);
  map_.update_covisibility(second);
  (void)optimise(second, kFirstIterations);
  if (count_landmarks(map_id) < static_cast<std::size_t>(config_.initialisation.min_landmarks) / 2) {
    map_.discard_map(map_id);
    return nullptr;
  }
  note_creation_sigmas(map_id);
  return make_view(second);
}

std::shared_ptr<const LocalView> Mapper::start_metric_map(const Frame& frame, std::int32_t map_id) {
  const KeyframeHandle first = keyframe_maker_.make(frame, SE3{}, map_id);
  if (first.is_null()) return nullptr;
  rig_depth_.measure(first);
  make_full(map_id);
  if (count_landmarks(map_id) < static_cast<std::size_t>(config_.initialisation.min_landmarks) / 2) {
    map_.discard_map(map_id);
    return nullptr;
  }
  note_creation_sigmas(map_id);
  map_.update_covisibility(first);
  settling_.start_metric_map();
  return make_view(first);
}

// A map's first points need no probation against keyframes that it does not have.
void Mapper::make_full(std::int32_t map_id) {
  map_.landmarks().for_each([&](LandmarkHandle, Landmark& l) {
    if (l.map_id == map_id && l.state == LandmarkState::kWeak) l.state = LandmarkState::kFull;
  });
}

void Mapper::add_initial_landmarks(const InitialPair& pair, KeyframeHandle first, KeyframeHandle second) {
  for (const InitialPoint& p : pair.points)
    if (add_initial_landmark(p, {first, pair.camera}, {second, pair.camera})) ++counts_.landmarks_made;
}

bool Mapper::add_initial_landmark(const InitialPoint& point, Observer first, Observer second) {
  const LandmarkHandle handle = map_.add_landmark(first.keyframe, first.camera, point.feature_first);
  if (handle.is_null()) return false;
  const Keyframe& k2 = map_.keyframes()[second.keyframe];
  Landmark& l = map_.landmarks()[handle];
  l.inverse_depth = point.inverse_depth;
  l.state = LandmarkState::kFull;
  l.created_keyframe = k2.id;
  l.created_utime = k2.utime;
  const Eigen::Vector4d w = map_.world_point(l);
  l.creation_depth = (w.head<3>() / w[3] - k2.T_world_body.t).norm();
  Observation o;
  if (measure_observation(config_, map_, l, second.keyframe, second.camera, point.feature_second, &o) &&
      map_.add_observation(handle, o))
    return true;
  map_.remove_landmark(handle);
  return false;
}

std::size_t Mapper::count_landmarks(std::int32_t map_id) const {
  std::size_t count = 0;
  map_.landmarks().for_each([&](LandmarkHandle, const Landmark& l) {
    count += l.map_id == map_id && l.state != LandmarkState::kBearing ? 1U : 0U;
  });
  return count;
}

void Mapper::note_creation_sigmas(std::int32_t map_id) {
  map_.landmarks().for_each([&](LandmarkHandle, Landmark& l) {
    if (l.map_id == map_id)
      l.creation_relative_sigma = l.inverse_depth_sigma / std::max(l.inverse_depth, 1e-9);
  });
}

// -------------------------------------------------------------------------------------------------------------
// A keyframe

std::shared_ptr<const LocalView> Mapper::insert(const KeyframeRequest& request) {
  Sim3 S_world_reference;
  if (!map_.similarity_of(request.reference_id, &S_world_reference)) return nullptr;
  if (map_.keyframes().full())
    limit_memory(config_.capacity.window_images, keyframe_maker_.newest(), keyframe_maker_.newest_id(), &map_,
                 &counts_);
  const KeyframeHandle keyframe =
      keyframe_maker_.make(*request.frame, S_world_reference * request.T_reference_body, request.map_id);
  if (keyframe.is_null()) return nullptr;
  attach_sightings(keyframe, request);
  probation_.judge(keyframe_maker_.newest_id());
  map_.update_covisibility(keyframe);
  {
    // Tracking's view is some frames old: the map has landmarks on these corners that the view lacks.
    const StageSpan span(listener_, Stage::kFusing);
    duplicates_.search_neighbours_landmarks(keyframe);
  }
  map_.update_covisibility(keyframe);
  const StageSpan span(listener_, Stage::kTriangulation);
  make_landmarks(keyframe);
  map_.update_covisibility(keyframe);
  count_virtual_points();
  return make_view(keyframe);
}

void Mapper::attach_sightings(KeyframeHandle keyframe, const KeyframeRequest& request) {
  for (const Sighting& s : request.sightings) {
    if (!map_.landmarks().contains(s.landmark)) continue;
    const auto camera = static_cast<std::uint8_t>(s.camera);
    if (!map_.add_observation(s.landmark, {keyframe, s.feature, s.pixel, s.sigma_px, 0, camera})) continue;
    KeyframeView& view = map_.keyframes()[keyframe].views[camera];
    if (!view.has_corners()) {
      view.set.features[static_cast<std::size_t>(s.feature)].u_px = s.pixel.x();
      view.set.features[static_cast<std::size_t>(s.feature)].v_px = s.pixel.y();
    }
    landmark_maker_.reconsider(s.landmark);
  }
  for (const SightingCount& c : request.counts)
    if (Landmark* l = map_.landmarks().get(c.landmark)) l->visible += c.visible, l->found += c.found;
}

void Mapper::make_landmarks(KeyframeHandle keyframe) {
  const std::uint64_t made = counts_.landmarks_made;
  landmark_maker_.process(
      keyframe, neighbours_of(map_, keyframe, static_cast<std::size_t>(config_.mapping.neighbours)));
  if (metric_by_rig()) rig_depth_.measure(keyframe);
  landmark_maker_.evict_bearings(keyframe);
  if (counts_.landmarks_made > made) probation_.admit_made_at(keyframe);
}

void Mapper::count_virtual_points() {
  counts_.vmp_alive = 0;
  map_.landmarks().for_each([this](LandmarkHandle, const Landmark& l) {
    counts_.vmp_alive += l.state == LandmarkState::kBearing ? 1U : 0U;
  });
}

std::shared_ptr<const LocalView> Mapper::refine() {
  const KeyframeHandle newest = keyframe_maker_.newest();
  if (!map_.keyframes().contains(newest)) return nullptr;
  {
    const StageSpan span(listener_, Stage::kFusing);
    duplicates_.fuse_neighbourhood(newest);
  }
  map_.update_covisibility(newest);
  const bool optimised = optimise(newest, config_.mapping.iterations);
  // What bends the map would bend the calibration too.
  if (optimised && config_.calibration.refine) {
    if (metric_by_rig())
      refine_rig();
    else if (settling_.fits_well())
      refine_calibration();
  }
  if (optimised && motion_ != nullptr) judge_motion(newest);
  const StageSpan span(listener_, Stage::kCulling);
  forget(newest);
  map_.update_covisibility(newest);
  count_virtual_points();
  return make_view(newest);
}

bool Mapper::optimise(KeyframeHandle centre, int iterations) {
  const StageSpan span(listener_, Stage::kLocalBa);
  window_.build(centre, settling_.further_sigma_factor());
  BundleProblem& problem = window_.problem();
  if (problem.points.empty()) return false;
  if (motion_ != nullptr) motion_->add_to(map_, window_.pose_index(), settling_.judgement(), &problem);
  BundleOptions options;
  options.iterations = iterations;
  BundleSummary summary;
  if (config_.mapping.solve_instead != nullptr)
    config_.mapping.solve_instead(&options, &problem, &summary);
  else
    summary = solver_.solve(options, &problem);
  ++counts_.local_ba;
  if (!summary.usable) return false;
  const Soundness soundness = soundness_of(problem);
  const std::int64_t utime = map_.keyframes()[centre].utime;
  settling_.note_adjustment(soundness, window_.take_back(), counts_.calibration_contradicted, utime);
  return true;
}

void Mapper::judge_motion(KeyframeHandle newest) {
  const MotionVerdict verdict = motion_->judge(&map_, newest, settling_.judgement());
  if (verdict.metres_per_unit) {
    Sim3 to_metres;
    to_metres.scale = *verdict.metres_per_unit;
    const std::int32_t map_id = map_.keyframes()[newest].map_id;
    map_.transform(map_id, to_metres);
    if (!has_metre(map_id)) metric_maps_.push_back(map_id);
  }
  settling_.note_motion(verdict);
}

bool Mapper::has_metre(std::int32_t map_id) const {
  return std::binary_search(metric_maps_.begin(), metric_maps_.end(), map_id);
}

void Mapper::refine_calibration() {
  const StageSpan span(listener_, Stage::kCalibration);
  // Poses and depths are at their optimum for the present calibration: the residuals hold noise and the
  // calibration's error.
  const auto d_bearing = window_.bearing_derivatives(calibrator_.camera_index());
  if (calibrator_.update(window_.problem(), d_bearing))
    map_.set_camera(calibrator_.camera_index(), calibrator_.camera());
  counts_.calibration_contradicted = calibrator_.contradicts_given();
}

void Mapper::refine_rig() {
  const StageSpan span(listener_, Stage::kCalibration);
  const auto d_bearing = window_.bearing_derivatives(kRefinedCamera);
  const bool moved = rig_calibrator_->update(window_.problem(), d_bearing);
  counts_.calibration_contradicted = rig_calibrator_->contradicts_given();
  if (!moved) return;
  const Rig& rig = rig_calibrator_->rig();
  for (int c = 0; c < map_.camera_count(); ++c) {
    const RigCamera& camera = rig.cameras[static_cast<std::size_t>(c)];
    map_.set_camera(c, camera.camera);
    map_.place_camera(c, camera.T_body_camera);
  }
}

void Mapper::forget(KeyframeHandle newest) {
  const std::uint64_t id = keyframe_maker_.newest_id();
  cull_redundant_keyframes(
      neighbours_of(map_, newest, static_cast<std::size_t>(config_.mapping.window_keyframes)), id, &map_,
      &counts_);
  limit_memory(config_.capacity.window_images, newest, id, &map_, &counts_);
}

void Mapper::retire_map(std::int32_t map_id) {
  map_.keyframes().for_each([&](KeyframeHandle h, const Keyframe& k) {
    if (k.map_id == map_id) map_.thin_keyframe(h);
  });
}

}  // namespace farpoint::slam
