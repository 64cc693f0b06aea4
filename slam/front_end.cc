#include "slam/front_end.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace farpoint::slam {

namespace {

// Frames and time of trying to find the way back before a new map is begun; frames that show nothing are no
// tries.
constexpr int kRelocalisationFrames = 15;
constexpr std::int64_t kRelocalisation_us = 1'500'000;
// Where so many frames in a row are missing, the next one does not go on where the last one was, it has to be
// found.
constexpr int kGapFrames = 4;
// A map this young is dropped rather than kept when it is lost: its unit has not settled.
constexpr int kYoungMapKeyframes = 5;
constexpr int kGridCell_px = 24;

// Frames that are in somebody's hands at once: the initialiser's history, or what became of it and waits for
// a pose; as many in a job that poses them; the pair of a new map, the frame being tracked and the next
// keyframe.
constexpr std::size_t kFrames = 2 * Initialiser::kHistoryFrames + 8;

std::shared_ptr<Frame> roomy_frame(const Camera& camera, const EstimatorConfig& config) {
  const auto features = static_cast<std::size_t>(config.extractor.features);
  auto frame = std::make_shared<Frame>();
  // Touched by filling it once.
  frame->set.features.resize(features);
  frame->set.descriptors.resize(features);
  frame->grid = FeatureGrid(camera.width_px(), camera.height_px(), kGridCell_px, features);
  frame->grid.build(frame->set.features);
  frame->set.features.clear();
  frame->set.descriptors.clear();
  return frame;
}

// Pyramids that are in somebody's hands at once. Either a map is being built: its keyframes that keep theirs,
// one more until the oldest is let go, two that began it. Or one is being looked for: the initialiser's
// reference and every second one of half of its frames since. Besides the frame being tracked, the next
// keyframe and the pair of a new map; and those of a map that was given up, until mapping has let them go.
std::size_t pyramid_count(const EstimatorConfig& config) {
  constexpr std::size_t kInHand = 4, kOverlap = 4;
  const double history = static_cast<double>(Initialiser::kHistoryFrames);
  const auto looking =
      static_cast<std::size_t>(std::min(0.25 * config.initialisation.max_frames, history)) + 4;
  const std::size_t building = static_cast<std::size_t>(config.capacity.window_images) + 3;
  return std::max(looking, building) + kInHand + kOverlap;
}

// Tells images apart. Two shots of one scene differ by their noise; equal pixels are one shot sent twice.
std::uint64_t pixel_hash(const ImageView& image) {
  constexpr std::uint64_t kPrime = 0x9E3779B97F4A7C15ULL;  // odd, bits well mixed: 2^64 over the golden ratio
  const auto width = static_cast<std::size_t>(image.width_px);
  std::uint64_t hash = kPrime;
  for (int y = 0; y < image.height_px; ++y) {
    const std::uint8_t* row = image.data + static_cast<std::ptrdiff_t>(y) * image.stride_bytes;
    for (std::size_t x = 0; x < width; x += sizeof(std::uint64_t)) {
      std::uint64_t word = 0;
      std::memcpy(&word, row + x, std::min(sizeof(word), width - x));
      hash = (hash ^ word) * kPrime;
      hash ^= hash >> 32;
    }
  }
  return hash;
}

}  // namespace

