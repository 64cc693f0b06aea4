#include "slam/estimator.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <deque>
#include <stdexcept>

#include "slam/image/extractor.h"
#include "slam/image/pyramid.h"
#include "slam/mapping/mapper.h"
#include "slam/tracking/initialiser.h"
#include "slam/tracking/keyframe_policy.h"
#include "slam/tracking/tracker.h"

namespace farpoint::slam {

const char* to_string(State state) {
  switch (state) {
    case State::kStarting:
      return "starting";
    case State::kInitialising:
      return "initialising";
    case State::kSettling:
      return "settling";
    case State::kTracking:
      return "tracking";
    case State::kDegraded:
      return "degraded";
    case State::kLost:
      return "lost";
    case State::kRelocalising:
      return "relocalising";
    case State::kNoCamera:
      return "no_camera";
  }
  return "unknown";
}

namespace {

// A pyramid with its FrameImage face, handed out again once nobody holds it.
struct PyramidFrame final : FrameImage {
  PyramidFrame(int width_px, int height_px, const PyramidOptions& options)
      : pyramid(width_px, height_px, options), image(&pyramid) {}
  [[nodiscard]] bool extract_patch(const FeatureSet& set, std::size_t index, Patch* patch) const override {
    return image.extract_patch(set, index, patch);
  }
  [[nodiscard]] Alignment align(const Patch& host, const Eigen::Matrix2f& A,
                                const Eigen::Vector2f& predicted_px, float max_shift_px) const override {
    return image.align(host, A, predicted_px, max_shift_px);
  }
  Pyramid pyramid;
  PyramidImage image;
};

class PyramidPool {
 public:
  PyramidPool(int width_px, int height_px, const PyramidOptions& options)
      : width_px_(width_px), height_px_(height_px), options_(options) {}
  std::shared_ptr<PyramidFrame> take() {
    for (const auto& p : all_)
      if (p.use_count() == 1) return p;
    all_.push_back(std::make_shared<PyramidFrame>(width_px_, height_px_, options_));
    return all_.back();
  }
  [[nodiscard]] std::size_t bytes() const {
    return all_.empty() ? 0 : all_.size() * all_.front()->pyramid.bytes();
  }

 private:
  int width_px_, height_px_;
  PyramidOptions options_;
  std::vector<std::shared_ptr<PyramidFrame>> all_;
};

// Where a frame was, relative to a keyframe, so that it follows the keyframe through every later
// optimisation.
struct RecordedFrame {
  std::int64_t utime = 0;
  std::int32_t map_id = 0;
  std::uint64_t reference_id = 0;
  SE3 T_reference_body;
};

struct PendingView {
  std::uint64_t due_frame = 0;
  std::shared_ptr<const LocalView> view;
};

// A pose that a third of the matched landmarks contradict is published, but not as valid. Rigid scenes show
// 0.7 and more.
constexpr double kMinAgreement = 0.65;
// Frames of trying to find the way back before a new map is begun.
constexpr int kRelocalisationFrames = 15;
// A map this young is dropped rather than kept when it is lost: its unit has not settled.
constexpr int kYoungMapKeyframes = 5;

Rig usable_rig(const Rig& rig) {
  if (rig.cameras.empty())
    throw std::invalid_argument("rig: no camera; at least one calibrated camera is needed");
  Rig out = rig;
  for (const RigCamera& c : out.cameras)
    if (const std::string why = Camera::check(c.camera.parameters()); !why.empty())
      throw std::invalid_argument("camera '" + c.name + "': " + why);
  // The lever arm is in metres and the map is not (config.h).
  const Eigen::Vector3d origin = out.cameras.front().T_body_camera.t;
  for (RigCamera& c : out.cameras) c.T_body_camera.t -= origin;
  return out;
}

}  // namespace

struct Estimator::Impl {
  Impl(const EstimatorConfig& c, const Rig& r)
      : config(c),
        rig(usable_rig(r)),
        camera(rig.cameras.front().camera),
        extractor(camera.width_px(), camera.height_px(), config.pyramid, config.extractor),
        pyramids(camera.width_px(), camera.height_px(), config.pyramid),
        initialiser(config, rig),
        tracker(config),
        mapper(config, rig) {}

