#include "slam/mapping/mapper.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "slam/image/descriptor_search.h"
#include "slam/map/predict.h"
#include "slam/mapping/forgetting.h"

namespace farpoint::slam {

namespace {

// A landmark on probation goes when it was found in fewer than this share of the frames that should have
// shown it.
constexpr double kMinFoundShare = 0.25;
constexpr std::uint64_t kProbation_keyframes = 3;
// After residuals that nothing explains, so many sound optimisations in a row before poses are called valid
// again, in a new map too: what bent the one is there in the other.
constexpr int kTrustedRun = 10;
// Keyframes of a view: the reference, its neighbours, and theirs.
constexpr std::size_t kViewNeighbours = 30, kViewSecondRing = 10, kViewSecondNeighbours = 5;
// Views in somebody's hands at once: the one tracking has, a quick and a full one on their way to it, one
// that frames are posed against, and the one being made.
constexpr std::size_t kViews = 5;

// All measurements of a landmark are of its one host patch, and share what is wrong with it: noise in its
// pixels, a surface that is not as flat as it was taken for. That part, so large (1 sigma), does not average
// out.
constexpr double kPatchSigma_px = 0.2;
// What shows no wide parallax is far away, or moves by itself in the seconds that it is seen: clouds drift by
// 1 to 2 mrad a second, a car ahead keeps its place in the image. In the whole of its measurements that looks
// like parallax, a hundred clouds look like a vehicle that is slower than it is, and the scale gave way to
// them by up to 4 %.
constexpr double kOwnMotion_rad = 0.003;

// n measurements of independent errors sigma and one common error s know their mean to sigma^2 / n + s^2: as
// much as n with this weight would, were they independent.
double shared_error_weight(const BundleProblem& problem, const BundleProblem::Point& point,
                           double shared_sigma_px) {
  double variance_px2 = 0.0;
  for (int i = 0; i < point.measurements; ++i) {
    const int index = point.first_measurement + i;
    const double sigma_px = problem.measurements[static_cast<std::size_t>(index)].sigma_px;
    variance_px2 += sigma_px * sigma_px;
  }
  variance_px2 /= point.measurements;
  return variance_px2 / (variance_px2 + point.measurements * shared_sigma_px * shared_sigma_px);
}

MapOptions map_options(const EstimatorConfig& config) {
  MapOptions options;
  options.wide_parallax_rad = config.landmarks.promote_parallax_rad;
  options.features = static_cast<std::size_t>(config.extractor.features);
  // Twice what is ever asked for: some of a list go with their keyframes before it is made anew.
  const int asked = std::max(config.mapping.neighbours, config.mapping.window_keyframes);
  options.covisible = 2 * std::max(kViewNeighbours, static_cast<std::size_t>(asked));
  return options;
}

std::shared_ptr<LocalView> roomy_view(const EstimatorConfig& config) {
  auto view = std::make_shared<LocalView>();
  view->landmarks.resize(static_cast<std::size_t>(config.capacity.view_landmarks));
  view->keyframes.resize(1 + kViewNeighbours + kViewSecondRing * kViewSecondNeighbours);
  view->landmarks.clear();
  view->keyframes.clear();
  return view;
}

}  // namespace

Mapper::Mapper(const EstimatorConfig& config, const Rig& rig)
    : config_(config),
      map_(config.capacity, rig, map_options(config)),
      views_(kViews, [&config] { return roomy_view(config); }),
      maker_(config_, &map_, &counts_),
      anchors_(static_cast<std::size_t>(config.capacity.keyframes)),
      calibrator_(config.calibration, rig.cameras.front().camera),
      sound_run_(kTrustedRun),
      solver_(static_cast<std::size_t>(config.mapping.window_landmarks),
              static_cast<std::size_t>(config.mapping.window_sightings)) {
  problem_.make_room(static_cast<std::size_t>(config.mapping.window_landmarks),
                     static_cast<std::size_t>(config.mapping.window_sightings));
  if (config.mapping.solver == "ceres" && config.mapping.solve_instead == nullptr)
    throw std::invalid_argument("mapping.solver: ceres: no solver was given with it");
  pose_index_.assign(static_cast<std::size_t>(config.capacity.keyframes), -1);
}

KeyframeHandle Mapper::make_keyframe(const Frame& frame, const SE3& T_world_body, std::int32_t map_id) {
  Keyframe k = map_.roomy_keyframe();
  k.map_id = map_id;
  k.utime = frame.utime;
  k.frame_number = frame.number;
  k.camera = frame.camera;
  k.T_world_body = T_world_body;
  k.set = frame.set;
  k.grid = frame.grid;
  k.image = frame.image;
  const Camera& camera = map_.rig().cameras[static_cast<std::size_t>(frame.camera)].camera;
  k.bearings.clear();
  k.bearings.reserve(k.set.features.size());
  for (const Feature& f : k.set.features) {
    Eigen::Vector3d b = Eigen::Vector3d::UnitZ();
    // A corner without a ray (outside the lens circle) keeps a bearing that no epipolar search will match.
    if (!camera.unproject({f.u_px, f.v_px}, &b)) b = -Eigen::Vector3d::UnitZ();
    k.bearings.emplace_back(b.cast<float>());
  }
  const KeyframeHandle handle = map_.add_keyframe(std::move(k));
  if (!handle.is_null()) {
    ++counts_.keyframes_made;
    newest_ = handle;
    newest_id_ = map_.keyframes()[handle].id;
  }
  return handle;
}

std::shared_ptr<const LocalView> Mapper::start_map(const InitialPair& pair, std::int32_t map_id) {
  settled_ = false;
  steady_optimisations_ = 0;
  soundness_ = {};
  recent_.clear();
  const KeyframeHandle first = make_keyframe(*pair.first, SE3{}, map_id);
  const KeyframeHandle second = make_keyframe(*pair.second, pair.T_first_second, map_id);
  if (first.is_null() || second.is_null()) {
    map_.discard_map(map_id);
    return nullptr;
  }
  const Keyframe& k2 = map_.keyframes()[second];
  for (const InitialPoint& p : pair.points) {
    const LandmarkHandle handle = map_.add_landmark(first, p.feature_first);
    if (handle.is_null()) continue;
    Landmark& l = map_.landmarks()[handle];
    l.inverse_depth = p.inverse_depth;
    l.state = LandmarkState::kFull;
    l.created_keyframe = k2.id;
    l.created_utime = k2.utime;
    const Eigen::Vector4d w = map_.world_point(l);
    l.creation_depth = (w.head<3>() / w[3] - k2.T_world_body.t).norm();
    Observation o;
    if (!measure_observation(config_, map_, l, second, p.feature_second, &o)) {
      map_.remove_landmark(handle);
      continue;
    }
    if (!map_.add_observation(handle, o))
      map_.remove_landmark(handle);
    else
      ++counts_.landmarks_made;
  }
  map_.update_covisibility(second);
  static_cast<void>(optimise(second, 20));
  std::size_t alive = 0;
  map_.landmarks().for_each(
      [&](LandmarkHandle, const Landmark& l) { alive += l.map_id == map_id ? 1U : 0U; });
  if (alive < static_cast<std::size_t>(config_.initialisation.min_landmarks) / 2) {
    map_.discard_map(map_id);
    return nullptr;
  }
  map_.landmarks().for_each([&](LandmarkHandle, Landmark& l) {
    if (l.map_id == map_id)
      l.creation_relative_sigma = l.inverse_depth_sigma / std::max(l.inverse_depth, 1e-9);
  });
  return make_view(second);
}

std::vector<KeyframeHandle> Mapper::neighbours(KeyframeHandle keyframe, std::size_t limit) const {
  std::vector<KeyframeHandle> out;
  for (const Covisible& c : map_.keyframes()[keyframe].covisible) {
    if (out.size() == limit) break;
    out.push_back(c.keyframe);
  }
  return out;
}

void Mapper::attach_sightings(KeyframeHandle keyframe, const KeyframeRequest& request) {
  for (const Sighting& s : request.sightings) {
    if (!map_.landmarks().contains(s.landmark)) continue;
    if (map_.add_observation(s.landmark, {keyframe, s.feature, s.pixel, s.sigma_px}))
      maker_.reconsider(s.landmark);
  }
  for (const SightingCount& c : request.counts)
    if (Landmark* l = map_.landmarks().get(c.landmark)) l->visible += c.visible, l->found += c.found;
}

void Mapper::cull_recent_landmarks() {
  std::vector<LandmarkHandle> keep;
  for (const LandmarkHandle& h : recent_) {
    Landmark* l = map_.landmarks().get(h);
    if (l == nullptr || l->state == LandmarkState::kBearing) continue;
    const std::uint64_t age = newest_id_ - std::min(newest_id_, l->created_keyframe);
    const bool rarely_found = l->found < kMinFoundShare * l->visible;
    const bool forgotten = age >= 2 && l->observations.size() <= 2;
    if (rarely_found || forgotten) {
      map_.remove_landmark(h);
      ++counts_.landmarks_culled;
    } else if (age < kProbation_keyframes) {
      keep.push_back(h);
    } else {
      l->state = LandmarkState::kFull;
    }
  }
  recent_.swap(keep);
}

std::shared_ptr<const LocalView> Mapper::insert(const KeyframeRequest& request) {
  SE3 T_world_reference;
  if (!map_.pose_of(request.reference_id, &T_world_reference)) return nullptr;
  if (map_.keyframes().full())
    limit_memory(config_.capacity.window_images, newest_, newest_id_, &map_, &counts_);
  const KeyframeHandle keyframe =
      make_keyframe(*request.frame, T_world_reference * request.T_reference_body, request.map_id);
  if (keyframe.is_null()) return nullptr;
  attach_sightings(keyframe, request);
  cull_recent_landmarks();
  map_.update_covisibility(keyframe);
  {
    // What tracking saw was a view some frames old: the map of today may know more of these corners already.
    const StageSpan span(listener_, Stage::kFusing);
    search_neighbours_landmarks(keyframe);
  }
  map_.update_covisibility(keyframe);

  const StageSpan span(listener_, Stage::kTriangulation);
  const std::uint64_t first_new = counts_.landmarks_made;
  maker_.process(keyframe, neighbours(keyframe, static_cast<std::size_t>(config_.mapping.neighbours)));
  maker_.evict_bearings(keyframe);
  if (counts_.landmarks_made > first_new) {
    const std::uint64_t id = map_.keyframes()[keyframe].id;
    for (const LandmarkHandle& h : map_.keyframes()[keyframe].landmarks) {
      const Landmark* l = map_.landmarks().get(h);
      if (l != nullptr && l->state != LandmarkState::kBearing && l->created_keyframe == id)
        recent_.push_back(h);
    }
  }
  map_.update_covisibility(keyframe);
  count_virtual_points();
  return make_view(keyframe);
}

std::shared_ptr<const LocalView> Mapper::refine() {
  if (!map_.keyframes().contains(newest_)) return nullptr;
  {
    const StageSpan span(listener_, Stage::kFusing);
    fuse_neighbourhood(newest_);
  }
  map_.update_covisibility(newest_);
  const bool optimised = optimise(newest_, config_.mapping.iterations);
  // What bends the map would bend the calibration too.
  if (optimised && config_.calibration.refine && soundness_.fits_well(settled_)) refine_calibration();
  const StageSpan span(listener_, Stage::kCulling);
  cull_redundant_keyframes(neighbours(newest_, static_cast<std::size_t>(config_.mapping.window_keyframes)),
                           newest_id_, &map_, &counts_);
  limit_memory(config_.capacity.window_images, newest_, newest_id_, &map_, &counts_);
  map_.update_covisibility(newest_);
  count_virtual_points();
  return make_view(newest_);
}

void Mapper::count_virtual_points() {
  counts_.vmp_alive = 0;
  map_.landmarks().for_each([this](LandmarkHandle, const Landmark& l) {
    counts_.vmp_alive += l.state == LandmarkState::kBearing ? 1U : 0U;
  });
}

// ----------------------------------------------------------------------------------------------------
// duplicates

void Mapper::fuse(LandmarkHandle into, LandmarkHandle from) {
  // The other's measurements are of the other's patch: each is made anew with the patch that stays.
  const auto theirs = map_.landmarks()[from].observations;
  const std::uint32_t found = map_.landmarks()[from].found, visible = map_.landmarks()[from].visible;
  map_.remove_landmark(from);
  Landmark& l = map_.landmarks()[into];
  for (const Observation& o : theirs) {
    Observation measured;
    if (Map::find_observation(l, o.keyframe) == nullptr &&
        measure_observation(config_, map_, l, o.keyframe, static_cast<std::size_t>(o.feature), &measured))
      map_.add_observation(into, measured);
  }
  l.found += found;
  l.visible += visible;
  ++counts_.landmarks_fused;
}

void Mapper::search_into(KeyframeHandle handle, const std::vector<LandmarkHandle>& landmarks) {
  Keyframe& keyframe = map_.keyframes()[handle];
  if (!keyframe.image) return;  // thinned: it has no corners left to be matched
  const Camera& camera = map_.rig().cameras[static_cast<std::size_t>(keyframe.camera)].camera;
  const Predictor predictor(camera, map_.T_world_camera(keyframe).inverse());
  const double scale_factor = config_.pyramid.scale_factor;
  anchors_.forget();
  for (const LandmarkHandle& lh : landmarks) {
    const Landmark* l = map_.landmarks().get(lh);
    if (l == nullptr || l->state == LandmarkState::kBearing || Map::find_observation(*l, handle) != nullptr)
      continue;
    Prediction p;
    if (!predictor.predict(anchors_.prediction_input(map_, *l), 4.0, &p) || p.view_cosine < 0.5) continue;
    if (p.scale_change < 0.3F || p.scale_change > 3.3F) continue;
    const int level = predicted_level(l->host_level, p.scale_change, static_cast<float>(scale_factor),
                                      config_.pyramid.levels);
    DescriptorQuery q;
    q.descriptor = l->descriptor;
    q.u_px = static_cast<float>(p.pixel.x());
    q.v_px = static_cast<float>(p.pixel.y());
    q.radius_px = static_cast<float>(3.0 * std::pow(scale_factor, level));
    q.min_level = level - 1;
    q.max_level = level + 1;
    q.max_hamming = config_.tracking.max_hamming * 3 / 4;
    q.ratio = 1.0F;
    const int feature = find_descriptor(keyframe.set, keyframe.grid, q, [](std::size_t) { return true; });
    if (feature < 0) continue;
    const auto fi = static_cast<std::size_t>(feature);
    const LandmarkHandle owner = keyframe.landmarks[fi];
    const Landmark* other = map_.landmarks().get(owner);
    if (other != nullptr && other->state != LandmarkState::kBearing) {
      // Two landmarks, one corner: the one with more sightings takes the other in.
      if (other->observations.size() > l->observations.size())
        fuse(owner, lh);
      else
        fuse(lh, owner);
      continue;
    }
    Observation o;
    if (!measure_observation(config_, map_, *l, handle, fi, &o)) continue;
    // A virtual point on the same corner has become superfluous.
    if (other != nullptr) map_.remove_landmark(owner);
    map_.add_observation(lh, o);
  }
}

void Mapper::fuse_neighbourhood(KeyframeHandle keyframe) {
  const std::vector<LandmarkHandle> own = map_.keyframes()[keyframe].landmarks;
  for (const KeyframeHandle& n : neighbours(keyframe, static_cast<std::size_t>(config_.mapping.neighbours)))
    search_into(n, own);
  search_neighbours_landmarks(keyframe);
}

void Mapper::search_neighbours_landmarks(KeyframeHandle keyframe) {
  std::vector<LandmarkHandle> theirs;
  std::vector<std::uint8_t> taken(map_.landmarks().capacity(), 0);
  for (const KeyframeHandle& n : neighbours(keyframe, static_cast<std::size_t>(config_.mapping.neighbours)))
    for (const LandmarkHandle& h : map_.keyframes()[n].landmarks)
      // What is taken already needs no look at its slot, which lies far away in memory.
      if (!h.is_null() && taken[h.index] == 0 && map_.landmarks().contains(h)) {
        taken[h.index] = 1;
        theirs.push_back(h);
      }
  search_into(keyframe, theirs);
}

// ------------------------------------------------------------------------------------------------------
// local BA

bool Mapper::guides_tracking(const Landmark& landmark) const {
  // A virtual point's inverse depth is known within its sigma, and that is how tracking takes it (the
  // residual's covariance): it says something about rotation. (ours; the paper uses virtual points once they
  // are points.) Two sightings agree with any mismatch along the line.
  if (landmark.state != LandmarkState::kBearing) return true;
  return landmark.failures == 0 &&
         static_cast<int>(landmark.observations.size()) >= config_.landmarks.bearing_observations;
}

void Mapper::select_window(KeyframeHandle centre) {
  window_.assign(1, centre);
  const auto limit = static_cast<std::size_t>(config_.mapping.window_keyframes);
  for (const Covisible& c : map_.keyframes()[centre].covisible) {
    if (window_.size() >= limit) break;
    window_.push_back(c.keyframe);
  }
}

void Mapper::build_problem() {
  problem_.clear();
  problem_.rig = &map_.rig();
  problem_landmarks_.clear();
  fixed_.clear();
  std::fill(pose_index_.begin(), pose_index_.end(), -1);
  for (const KeyframeHandle& h : window_) {
    pose_index_[h.index] = static_cast<int>(problem_.poses.size());
    problem_.poses.push_back({map_.keyframes()[h].T_world_body, false});
  }
  // Landmarks of the window, in the order of its keyframes.
  std::vector<std::uint8_t> taken(map_.landmarks().capacity(), 0);
  for (const KeyframeHandle& h : window_)
    for (const LandmarkHandle& lh : map_.keyframes()[h].landmarks) {
      const Landmark* l = map_.landmarks().get(lh);
      // Virtual points stay outside, as in the paper: here all that moves together by itself would be taken
      // for one motion of the vehicle. On rendered motorways under drifting clouds they doubled the error.
      if (l == nullptr || l->state == LandmarkState::kBearing || taken[lh.index] != 0) continue;
      if (problem_landmarks_.size() >= static_cast<std::size_t>(config_.mapping.window_landmarks)) break;
      taken[lh.index] = 1;
      problem_landmarks_.push_back(lh);
    }
  // Historical observers: those that see most, hosts before all (without its host a landmark has no place).
  std::vector<int> uses(map_.keyframes().capacity(), 0);
  for (const LandmarkHandle& lh : problem_landmarks_) {
    const Landmark& l = map_.landmarks()[lh];
    if (pose_index_[l.host.index] < 0) uses[l.host.index] += 1000;
    for (const Observation& o : l.observations)
      if (pose_index_[o.keyframe.index] < 0) ++uses[o.keyframe.index];
  }
  std::vector<KeyframeHandle> outside;
  map_.keyframes().for_each([&](KeyframeHandle h, const Keyframe&) {
    if (uses[h.index] > 0) outside.push_back(h);
  });
  std::stable_sort(outside.begin(), outside.end(),
                   [&](KeyframeHandle a, KeyframeHandle b) { return uses[a.index] > uses[b.index]; });
  if (outside.size() > static_cast<std::size_t>(config_.mapping.fixed_keyframes))
    outside.resize(static_cast<std::size_t>(config_.mapping.fixed_keyframes));
  for (const KeyframeHandle& h : outside) {
    pose_index_[h.index] = static_cast<int>(problem_.poses.size());
    problem_.poses.push_back({map_.keyframes()[h].T_world_body, true});
    fixed_.push_back(h);
  }
  // A young map has no history: its oldest keyframe holds the gauge.
  if (fixed_.empty()) {
    std::size_t oldest = 0;
    for (std::size_t i = 1; i < window_.size(); ++i)
      if (map_.keyframes()[window_[i]].id < map_.keyframes()[window_[oldest]].id) oldest = i;
    problem_.poses[oldest].fixed = true;
  }
  std::size_t kept = 0;
  for (const LandmarkHandle& lh : problem_landmarks_) {
    const Landmark& l = map_.landmarks()[lh];
    if (pose_index_[l.host.index] < 0) continue;
    if (problem_.measurements.size() + l.observations.size() >
        static_cast<std::size_t>(config_.mapping.window_sightings))
      break;
    BundleProblem::Point point;
    point.host = pose_index_[l.host.index];
    point.T_host_anchor = l.T_host_anchor;
    point.bearing = l.bearing;
    point.inverse_depth = l.inverse_depth;
    point.first_measurement = static_cast<int>(problem_.measurements.size());
    for (const Observation& o : l.observations) {
      if (o.sigma_px <= 0.0F || pose_index_[o.keyframe.index] < 0) continue;
      BundleProblem::Measurement m;
      m.pose = pose_index_[o.keyframe.index];
      m.camera = map_.keyframes()[o.keyframe].camera;
      m.pixel = o.pixel.cast<double>();
      m.sigma_px = o.sigma_px;
      problem_.measurements.push_back(m);
    }
    point.measurements = static_cast<int>(problem_.measurements.size()) - point.first_measurement;
    if (point.measurements == 0) continue;
    const double own_motion_px =
        kOwnMotion_rad * map_.rig().cameras[static_cast<std::size_t>(l.host_camera)].camera.focal_px();
    point.weight = shared_error_weight(problem_, point, map_.is_wide(l) ? kPatchSigma_px : own_motion_px);
    problem_.points.push_back(point);
    problem_landmarks_[kept++] = lh;
  }
  problem_landmarks_.resize(kept);
}

bool Mapper::optimise(KeyframeHandle centre, int iterations) {
  const StageSpan span(listener_, Stage::kLocalBa);
  select_window(centre);
  build_problem();
  if (problem_.points.empty()) return false;
  BundleOptions options;
  options.iterations = iterations;
  BundleSummary summary;
  if (config_.mapping.solve_instead != nullptr)
    config_.mapping.solve_instead(&options, &problem_, &summary);
  else
    summary = solver_.solve(options, &problem_);
  ++counts_.local_ba;
  if (!summary.usable) return false;
  soundness_ = soundness_of(problem_);
  take_back();
  return true;
}

void Mapper::refine_calibration() {
  const StageSpan span(listener_, Stage::kCalibration);
  // Poses and depths are at their optimum for the present calibration: what is left in the residuals is
  // noise, or a calibration that is not quite right.
  std::vector<Eigen::Matrix<double, 3, 2>> d_bearing(problem_.points.size(),
                                                     Eigen::Matrix<double, 3, 2>::Zero());
  for (std::size_t i = 0; i < problem_.points.size(); ++i) {
    if (const Landmark* l = map_.landmarks().get(problem_landmarks_[i]))
      d_bearing[i] = l->d_bearing_d_pixel;
    else
      problem_.points[i].measurements = 0;  // found wrong since: it has no say
  }
  if (calibrator_.update(problem_, d_bearing)) map_.set_camera(0, calibrator_.camera());
  counts_.calibration_contradicted = calibrator_.contradicts_given();
}

void Mapper::take_back() {
  for (std::size_t i = 0; i < window_.size(); ++i) {
    Keyframe& k = map_.keyframes()[window_[i]];
    if (problem_.poses[i].fixed) continue;
    k.T_world_body = problem_.poses[i].T_world_body;
    ++k.optimised;
  }
  std::vector<double> changes;
  std::vector<KeyframeHandle> outliers;
  for (std::size_t i = 0; i < problem_.points.size(); ++i) {
    const BundleProblem::Point& point = problem_.points[i];
    const LandmarkHandle lh = problem_landmarks_[i];
    Landmark& l = map_.landmarks()[lh];
    if (l.inverse_depth > 0.0 && point.inverse_depth > 0.0)
      changes.push_back(point.inverse_depth / l.inverse_depth);
    l.inverse_depth = point.inverse_depth;
    l.inverse_depth_sigma = point.inverse_depth_sigma;
    outliers.clear();
    int index = point.first_measurement;
    for (const Observation& o : l.observations) {
      if (o.sigma_px <= 0.0F || pose_index_[o.keyframe.index] < 0) continue;
      const auto& m = problem_.measurements[static_cast<std::size_t>(index++)];
      if (m.chi2 > kChi2TwoDof) outliers.push_back(o.keyframe);
    }
    bool alive = true;
    for (const KeyframeHandle& k : outliers) alive = alive && map_.remove_observation(lh, k);
    if (!alive) ++counts_.landmarks_culled;
  }
  if (changes.empty()) return;
  const auto middle = changes.begin() + static_cast<std::ptrdiff_t>(changes.size() / 2);
  std::nth_element(changes.begin(), middle, changes.end());
  update_settling(*middle);
}

void Mapper::update_settling(double scale_change) {
  // The unit of a young map follows its first baseline, which is known worst of all. It has settled when
  // three optimisations in a row moved it by less than two per cent each, and left residuals that the
  // measurements' errors explain.
  constexpr double kSteady = 0.02;
  constexpr int kSteadyOptimisations = 3;
  const bool steady = std::fabs(std::log(scale_change)) < kSteady;
  if (!soundness_.holds(settled_) || calibrator_.contradicts_given()) {
    // Rolling shutter under fast rotation, a moving scene, a wrong calibration: the map bends to fit and its
    // poses are not what they claim, however many inliers they have.
    settled_ = false;
    steady_optimisations_ = 0;
    sound_run_ = 0;
    return;
  }
  sound_run_ = std::min(sound_run_ + 1, kTrustedRun);
  steady_optimisations_ = steady ? steady_optimisations_ + 1 : 0;
  if (steady_optimisations_ >= kSteadyOptimisations && sound_run_ == kTrustedRun) settled_ = true;
}

void Mapper::retire_map(std::int32_t map_id) {
  map_.keyframes().for_each([&](KeyframeHandle h, const Keyframe& k) {
    if (k.map_id == map_id) map_.thin_keyframe(h);
  });
}

// -------------------------------------------------------------------------------------------------------------
// view

std::size_t Mapper::view_bytes() const {
  const LocalView& view = views_.sample();
  return views_.capacity() * (sizeof(LocalView) + view.landmarks.capacity() * sizeof(ViewLandmark) +
                              view.keyframes.capacity() * sizeof(ViewKeyframe));
}

std::shared_ptr<const LocalView> Mapper::make_view(KeyframeHandle reference) {
  const std::shared_ptr<LocalView> view = views_.take();
  if (!view) return view;
  view->keyframes.clear();
  view->landmarks.clear();
  view->reference_landmarks = 0;
  view->reference_nearness = 0.0;
  view->map_keyframes = 0;
  view->median_depth = LocalView{}.median_depth;
  const Keyframe& centre = map_.keyframes()[reference];
  view->sequence = ++view_sequence_;
  view->map_id = centre.map_id;
  view->reference_id = centre.id;
  view->T_world_reference = centre.T_world_body;
  view->settled = settled_;
  view->rig = map_.rig();
  std::vector<KeyframeHandle> members{reference};
  std::vector<std::uint8_t> member(map_.keyframes().capacity(), 0);
  member[reference.index] = 1;
  const auto add = [&](KeyframeHandle h) {
    if (member[h.index] != 0) return;
    member[h.index] = 1;
    members.push_back(h);
  };
  for (const KeyframeHandle& h : neighbours(reference, kViewNeighbours)) add(h);
  // The neighbours' neighbours: what the vehicle saw before a turn comes back into view after it.
  for (std::size_t i = 1, n = std::min(members.size(), kViewSecondRing); i < n; ++i)
    for (const KeyframeHandle& h : neighbours(members[i], kViewSecondNeighbours)) add(h);

  std::vector<std::uint8_t> taken(map_.landmarks().capacity(), 0);
  std::vector<double> depths;
  anchors_.forget();
  view->landmarks.reserve(last_view_landmarks_ + last_view_landmarks_ / 4);
  const SE3 T_reference_world = map_.T_world_camera(centre).inverse();
  for (const KeyframeHandle& h : members) {
    const Keyframe& k = map_.keyframes()[h];
    view->keyframes.push_back({k.id, k.T_world_body});
    for (const LandmarkHandle& lh : k.landmarks) {
      const Landmark* l = map_.landmarks().get(lh);
      if (l == nullptr || !guides_tracking(*l) || taken[lh.index] != 0) continue;
      // Nearest keyframes first: what does not fit is what is seen least.
      if (view->landmarks.size() == static_cast<std::size_t>(config_.capacity.view_landmarks)) break;
      taken[lh.index] = 1;
      ViewLandmark v;
      v.handle = lh;
      const PredictionInput in = anchors_.prediction_input(map_, *l);
      v.point_w = in.point_w;
      v.anchor_w = in.anchor_w;
      v.d_point_d_pixel = in.d_point_d_pixel;
      v.inverse_depth_sigma = l->inverse_depth_sigma;
      v.descriptor = l->descriptor;
      v.patch = l->patch;
      v.host_level = l->host_level;
      v.in_reference = h == reference;
      v.confirmed = l->state == LandmarkState::kFull ||
                    (l->state == LandmarkState::kWeak && l->observations.size() > 2);
      if (v.in_reference) {
        const double d =
            (T_reference_world.q * v.point_w.head<3>() + v.point_w[3] * T_reference_world.t).norm();
        v.nearness = v.point_w[3] / std::max(d, 1e-9);
        if (v.confirmed) {
          ++view->reference_landmarks;
          view->reference_nearness += v.nearness;
        }
        depths.push_back(d / std::max(v.point_w[3], 1e-9));
      }
      view->landmarks.push_back(v);
    }
  }
  last_view_landmarks_ = view->landmarks.size();
  std::sort(view->keyframes.begin(), view->keyframes.end(),
            [](const ViewKeyframe& a, const ViewKeyframe& b) { return a.id < b.id; });
  map_.keyframes().for_each(
      [&](KeyframeHandle, const Keyframe& k) { view->map_keyframes += k.map_id == centre.map_id; });
  if (!depths.empty()) {
    const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
    std::nth_element(depths.begin(), middle, depths.end());
    view->median_depth = *middle;
  }
  return view;
}

}  // namespace farpoint::slam