struct TrackingSide::PyramidFrame final : FrameImage {
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

TrackingSide::TrackingSide(const EstimatorConfig& config, const Rig& rig, Exchange* exchange)
    : config_(config),
      rig_(rig),
      camera_(rig_.cameras.front().camera),
      exchange_(*exchange),
      extractor_(camera_.width_px(), camera_.height_px(), config_.pyramid, config_.extractor),
      frames_(kFrames, [this] { return roomy_frame(camera_, config_); }),
      pyramids_(pyramid_count(config_),
                [this] {
                  return std::make_shared<PyramidFrame>(camera_.width_px(), camera_.height_px(),
                                                        config_.pyramid);
                }),
      initialiser_(config_, rig_),
      tracker_(config_) {
  waiting_.reserve(2 * Initialiser::kHistoryFrames);
}

void TrackingSide::listen(StageListener* listener) {
  listener_ = listener;
  tracker_.listen(listener);
}

// --- frames in
// --------------------------------------------------------------------------------------------------

bool TrackingSide::acceptable(std::int64_t utime, int camera_index) {
  if (camera_index != 0 || (any_frame_ && utime <= last_utime_)) return false;
  any_frame_ = true;
  last_utime_ = utime;
  return true;
}

const FrameResult& TrackingSide::reject(std::int64_t utime) {
  ++counts_.frames_rejected;
  result_.has_pose = false;
  result_.utime = utime;
  return result_;
}

std::shared_ptr<Frame> TrackingSide::take_frame(std::int64_t utime, std::int64_t sequence, int camera_index) {
  // Frames that were given back still name their pixels.
  frames_.for_each_idle([](Frame& frame) { frame.image.reset(); });
  std::shared_ptr<Frame> frame = frames_.take();
  if (!frame) return frame;
  frame->number = frame_number_++;
  frame->utime = utime;
  frame->sequence = sequence;
  frame->camera = camera_index;
  return frame;
}

const FrameResult& TrackingSide::track(const FrameInput& input, const ReplyLimit& limit) {
  const StageSpan tracking(listener_, Stage::kTracking);
  const bool fits = input.image.data != nullptr && input.image.width_px == camera_.width_px() &&
                    input.image.height_px == camera_.height_px();
  if (!fits || !acceptable(input.utime, input.camera)) return reject(input.utime);
  const std::shared_ptr<Frame> frame = take_frame(input.utime, input.sequence, input.camera);
  const std::shared_ptr<PyramidFrame> pixels = pyramids_.take();
  if (!frame || !pixels) return reject(input.utime);
  const std::uint64_t hash = pixel_hash(input.image);
  if (std::exchange(image_hash_, hash) == hash) {
    // A camera that hangs says nothing of where it is now.
    frame->set.features.clear();
    frame->set.descriptors.clear();
    frame->grid.build(frame->set.features);
    return step(frame, limit);
  }
  {
    const StageSpan span(listener_, Stage::kPyramid);
    pixels->pyramid.build(input.image);
  }
  {
    const StageSpan span(listener_, Stage::kExtraction);
    extractor_.extract(pixels->pyramid, {}, &frame->set, input.most_features);
    frame->image = pixels;
    frame->grid.build(frame->set.features);
  }
  return step(frame, limit);
}

const FrameResult& TrackingSide::track(FeatureInput&& input, const ReplyLimit& limit) {
  const StageSpan tracking(listener_, Stage::kTracking);
  if (!acceptable(input.utime, input.camera)) return reject(input.utime);
  const std::shared_ptr<Frame> frame = take_frame(input.utime, input.sequence, input.camera);
  if (!frame) return reject(input.utime);
  frame->set = std::move(input.features);
  frame->image = std::move(input.image);
  frame->grid.build(frame->set.features);
  return step(frame, limit);
}

const FrameResult& TrackingSide::step(const std::shared_ptr<Frame>& frame, const ReplyLimit& limit) {
  ++counts_.frames;
  const std::uint64_t replies_before = result_.replies_taken;
  result_ = FrameResult{};
  result_.replies_taken = replies_before;
  result_.utime = frame->utime;
  result_.sequence = frame->sequence;
  result_.features = static_cast<int>(frame->set.features.size());
  take_replies(frame->number, limit);
  const bool blind = result_.features < config_.tracking.min_inliers;
  if (state_ == State::kInitialising) {
    if (!blind) initialise(frame);
  } else if (blind) {
    see_nothing();
  } else {
    follow(frame);
  }
  if (!blind) note_interval(frame->utime);
  result_.state = blind && state_ != State::kInitialising ? State::kLost : state_;
  result_.map_id = map_id_;
  result_.reset_counter = resets_;
  result_.jobs_under_way = static_cast<int>(jobs_under_way_);
  return result_;
}

// --- mapping's replies
// ------------------------------------------------------------------------------------------

bool TrackingSide::is_due(const MappingReply& reply, std::uint64_t frame_number,
                          const ReplyLimit& limit) const {
  if (!limit.by_delay) return reply.number <= limit.up_to;
  int delay_frames = 0;
  if (reply.stage == MappingStage::kQuick) delay_frames = config_.mapping.quick_view_delay_frames;
  if (reply.stage == MappingStage::kFull) delay_frames = config_.mapping.full_view_delay_frames;
  return reply.frame_number + static_cast<std::uint64_t>(delay_frames) <= frame_number;
}

void TrackingSide::take_replies(std::uint64_t frame_number, const ReplyLimit& limit) {
  while (MappingReply* reply = exchange_.replies.front()) {
    if (!is_due(*reply, frame_number, limit)) return;
    take(*reply);
    reply->view.reset();
    exchange_.replies.pop();
  }
}

void TrackingSide::take(const MappingReply& reply) {
  result_.replies_taken = reply.number;
  if (reply.ends_job) --jobs_under_way_;
  note_counts(reply);
  if (reply.job_number < first_job_of_map_) return;
  if (reply.stage == MappingStage::kStarted)
    begin_map(reply);
  else if (reply.view && reply.view->map_id == map_id_)
    take_view(reply.view);
}

void TrackingSide::note_counts(const MappingReply& reply) {
  const MappingCounts& m = reply.counts;
  counts_.keyframes_made = m.keyframes_made;
  counts_.keyframes_culled = m.keyframes_culled;
  counts_.keyframes_forgotten = m.keyframes_forgotten;
  counts_.landmarks_forgotten = m.landmarks_forgotten;
  counts_.landmarks_made = m.landmarks_made;
  counts_.landmarks_culled = m.landmarks_culled;
  counts_.landmarks_fused = m.landmarks_fused;
  counts_.vmp_made = m.vmp_made;
  counts_.vmp_attached = m.vmp_attached;
  counts_.vmp_merged = m.vmp_merged;
  counts_.vmp_promoted = m.vmp_promoted;
  counts_.vmp_rejected = m.vmp_rejected;
  counts_.vmp_evicted = m.vmp_evicted;
  counts_.local_ba = m.local_ba;
  counts_.vmps = m.vmp_alive;
  counts_.calibration_contradicted = m.calibration_contradicted;
  counts_.keyframes = reply.keyframes;
  counts_.landmarks = reply.landmarks;
}

void TrackingSide::take_view(std::shared_ptr<const LocalView> view) {
  const SE3 before = tracker_.T_world_body();
  const bool first = tracker_.view() == nullptr;
  tracker_.set_view(std::move(view));
  settled_ = tracker_.view()->settled;
  // The pose moved with its keyframe: the jump belongs to map_from_odom, not to odom.
  if (has_last_ && !first) T_map_body_last_ = tracker_.T_world_body() * (before.inverse() * T_map_body_last_);
}

// Lockstep: within the frame that found the pair. Threads: before the first frame after mapping is done.
void TrackingSide::begin_map(const MappingReply& reply) {
  const std::shared_ptr<Frame> first = std::move(start_first_), second = std::move(start_second_);
  if (!reply.view) return;
  const LocalView& view = *reply.view;
  ++map_id_;
  ++counts_.maps;
  ++resets_;
  settled_ = false;
  lost_frames_ = 0;
  trial_.reset();
  // A new map's two keyframes lie far apart: it may have its third with the next frame.
  frames_since_keyframe_ = config_.keyframes.min_interval_frames - 1;
  tracker_.start(view.T_world_reference, second->utime);
  tracker_.set_view(reply.view);
  busy_until_frame_ = second->number + static_cast<std::uint64_t>(config_.mapping.quick_view_delay_frames);
  last_before_map_ = second->number;
  waiting_.assign(initialiser_.history().begin(), initialiser_.history().end());
  std::erase_if(waiting_, [&](const auto& f) { return f == first || f == second; });
  for (const auto& f : waiting_) f->image.reset();
  record({first->utime, map_id_, view.keyframes.front().id, SE3{}});
  record(
      {second->utime, map_id_, view.reference_id, view.T_world_reference.inverse() * view.T_world_reference});
  initialiser_.clear();
  state_ = State::kSettling;
  fill_pose(view.T_world_reference, Matrix6d::Zero());
}

const FrameResult& TrackingSide::take_replies_at_once() {
  const bool had_map = state_ != State::kInitialising;
  take_replies(frame_number_ - 1, ReplyLimit{});
  if (had_map || state_ == State::kInitialising) return result_;
  result_.state = state_;
  result_.map_id = map_id_;
  result_.reset_counter = resets_;
  return result_;
}

bool TrackingSide::mapping_is_free(std::uint64_t frame_number) const {
  return jobs_under_way_ == 0 && busy_until_frame_ <= frame_number;
}

MappingJob* TrackingSide::begin_job(MappingJobKind kind) {
  // Replies not taken yet count too, or their ring could overflow.
  if (jobs_under_way_ == Exchange::kJobs) return nullptr;
  MappingJob* job = exchange_.jobs.begin_push();
  if (job == nullptr) return nullptr;
  job->kind = kind;
  job->number = jobs_ + 1;
  job->frame_number = frame_number_ - 1;
  job->utime = last_utime_;
  job->map_id = map_id_;
  return job;
}

void TrackingSide::end_job() {
  ++jobs_;
  ++jobs_under_way_;
  result_.job = jobs_;
  exchange_.jobs.end_push();
}

// --- initialising
// -----------------------------------------------------------------------------------------------

void TrackingSide::initialise(const std::shared_ptr<Frame>& frame) {
  if (start_second_) {
    initialiser_.remember(frame);
    return;
  }
  const std::optional<InitialPair> pair = initialiser_.add(frame);
  result_.matches = initialiser_.last_matches();
  if (!pair) return;
  MappingJob* job = begin_job(MappingJobKind::kStartMap);
  if (job == nullptr) return;
  job->map_id = map_id_ + 1;
  job->pair = *pair;
  end_job();
  start_first_ = pair->first;
  start_second_ = pair->second;
}

// --- tracking
// ---------------------------------------------------------------------------------------------------

// A frame without a picture is as none: what follows it is found again by the time that has gone by.
void TrackingSide::see_nothing() {
  result_.has_pose = false;
  result_.view_sequence = tracker_.view() != nullptr ? tracker_.view()->sequence : 0;
}

// The camera's own pace, which a gap is measured in. A slower one is learnt at once, a faster one within some
// frames: a frame that was doubled is no pace.
void TrackingSide::note_interval(std::int64_t utime) {
  if (seen_utime_ != kNever) {
    const std::int64_t now_us = utime - seen_utime_;
    interval_us_ = interval_us_ == 0 ? now_us : std::clamp(now_us, interval_us_ * 7 / 8, 2 * interval_us_);
  }
  seen_utime_ = utime;
}

bool TrackingSide::after_gap(std::int64_t utime) const {
  return interval_us_ > 0 && utime - seen_utime_ > kGapFrames * interval_us_;
}

void TrackingSide::follow(const std::shared_ptr<Frame>& frame) {
  result_.has_pose = false;  // begin_map() has left the pair's
  const bool on_trial = trial_.has_value() && !after_gap(frame->utime);
  const bool searching =
      !on_trial && (state_ == State::kLost || state_ == State::kRelocalising || after_gap(frame->utime));
  const std::optional<RecordedFrame> tried = std::exchange(trial_, std::nullopt);
  const TrackOutcome outcome = searching ? tracker_.relocalise(*frame) : tracker_.track(*frame);
  result_.view_sequence = tracker_.view() != nullptr ? tracker_.view()->sequence : 0;
  result_.matches = outcome.matches;
  result_.inliers = outcome.inliers;
  result_.aligned = outcome.aligned;
  if (!outcome.ok || outcome.inliers < config_.tracking.min_inliers || (on_trial && !outcome.agreed())) {
    lose(frame);
    return;
  }
  if (searching) {
    try_out(*frame, outcome);
    return;
  }
  if (on_trial) record(*tried);
  go_on(frame, outcome);
}

// A place that was searched for is told of once the next frame goes on from there.
void TrackingSide::try_out(const Frame& frame, const TrackOutcome& outcome) {
  if (state_ != State::kLost && state_ != State::kRelocalising) ++counts_.lost;
  has_last_ = false;
  state_ = State::kRelocalising;
  tracker_.accept_on_trial(frame, outcome);
  trial_ = place(frame, outcome);
}

void TrackingSide::go_on(const std::shared_ptr<Frame>& frame, const TrackOutcome& outcome) {
  lost_frames_ = 0;
  tracker_.accept(*frame, outcome);
  record(place(*frame, outcome));
  ++frames_since_keyframe_;
  maybe_keyframe(frame, outcome);
  if (settled_ && !waiting_.empty()) pose_waiting();
  if (!settled_ || !outcome.agreed())
    state_ = State::kSettling;
  else
    state_ = outcome.inliers < config_.tracking.degraded_inliers ? State::kDegraded : State::kTracking;
  fill_pose(outcome.T_world_body, outcome.covariance);
  const double share = static_cast<double>(outcome.inliers) / std::max(1, outcome.matches);
  result_.quality = is_valid(state_) ? static_cast<int>(std::lround(100.0 * share)) : -1;
}

void TrackingSide::lose(const std::shared_ptr<Frame>& frame) {
  if (state_ != State::kLost && state_ != State::kRelocalising) ++counts_.lost;
  has_last_ = false;
  if (++lost_frames_ == 1) lost_since_utime_ = frame->utime;
  const int keyframes = tracker_.view() != nullptr ? tracker_.view()->map_keyframes : 0;
  const bool young = !settled_ || keyframes < kYoungMapKeyframes;
  state_ = lost_frames_ == 1 ? State::kLost : State::kRelocalising;
  const bool tried_enough =
      lost_frames_ > kRelocalisationFrames && frame->utime - lost_since_utime_ > kRelocalisation_us;
  if (!young && !tried_enough) return;
  // Begin anew, beside the old map where that is worth keeping. Where mapping cannot take the job now, the
  // old map stays as it is.
  if (begin_job(young ? MappingJobKind::kDiscardMap : MappingJobKind::kRetireMap) != nullptr) end_job();
  first_job_of_map_ = jobs_ + 1;
  busy_until_frame_ = 0;
  waiting_.clear();
  initialiser_.clear();
  state_ = State::kInitialising;
  (void)initialiser_.add(frame);
}

void TrackingSide::maybe_keyframe(const std::shared_ptr<Frame>& frame, const TrackOutcome& outcome) {
  const StageSpan span(listener_, Stage::kKeyframe);
  if (!wants_keyframe(config_, *tracker_.view(), outcome, {frames_since_keyframe_, true})) return;
  if (!mapping_is_free(frame->number)) {
    ++counts_.keyframes_dropped;
    return;
  }
  MappingJob* job = begin_job(MappingJobKind::kKeyframe);
  if (job == nullptr) return;
  KeyframeRequest& request = job->keyframe;
  request.frame = frame;
  request.map_id = map_id_;
  request.reference_id = tracker_.view()->reference_id;
  request.T_reference_body = tracker_.view()->T_world_reference.inverse() * outcome.T_world_body;
  tracker_.sightings(&request.sightings);
  tracker_.take_counts(&request.counts);
  end_job();
  frames_since_keyframe_ = 0;
  result_.keyframe = true;
}

void TrackingSide::pose_waiting() {
  MappingJob* job = begin_job(MappingJobKind::kPoseFrames);
  if (job == nullptr) return;  // with the next frame
  job->frames.assign(waiting_.begin(), waiting_.end());
  job->last_before_map = last_before_map_;
  job->view = tracker_.shared_view();
  tracker_.last_seen(&job->seen);
  end_job();
  waiting_.clear();
}

void TrackingSide::finish() {
  if (!waiting_.empty() && state_ != State::kInitialising && tracker_.view() != nullptr) pose_waiting();
}

void TrackingSide::release_frames() {
  frames_ = {};
  pyramids_ = {};
}

void TrackingSide::take_counts() {
  while (MappingReply* reply = exchange_.replies.front()) {
    note_counts(*reply);
    reply->view.reset();
    exchange_.replies.pop();
  }
}

RecordedFrame TrackingSide::place(const Frame& frame, const TrackOutcome& outcome) const {
  return {frame.utime, map_id_, tracker_.view()->reference_id,
          tracker_.view()->T_world_reference.inverse() * outcome.T_world_body};
}

void TrackingSide::record(const RecordedFrame& frame) {
  if (!exchange_.recorded.push(frame)) ++counts_.frames_not_recorded;
}

void TrackingSide::fill_pose(const SE3& T_map_body, const Matrix6d& covariance) {
  if (has_last_) T_odom_body_ = T_odom_body_ * (T_map_body_last_.inverse() * T_map_body);
  T_map_body_last_ = T_map_body;
  has_last_ = true;
  result_.has_pose = true;
  result_.T_map_body = T_map_body;
  result_.T_odom_body = T_odom_body_;
  const SE3 map_from_odom = T_map_body * T_odom_body_.inverse();
  result_.map_from_odom = Sim3{1.0, map_from_odom.q, map_from_odom.t};
  result_.velocity_body = tracker_.velocity_body();
  result_.covariance = covariance;
}

std::vector<std::pair<std::string, std::size_t>> TrackingSide::memory_table() const {
  const Frame& frame = frames_.sample();
  const std::size_t frame_bytes = sizeof(Frame) + frame.set.features.capacity() * sizeof(Feature) +
                                  frame.set.descriptors.capacity() * sizeof(Descriptor) + frame.grid.bytes();
  return {{"pyramids", pyramids_.capacity() * pyramids_.sample().pyramid.bytes()},
          {"frames", frames_.capacity() * frame_bytes},
          {"tracker", tracker_.bytes()}};
}

}  // namespace farpoint::slam