  const EstimatorConfig config;
  const Rig rig;
  const Camera& camera;
  Extractor extractor;
  PyramidPool pyramids;
  Initialiser initialiser;
  Tracker tracker;
  Mapper mapper;

  State state = State::kInitialising;
  EstimatorCounts counts;
  FrameResult result;
  std::uint64_t frame_number = 0;
  std::int64_t last_utime = 0;
  bool any_frame = false;

  std::int32_t map_id = 0;
  std::deque<PendingView> pending;
  std::uint64_t mapping_busy_until = 0;  // frame number at which mapping has nothing left to do
  int frames_since_keyframe = 0;
  int lost_frames = 0;
  bool settled = false;
  std::vector<std::shared_ptr<Frame>>
      waiting;  // frames before initialisation, posed once the map has settled
  std::vector<RecordedFrame> recorded;

  // odom: integrates relative motion in the present unit.
  SE3 T_odom_body;
  SE3 T_map_body_last;
  bool has_last = false;
  std::uint32_t resets = 0;
  StageListener* listener = nullptr;

  std::shared_ptr<Frame> new_frame(std::int64_t utime, std::int64_t sequence, int camera_index) {
    auto frame = std::make_shared<Frame>();
    frame->number = frame_number++;
    frame->utime = utime;
    frame->sequence = sequence;
    frame->camera = camera_index;
    return frame;
  }

  bool acceptable(std::int64_t utime, int camera_index) {
    const bool ok = camera_index == 0 && (!any_frame || utime > last_utime);
    if (!ok) {
      ++counts.frames_rejected;
      result.has_pose = false;
      result.utime = utime;
      return false;
    }
    any_frame = true;
    last_utime = utime;
    return true;
  }

  void index_features(Frame* frame) {
    constexpr int kGridCell_px = 24;
    frame->grid =
        FeatureGrid(camera.width_px(), camera.height_px(), kGridCell_px, frame->set.features.size());
    frame->grid.build(frame->set.features);
  }

  const FrameResult& step(const std::shared_ptr<Frame>& frame) {
    ++counts.frames;
    result = FrameResult{};
    result.utime = frame->utime;
    result.sequence = frame->sequence;
    result.features = static_cast<int>(frame->set.features.size());
    deliver_views(frame->number);
    if (state == State::kInitialising)
      initialise(frame);
    else
      follow(frame);
    result.state = state;
    result.map_id = map_id;
    result.reset_counter = resets;
    publish_counts();
    return result;
  }

  void deliver_views(std::uint64_t now) {
    while (!pending.empty() && pending.front().due_frame <= now) {
      if (pending.front().view && pending.front().view->map_id == map_id) {
        const SE3 before = tracker.T_world_body();
        const bool first = tracker.view() == nullptr;
        tracker.set_view(pending.front().view);
        settled = tracker.view()->settled;
        // The pose moved with its keyframe: the jump belongs to map_from_odom, not to odom.
        if (has_last && !first)
          T_map_body_last = tracker.T_world_body() * (before.inverse() * T_map_body_last);
      }
      pending.pop_front();
    }
  }

  // --- initialising
  // --------------------------------------------------------------------------------------------
  void initialise(const std::shared_ptr<Frame>& frame) {
    const std::optional<InitialPair> pair = initialiser.add(frame);
    result.matches = initialiser.last_matches();
    if (!pair) return;
    std::shared_ptr<const LocalView> view;
    {
      const StagePause pause(listener, Stage::kTracking);
      const StageSpan mapping(listener, Stage::kMapping);
      view = mapper.start_map(*pair, map_id + 1);
    }
    if (!view) return;
    ++map_id;
    ++counts.maps;
    ++resets;
    settled = false;
    lost_frames = 0;
    frames_since_keyframe = 0;
    tracker.start(view->T_world_reference, frame->utime);
    tracker.set_view(view);
    mapping_busy_until = frame->number + static_cast<std::uint64_t>(config.mapping.quick_view_delay_frames);
    waiting.assign(initialiser.history().begin(), initialiser.history().end());
    std::erase_if(waiting, [&](const auto& f) { return f == pair->first || f == pair->second; });
    for (const auto& f : waiting) f->image.reset();
    recorded.push_back({pair->first->utime, map_id, view->keyframes.front().id, SE3{}});
    record(*frame, view->T_world_reference);
    initialiser.clear();
    state = State::kSettling;
    fill_pose(*frame, view->T_world_reference, Matrix6d::Zero());
  }

  // --- tracking
  // ------------------------------------------------------------------------------------------------
  void follow(const std::shared_ptr<Frame>& frame) {
    const bool was_lost = state == State::kLost || state == State::kRelocalising;
    TrackOutcome outcome = was_lost ? tracker.relocalise(*frame) : tracker.track(*frame);
    result.view_sequence = tracker.view() != nullptr ? tracker.view()->sequence : 0;
    result.matches = outcome.matches;
    result.inliers = outcome.inliers;
    result.aligned = outcome.aligned;
    if (!outcome.ok || outcome.inliers < config.tracking.min_inliers) {
      lose(frame);
      return;
    }
    lost_frames = 0;
    tracker.accept(*frame, outcome, !was_lost);
    record(*frame, outcome.T_world_body);
    ++frames_since_keyframe;
    maybe_keyframe(frame, outcome);
    if (settled && !waiting.empty()) pose_waiting();
    const bool agreed = outcome.inliers >= kMinAgreement * outcome.matches;
    if (!settled || !agreed)
      state = State::kSettling;
    else
      state = outcome.inliers < config.tracking.degraded_inliers ? State::kDegraded : State::kTracking;
    fill_pose(*frame, outcome.T_world_body, outcome.covariance);
    const double share = static_cast<double>(outcome.inliers) / std::max(1, outcome.matches);
    result.quality = is_valid(state) ? static_cast<int>(std::lround(100.0 * share)) : -1;
  }

  void lose(const std::shared_ptr<Frame>& frame) {
    if (state != State::kLost && state != State::kRelocalising) ++counts.lost;
    has_last = false;
    ++lost_frames;
    const int keyframes = tracker.view() != nullptr ? tracker.view()->map_keyframes : 0;
    const bool young = !settled || keyframes < kYoungMapKeyframes;
    state = lost_frames == 1 ? State::kLost : State::kRelocalising;
    if (!young && lost_frames <= kRelocalisationFrames) return;
    // Begin anew, beside the old map where that is worth keeping.
    if (young) {
      std::erase_if(recorded, [&](const RecordedFrame& r) { return r.map_id == map_id; });
      mapper.discard_map(map_id);
    }
    pending.clear();
    mapping_busy_until = 0;
    waiting.clear();
    initialiser.clear();
    state = State::kInitialising;
    (void)initialiser.add(frame);
  }

  void maybe_keyframe(const std::shared_ptr<Frame>& frame, const TrackOutcome& outcome) {
    const StageSpan span(listener, Stage::kKeyframe);
    const KeyframeSituation situation{frames_since_keyframe, mapping_busy_until <= frame->number};
    if (!wants_keyframe(config, *tracker.view(), outcome, situation)) return;
    KeyframeRequest request;
    request.frame = frame;
    request.map_id = map_id;
    request.reference_id = tracker.view()->reference_id;
    request.T_reference_body = tracker.view()->T_world_reference.inverse() * outcome.T_world_body;
    tracker.sightings(&request.sightings);
    tracker.take_counts(&request.counts);
    const std::uint64_t start = std::max(frame->number, mapping_busy_until);
    // Lockstep: mapping's work, done here and now, is no work of tracking's.
    const StagePause pause_keyframe(listener, Stage::kKeyframe), pause_tracking(listener, Stage::kTracking);
    const StageSpan mapping(listener, Stage::kMapping);
    auto quick = mapper.insert(request);
    if (!quick) return;
    pending.push_back(
        {start + static_cast<std::uint64_t>(config.mapping.quick_view_delay_frames), std::move(quick)});
    pending.push_back(
        {start + static_cast<std::uint64_t>(config.mapping.full_view_delay_frames), mapper.refine()});
    mapping_busy_until = pending.back().due_frame;
    frames_since_keyframe = 0;
    result.keyframe = true;
  }

  // Frames from before the map: backwards and forwards from the pair that began it.
  void pose_waiting() {
    std::stable_sort(waiting.begin(), waiting.end(),
                     [](const auto& a, const auto& b) { return a->number > b->number; });
    SE3 prior;
    const RecordedFrame* first = nullptr;
    for (const RecordedFrame& r : recorded)
      if (r.map_id == map_id) {
        first = &r;
        break;
      }
    if (first == nullptr || !mapper.map().pose_of(first->reference_id, &prior)) return;
    std::vector<RecordedFrame> posed;
    for (const auto& f : waiting) {
      const TrackOutcome o = tracker.track_from(*f, prior);
      if (!o.ok || o.inliers < config.tracking.min_inliers) continue;
      prior = o.T_world_body;
      posed.push_back({f->utime, map_id, tracker.view()->reference_id,
                       tracker.view()->T_world_reference.inverse() * o.T_world_body});
    }
    recorded.insert(recorded.end(), posed.begin(), posed.end());
    waiting.clear();
  }

  void record(const Frame& frame, const SE3& T_world_body) {
    recorded.push_back({frame.utime, map_id, tracker.view()->reference_id,
                        tracker.view()->T_world_reference.inverse() * T_world_body});
  }

  void fill_pose(const Frame& frame, const SE3& T_map_body, const Matrix6d& covariance) {
    if (has_last) {
      T_odom_body = T_odom_body * (T_map_body_last.inverse() * T_map_body);
    }
    T_map_body_last = T_map_body;
    has_last = true;
    result.has_pose = true;
    result.T_map_body = T_map_body;
    result.T_odom_body = T_odom_body;
    const SE3 map_from_odom = T_map_body * T_odom_body.inverse();
    result.map_from_odom = Sim3{1.0, map_from_odom.q, map_from_odom.t};
    result.velocity_body = tracker.velocity_body();
    result.covariance = covariance;
    (void)frame;
  }

  void publish_counts() {
    const MappingCounts& m = mapper.counts();
    counts.keyframes_made = m.keyframes_made;
    counts.keyframes_culled = m.keyframes_culled;
    counts.landmarks_made = m.landmarks_made;
    counts.landmarks_culled = m.landmarks_culled;
    counts.landmarks_fused = m.landmarks_fused;
    counts.vmp_made = m.vmp_made;
    counts.vmp_attached = m.vmp_attached;
    counts.vmp_merged = m.vmp_merged;
    counts.vmp_promoted = m.vmp_promoted;
    counts.vmp_rejected = m.vmp_rejected;
    counts.vmp_evicted = m.vmp_evicted;
    counts.local_ba = m.local_ba;
    counts.vmps = m.vmp_alive;
    counts.keyframes = static_cast<std::uint32_t>(mapper.map().keyframes().size());
    counts.landmarks = static_cast<std::uint32_t>(mapper.map().landmarks().size());
  }
};

Estimator::Estimator(const EstimatorConfig& config, const Rig& rig)
    : impl_(std::make_unique<Impl>(config, rig)) {}
Estimator::~Estimator() = default;

const FrameResult& Estimator::process(const FrameInput& input) {
  Impl& s = *impl_;
  if (input.image.data == nullptr || input.image.width_px != s.camera.width_px() ||
      input.image.height_px != s.camera.height_px()) {
    ++s.counts.frames_rejected;
    s.result.has_pose = false;
    s.result.utime = input.utime;
    return s.result;
  }
  if (!s.acceptable(input.utime, input.camera)) return s.result;
  const StageSpan tracking(s.listener, Stage::kTracking);
  const std::shared_ptr<Frame> frame = s.new_frame(input.utime, input.sequence, input.camera);
  const std::shared_ptr<PyramidFrame> pixels = s.pyramids.take();
  {
    const StageSpan span(s.listener, Stage::kPyramid);
    pixels->pyramid.build(input.image);
  }
  {
    const StageSpan span(s.listener, Stage::kExtraction);
    s.extractor.extract(pixels->pyramid, {}, &frame->set);
  }
  frame->image = pixels;
  s.index_features(frame.get());
  return s.step(frame);
}

const FrameResult& Estimator::process(FeatureInput&& input) {
  Impl& s = *impl_;
  if (!s.acceptable(input.utime, input.camera)) return s.result;
  const std::shared_ptr<Frame> frame = s.new_frame(input.utime, input.sequence, input.camera);
  frame->set = std::move(input.features);
  frame->image = std::move(input.image);
  s.index_features(frame.get());
  return s.step(frame);
}

void Estimator::listen(StageListener* listener) {
  impl_->listener = listener;
  impl_->tracker.listen(listener);
  impl_->mapper.listen(listener);
}

void Estimator::finish() {
  // Lockstep runs every job when it is asked for; nothing is queued beyond views nobody will use.
  impl_->pending.clear();
  if (!impl_->waiting.empty() && impl_->state != State::kInitialising && impl_->tracker.view() != nullptr)
    impl_->pose_waiting();
}

const EstimatorCounts& Estimator::counts() const {
  return impl_->counts;
}

std::vector<MapTrajectory> Estimator::trajectories() const {
  std::vector<MapTrajectory> out;
  for (const RecordedFrame& r : impl_->recorded) {
    SE3 T_world_reference;
    if (!impl_->mapper.map().pose_of(r.reference_id, &T_world_reference)) continue;
    auto it =
        std::find_if(out.begin(), out.end(), [&](const MapTrajectory& t) { return t.map_id == r.map_id; });
    if (it == out.end()) it = out.insert(out.end(), MapTrajectory{r.map_id, {}});
    it->frames.push_back({r.utime, T_world_reference * r.T_reference_body});
  }
  for (MapTrajectory& t : out)
    std::stable_sort(t.frames.begin(), t.frames.end(),
                     [](const PosedFrame& a, const PosedFrame& b) { return a.utime < b.utime; });
  std::stable_sort(out.begin(), out.end(), [](const MapTrajectory& a, const MapTrajectory& b) {
    return a.frames.size() > b.frames.size();
  });
  return out;
}

std::vector<LandmarkInfo> Estimator::landmarks() const {
  std::vector<LandmarkInfo> out;
  const Map& map = impl_->mapper.map();
  map.landmarks().for_each([&](LandmarkHandle, const Landmark& l) {
    LandmarkInfo i;
    i.id = l.id;
    i.map_id = l.map_id;
    const Eigen::Vector4d p = map.world_point(l);
    i.position_map = p.head<3>() / std::max(p[3], 1e-9);
    i.inverse_depth = l.inverse_depth;
    i.inverse_depth_sigma = l.inverse_depth_sigma;
    i.creation_depth = l.creation_depth;
    i.creation_relative_sigma = l.creation_relative_sigma;
    i.through_vmp = l.through_vmp;
    i.full = l.state != LandmarkState::kBearing;
    i.observations = static_cast<int>(l.observations.size());
    std::memcpy(&i.tag, l.patch.pixels.data(), sizeof(i.tag));
    out.push_back(i);
  });
  return out;
}

void Estimator::visit_observation_distances(const std::function<void(std::int32_t, double)>& visit) const {
  const Map& map = impl_->mapper.map();
  map.landmarks().for_each([&](LandmarkHandle, const Landmark& l) {
    if (l.state == LandmarkState::kBearing || l.inverse_depth <= 0.0) return;
    const Eigen::Vector4d p = map.world_point(l);
    for (const Observation& o : l.observations)
      visit(l.map_id, (p.head<3>() / p[3] - map.T_world_camera(map.keyframes()[o.keyframe]).t).norm());
  });
}

std::vector<SE3> Estimator::keyframe_poses() const {
  std::vector<SE3> out;
  impl_->mapper.map().keyframes().for_each(
      [&](KeyframeHandle, const Keyframe& k) { out.push_back(k.T_world_body); });
  return out;
}

CalibrationInfo Estimator::calibration() const {
  const CalibrationDelta d = impl_->mapper.calibrator().delta(), s = impl_->mapper.calibrator().sigma();
  return {d[0], d[1], d[2], d[3], s[0], s[1], s[2], s[3]};
}

std::vector<std::pair<std::string, std::size_t>> Estimator::memory_table() const {
  return {{"keyframes", impl_->mapper.map().keyframes().bytes()},
          {"landmarks", impl_->mapper.map().landmarks().bytes()},
          {"pyramids", impl_->pyramids.bytes()}};
}

}  // namespace farpoint::slam
