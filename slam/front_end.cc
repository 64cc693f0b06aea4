// SPDX-License-Identifier: Apache-2.0
#include "slam/front_end.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace farpoint::slam {

namespace {

// Room for samples that wait for a frame: two seconds of a 1 kHz IMU, and of wheels at 100 Hz. Kept for
// fusion: twice that.
constexpr std::size_t kImuWaiting = 2048, kImuKept = 4096;
constexpr std::size_t kWheelsWaiting = 256;

std::int64_t seconds_to_us(double s) {
  return static_cast<std::int64_t>(std::llround(1e6 * s));
}

// More than one camera gave pixels: the frame has depth of its own.
bool shows_pair(const Frame& frame) {
  for (int c = 1; c < frame.views.size(); ++c)
    if (frame.views[c].image) return frame.views[0].image != nullptr;
  return false;
}

int quality_of(const TrackOutcome& outcome) {
  const double share = static_cast<double>(outcome.inliers) / std::max(1, outcome.matches);
  return static_cast<int>(std::lround(100.0 * share));
}

}  // namespace

FrontEnd::FrontEnd(const EstimatorConfig& config, const Rig& rig, MappingRings* rings,
                   const VehiclePoints& points)
    : config_(config),
      points_(points),
      intake_(config, rig, static_cast<int>(rig.cameras.size())),
      initialiser_(config, rig),
      tracker_(config, static_cast<int>(rig.cameras.size())),
      port_(config.mapping, rings),
      odometry_(config.odometry),
      uncertainty_(rig),
      repeated_(static_cast<std::size_t>(config.extractor.features)),
      fixed_(static_cast<std::size_t>(config.extractor.features)),
      imu_(kImuWaiting, kImuKept),
      wheels_(kWheelsWaiting, kWheelsKept),
      wheel_motion_(config.wheels, points.wheels_m),
      carried_(config.wheels) {
  tracker_.use_motion_model(&wheel_prior_);
  waiting_.reserve(2 * Initialiser::kHistoryFrames);
}

void FrontEnd::listen(StageListener* listener) {
  listener_ = listener;
  intake_.listen(listener);
  tracker_.listen(listener);
}

// --- one frame

const FrameResult& FrontEnd::track(const FrameInput& input, const TakeLimit& limit) {
  const StageSpan tracking(listener_, Stage::kTracking);
  const std::shared_ptr<Frame> frame = intake_.take(input);
  return frame ? step(frame, limit) : reject(input.utime);
}

const FrameResult& FrontEnd::track(FeatureInput&& input, const TakeLimit& limit) {
  const StageSpan tracking(listener_, Stage::kTracking);
  const std::int64_t utime = input.utime;
  const std::shared_ptr<Frame> frame = intake_.take(std::move(input));
  return frame ? step(frame, limit) : reject(utime);
}

const FrameResult& FrontEnd::reject(std::int64_t utime) {
  ++counts_.frames_rejected;
  result_.has_pose = false;
  result_.utime = utime;
  return result_;
}

const FrameResult& FrontEnd::step(const std::shared_ptr<Frame>& frame, const TakeLimit& limit) {
  ++counts_.frames;
  result_ = FrameResult{};
  result_.utime = frame->utime;
  result_.sequence = frame->sequence;
  result_.features = static_cast<int>(frame->feature_count());
  by_wheels_ = false;
  take_samples(*frame, limit.up_to);
  take_replies(frame->utime, {limit.replies_by_delay, limit.up_to.replies});
  repeated_share_ = repeated_.add(frame->views[0].set);
  const bool blind = result_.features < config_.tracking.min_inliers;
  const bool held = frame->repeats && is_valid(state_) && standstill_.explains_repeat(frame->utime);
  if (!blind && replaces_map(*frame)) {
    give_up_map(recovery_.ever_settled() ? MappingJobKind::kRetireMap : MappingJobKind::kDiscardMap, frame);
  } else if (state_ == State::kInitialising) {
    if (!blind) initialise(frame);
  } else if (held) {
    hold_pose(*frame);
  } else if (blind) {
    skip_blind_frame(*frame);
  } else {
    follow(frame);
  }
  if (!blind || held) recovery_.note_seen(frame->utime);
  fill_map_state();
  if (blind && !held && state_ != State::kInitialising) result_.state = State::kLost;
  if (by_wheels_)
    result_.state = State::kDegraded;
  else
    result_.refusal = refusal_of(*frame, blind && !held);
  result_.jobs_under_way = static_cast<int>(port_.jobs_under_way());
  place_body();
  return result_;
}

void FrontEnd::take_samples(const Frame& frame, const FrameTaken& up_to) {
  imu_.take_until(frame.utime, up_to.imu);
  wheels_.take_until(frame.utime, up_to.wheels);
  read_wheels();
  counts_.imu = imu_.counts();
  counts_.wheels = wheels_.counts();
  result_.taken.imu = counts_.imu.taken();
  result_.taken.wheels = counts_.wheels.taken();
}

void FrontEnd::read_wheels() {
  if (!config_.wheels.use) return;
  const SampleHistory<WheelSample>& history = wheels_.history();
  std::size_t first = history.size();
  while (first > 0 && history[first - 1].utime > wheels_read_utime_) --first;
  for (std::size_t i = first; i < history.size(); ++i) wheel_motion_.add(history[i]);
  if (history.size() > 0) wheels_read_utime_ = history[history.size() - 1].utime;
}

Refusal FrontEnd::refusal_of(const Frame& frame, bool blind) const {
  if (blind && frame.repeats) return {.reason = Reason::kFrozenImage};
  if (blind)
    return {Reason::kTooDark, static_cast<double>(result_.features),
            static_cast<double>(config_.tracking.min_inliers)};
  switch (state_) {
    case State::kInitialising:
      return initialiser_.refusal();
    case State::kSettling:
      return explained(validity_.refusal());
    case State::kLost:
      return {Reason::kLost, static_cast<double>(result_.inliers),
              static_cast<double>(config_.tracking.min_inliers)};
    case State::kRelocalising:
      return {.reason = Reason::kPlaceNotRecognised};
    default:
      return {};
  }
}

// What moves with the camera contradicts every motion: it is named in the place of what it causes.
Refusal FrontEnd::explained(const Refusal& refusal) const {
  switch (refusal.reason) {
    case Reason::kField:
    case Reason::kExcess:
    case Reason::kNoise:
    case Reason::kSoundAgain:
    case Reason::kDisagreement:
      if (fixed_.share() > FixedFeatures::kMostShare)
        return {Reason::kMovesWithCamera, fixed_.share(), FixedFeatures::kMostShare};
      return refusal;
    default:
      return refusal;
  }
}

// --- mapping's replies

void FrontEnd::take_replies(std::int64_t utime, const ReplyLimit& limit) {
  while (const MappingReply* reply = port_.take_reply(utime, limit)) {
    take_reply(*reply);
    port_.release_reply();
  }
  result_.taken.replies = port_.replies_taken();
}

void FrontEnd::take_reply(const MappingReply& reply) {
  note_counts(reply);
  if (!port_.is_of_present_map(reply)) return;
  if (reply.stage == MappingStage::kStarted)
    start_map(reply);
  else if (reply.view && reply.view->map_id == map_id_)
    take_view(reply.view);
}

void FrontEnd::note_counts(const MappingReply& reply) {
  counts_.mapping = reply.counts;
  counts_.keyframes = reply.keyframes;
  counts_.landmarks = reply.landmarks;
}

void FrontEnd::take_view(std::shared_ptr<const LocalView> view) {
  const SE3 before = tracker_.T_world_body();
  const bool first = tracker_.view() == nullptr;
  const double scale = tracker_.set_view(std::move(view));
  note_judgement();
  // The pose moved with its keyframe: the correction belongs to map_from_odom, not to odom.
  if (!first) odometry_.correct(before, tracker_.T_world_body(), scale);
  // The metre was found: odom is in metres from here on.
  if (!first && scale != 1.0 && tracker_.view()->judgement.metric) {
    odometry_.begin_unit(tracker_.T_world_body());
    uncertainty_.begin();
  }
}

void FrontEnd::note_judgement() {
  const MapJudgement& judgement = tracker_.view()->judgement;
  wheel_motion_.trust(judgement.wheels, judgement.wheel_factor);
  if (!judgement.steady) return;
  odometry_.follow_map();
  recovery_.note_settled();
}

// Lockstep: within the frame that found the pair. Threads: before the first frame after mapping is done.
void FrontEnd::start_map(const MappingReply& reply) {
  const auto pair = std::exchange(start_pair_, {});
  if (!reply.view) {
    if (pair.first && !pair.second) {
      // The frame stays to be posed; its pixels are wanted no longer.
      pair.first->drop_pixels();
      no_depth_utime_ = pair.first->utime;
    }
    return;
  }
  const bool one_frame = pair.second == nullptr;
  const Frame &first = *pair.first, &second = one_frame ? first : *pair.second;
  const LocalView& view = *reply.view;
  ++map_id_;
  ++counts_.maps;
  odometry_.begin_map();
  uncertainty_.begin();
  recovery_.begin_map();
  validity_.begin_map();
  fixed_.forget_reference();
  valid_utime_.reset();
  carried_.clear();
  // A new map's two keyframes lie far apart: it may have its third with the next frame.
  keyframe_utime_ = second.utime - seconds_to_us(config_.keyframes.min_interval_s);
  tracker_.start(view.T_world_reference, second.utime);
  tracker_.set_view(reply.view);
  note_judgement();
  if (view.judgement.metric) no_depth_utime_.reset();
  last_before_map_ = second.number;
  waiting_.assign(initialiser_.history().begin(), initialiser_.history().end());
  std::erase_if(waiting_, [&](const auto& f) { return f == pair.first || f == pair.second; });
  for (const auto& f : waiting_) f->drop_pixels();
  if (!one_frame) record({first.utime, map_id_, view.keyframes.front().id, SE3{}});
  record({second.utime, map_id_, view.reference_id,
          view.S_world_reference().inverse() * view.T_world_reference});
  initialiser_.clear();
  state_ = State::kSettling;
  fill_pose(view.T_world_reference, Matrix6d::Zero());
}

const FrameResult& FrontEnd::take_replies_at_once() {
  const bool had_map = state_ != State::kInitialising;
  take_replies(intake_.utime(), ReplyLimit{});
  if (!had_map && state_ != State::kInitialising) fill_map_state();
  return result_;
}

MappingJob* FrontEnd::begin_job(MappingJobKind kind) {
  return port_.begin_job(kind, {intake_.number(), intake_.utime(), map_id_});
}

// --- before the map

void FrontEnd::initialise(const std::shared_ptr<Frame>& frame) {
  if (start_pair_.first) {
    initialiser_.remember(frame);
    return;
  }
  if (may_start_metric(*frame)) {
    initialiser_.remember(frame);
    InitialPair pair;
    pair.first = frame;
    start_from(pair);
    return;
  }
  const InitialPair* pair = initialiser_.add(frame);
  result_.matches = initialiser_.last_matches();
  if (pair != nullptr) start_from(*pair);
}

// Where all is too far for the rig's baseline, motion makes a map; the rig is asked again now and then.
bool FrontEnd::may_start_metric(const Frame& frame) const {
  constexpr double kRetry_s = 1.0;
  return shows_pair(frame) &&
         (!no_depth_utime_ || seconds_between(*no_depth_utime_, frame.utime) >= kRetry_s);
}

// The map was made before the further camera came: its unit is unknown, the new one's will be the metre.
bool FrontEnd::replaces_map(const Frame& frame) const {
  const LocalView* view = tracker_.view();
  return state_ != State::kInitialising && view != nullptr && !view->judgement.metric && !no_depth_utime_ &&
         shows_pair(frame);
}

void FrontEnd::start_from(const InitialPair& pair) {
  MappingJob* job = begin_job(MappingJobKind::kStartMap);
  if (job == nullptr) return;
  job->map_id = map_id_ + 1;
  job->pair = pair;
  add_wheels(job);
  send_job();
  start_pair_ = {pair.first, pair.second};
}

// --- against the map

// A frame that shows nothing counts as a missing one.
void FrontEnd::skip_blind_frame(const Frame& frame) {
  standstill_.note_loss();
  result_.has_pose = false;
  result_.view_sequence = tracker_.view() != nullptr ? tracker_.view()->sequence : 0;
  if (const std::optional<SE3> motion = unseen_motion(frame)) tracker_.carry(*motion, frame.utime);
  carry_on(frame);
}

// Motion since odom's newest pose, by wheels; empty where they may not stand in for images.
std::optional<SE3> FrontEnd::unseen_motion(const Frame& frame) const {
  const LocalView* view = tracker_.view();
  if (view == nullptr || !view->judgement.metric || !wheel_motion_.trusted() || !valid_utime_)
    return std::nullopt;
  if (seconds_between(*valid_utime_, frame.utime) > config_.wheels.blind_s) return std::nullopt;
  return wheel_motion_.motion(posed_utime_, frame.utime);
}

// Odometry goes on by wheels alone: degraded and valid, for a limited time. The map keeps nothing of it.
void FrontEnd::carry_on(const Frame& frame) {
  if (state_ == State::kInitialising) return;
  const std::optional<SE3> motion = unseen_motion(frame);
  if (!motion) return;
  odometry_.carry(*motion);
  const double dt_s = seconds_between(posed_utime_, frame.utime);
  const Vector6d before = carried_.variances();
  carried_.add(*motion, dt_s);
  by_wheels_ = true;
  posed_utime_ = frame.utime;
  const Vector6d growth = carried_.variances() - before;
  uncertainty_.carry(odometry_.T_odom_body(), frame.utime, growth.asDiagonal());
  fill_carried(*motion, dt_s);
}

void FrontEnd::fill_carried(const SE3& T_from_to, double dt_s) {
  result_.has_pose = true;
  result_.from_vision = false;
  note_metre();
  result_.quality = 0;
  result_.T_map_body = odometry_.T_map_body();
  result_.T_odom_body = odometry_.T_odom_body();
  result_.map_from_odom = odometry_.map_from_odom(result_.T_map_body);
  result_.velocity_body = SE3{}.boxminus_to(T_from_to) / dt_s;
  result_.odometry = uncertainty_.errors();
  result_.covariance = tracker_.pose_errors().noise;
  result_.covariance.diagonal() += carried_.variances();
  result_.velocity_covariance = carried_.variances_of(result_.velocity_body).asDiagonal();
}

// After frames by wheels alone: the last stretch is theirs too, so that odom makes no step.
void FrontEnd::rejoin_map(const Frame& frame, const SE3& T_map_body) {
  if (carried_.empty()) return;
  if (const std::optional<SE3> motion = wheel_motion_.motion(posed_utime_, frame.utime)) {
    odometry_.carry(*motion);
    odometry_.rejoin(T_map_body);
  }
  carried_.clear();
}

// Wheels and images agree that nothing moves. Images may show what a locked wheel does not: a pose further
// from the one held than noise is none.
bool FrontEnd::stands_still(const Frame& frame, const TrackOutcome& outcome) const {
  // Of a landmark at the median depth, as seen from the vehicle: two pixels of a common lens.
  constexpr double kNoise_rad = 0.003;
  if (!standstill_.stands() || !wheel_motion_.stands(frame.utime)) return false;
  const Vector6d moved = tracker_.T_world_body().boxminus_to(outcome.T_world_body);
  return moved.head<3>().norm() / tracker_.view()->median_depth + moved.tail<3>().norm() < kNoise_rad;
}

// The image is the one before, and the vehicle stands: so is its pose.
void FrontEnd::hold_pose(const Frame& frame) {
  last_outcome_.T_world_body = tracker_.T_world_body();  // a newer view may have moved it
  record(relative_to_reference(frame, last_outcome_));
  fill_pose(last_outcome_.T_world_body, last_outcome_.covariance);
  result_.velocity_body.setZero();
  result_.quality = quality_of(last_outcome_);
  result_.view_sequence = tracker_.view()->sequence;
}

void FrontEnd::follow(const std::shared_ptr<Frame>& frame) {
  result_.has_pose = false;  // start_map() has filled in the pair's
  const Recovery::Search search = recovery_.search(state_, frame->utime);
  const std::optional<RecordedFrame> candidate = recovery_.take_candidate();
  const bool relocalising = search == Recovery::Search::kRelocalise;
  const bool confirming = search == Recovery::Search::kConfirm;
  const TrackOutcome outcome = search_for(*frame, search);
  result_.view_sequence = tracker_.view() != nullptr ? tracker_.view()->sequence : 0;
  result_.matches = outcome.matches;
  result_.inliers = outcome.inliers;
  result_.aligned = outcome.aligned;
  if (!outcome.ok || outcome.inliers < config_.tracking.min_inliers || (confirming && !outcome.agreed())) {
    note_lost(frame);
    carry_on(*frame);
  } else if (relocalising) {
    note_relocalised(*frame, outcome);
    carry_on(*frame);
  } else {
    if (confirming) record(*candidate);
    note_tracked(frame, outcome);
  }
}

TrackOutcome FrontEnd::search_for(const Frame& frame, Recovery::Search search) {
  switch (search) {
    case Recovery::Search::kRelocalise:
      return tracker_.relocalise(frame);
    case Recovery::Search::kConfirm:
      return tracker_.confirm(frame);
    case Recovery::Search::kTrack:
      break;
  }
  return tracker_.track(frame);
}

// The pose is published once the next frame has confirmed it.
void FrontEnd::note_relocalised(const Frame& frame, const TrackOutcome& outcome) {
  if (!is_lost(state_)) ++counts_.lost;
  state_ = State::kRelocalising;
  tracker_.accept_on_trial(frame, outcome);
  recovery_.set_candidate(relative_to_reference(frame, outcome));
}

void FrontEnd::note_tracked(const std::shared_ptr<Frame>& frame, TrackOutcome outcome) {
  const bool still = stands_still(*frame, outcome);
  if (still) outcome.T_world_body = tracker_.T_world_body();
  recovery_.note_tracked();
  tracker_.accept(*frame, outcome);
  record(relative_to_reference(*frame, outcome));
  look_for_fixed_features(*frame);
  if (!still) maybe_keyframe(frame, outcome);
  const MapJudgement& judgement = tracker_.view()->judgement;
  if (judgement.settled(frame->utime) && !waiting_.empty()) pose_waiting_frames();
  const double repeated_share = standstill_.stands() ? 0.0 : repeated_share_;
  if (!validity_.note_tracked(frame->utime, judgement, outcome, repeated_share))
    state_ = State::kSettling;
  else
    state_ = outcome.inliers < config_.tracking.degraded_inliers ? State::kDegraded : State::kTracking;
  rejoin_map(*frame, outcome.T_world_body);
  fill_pose(outcome.T_world_body, outcome.covariance);
  if (still) result_.velocity_body.setZero();
  note_errors();
  if (is_valid(state_)) valid_utime_ = frame->utime;
  result_.quality = is_valid(state_) ? quality_of(outcome) : -1;
  last_outcome_ = outcome;
  standstill_.note_motion(tracker_.velocity_body(), tracker_.view()->median_depth, frame->utime,
                          repeated_share_ > Validity::kFrozenShare);
}

void FrontEnd::look_for_fixed_features(const Frame& frame) {
  const RigCamera& first = tracker_.view()->rig.cameras.front();
  fixed_.add(frame.views[0].set, frame.views[0].grid, first.camera,
             tracker_.T_world_body().q * first.T_body_camera.q, frame.utime);
}

void FrontEnd::note_lost(const std::shared_ptr<Frame>& frame) {
  standstill_.note_loss();
  fixed_.forget_reference();
  validity_.note_lost();
  if (!is_lost(state_)) ++counts_.lost;
  const Recovery::Verdict verdict = recovery_.note_lost(frame->utime);
  state_ = recovery_.state();
  if (verdict == Recovery::Verdict::kDiscardMap) give_up_map(MappingJobKind::kDiscardMap, frame);
  if (verdict == Recovery::Verdict::kRetireMap) give_up_map(MappingJobKind::kRetireMap, frame);
}

// A new map begins, beside the old one where that is kept. The old one stays as it is where mapping cannot
// take the job now.
void FrontEnd::give_up_map(MappingJobKind kind, const std::shared_ptr<Frame>& frame) {
  if (begin_job(kind) != nullptr) send_job();
  port_.give_up_map();
  waiting_.clear();
  initialiser_.clear();
  state_ = State::kInitialising;
  if (may_start_metric(*frame))
    initialise(frame);
  else
    (void)initialiser_.add(frame);
}

// --- hand-over to mapping

void FrontEnd::maybe_keyframe(const std::shared_ptr<Frame>& frame, const TrackOutcome& outcome) {
  const StageSpan span(listener_, Stage::kKeyframe);
  if (!wants_keyframe(config_, *tracker_.view(), outcome,
                      {seconds_between(keyframe_utime_, frame->utime), true}))
    return;
  if (!port_.is_free()) {
    ++counts_.keyframes_dropped;
    return;
  }
  MappingJob* job = begin_job(MappingJobKind::kKeyframe);
  if (job == nullptr) return;
  KeyframeRequest& request = job->keyframe;
  request.frame = frame;
  request.map_id = map_id_;
  request.reference_id = tracker_.view()->reference_id;
  request.T_reference_body = tracker_.view()->S_world_reference().inverse() * outcome.T_world_body;
  tracker_.sightings(&request.sightings);
  tracker_.take_counts(&request.counts);
  add_wheels(job);
  send_job();
  keyframe_utime_ = frame->utime;
  result_.keyframe = true;
}

// Samples that no job has had yet, as far back as the history reaches.
void FrontEnd::add_wheels(MappingJob* job) {
  const SampleHistory<WheelSample>& history = wheels_.history();
  std::size_t first = history.size();
  while (first > 0 && history[first - 1].utime > wheels_sent_utime_) --first;
  for (std::size_t i = first; i < history.size(); ++i) job->wheels.push_back(history[i]);
  if (history.size() > 0) wheels_sent_utime_ = history[history.size() - 1].utime;
}

void FrontEnd::pose_waiting_frames() {
  MappingJob* job = begin_job(MappingJobKind::kPoseFrames);
  if (job == nullptr) return;  // with the next frame
  job->frames.assign(waiting_.begin(), waiting_.end());
  job->last_before_map = last_before_map_;
  job->view = tracker_.shared_view();
  tracker_.last_seen(&job->seen);
  send_job();
  waiting_.clear();
}

void FrontEnd::finish() {
  if (!waiting_.empty() && state_ != State::kInitialising && tracker_.view() != nullptr)
    pose_waiting_frames();
}

void FrontEnd::take_counts() {
  while (const MappingReply* reply = port_.take_reply(intake_.utime(), {.by_delay = false})) {
    note_counts(*reply);
    port_.release_reply();
  }
}

void FrontEnd::release_frames() {
  intake_.release();
}

// --- the result of a frame

RecordedFrame FrontEnd::relative_to_reference(const Frame& frame, const TrackOutcome& outcome) const {
  return {frame.utime, map_id_, tracker_.view()->reference_id,
          tracker_.view()->S_world_reference().inverse() * outcome.T_world_body};
}

void FrontEnd::record(const RecordedFrame& frame) {
  if (!port_.record(frame)) ++counts_.frames_not_recorded;
}

void FrontEnd::fill_map_state() {
  result_.state = state_;
  result_.map_id = map_id_;
  result_.reset_counter = odometry_.reset_counter();
}

// Where there is a metre, the lever arm from the tracked body to the calibration's holds.
void FrontEnd::place_body() {
  if (!result_.has_pose || result_.scale != ScaleState::kMetric || points_.body_m.isZero(0.0)) return;
  const SE3 T_tracked_body{Eigen::Quaterniond::Identity(), points_.body_m};
  result_.T_map_body = result_.T_map_body * T_tracked_body;
  result_.T_odom_body = result_.T_odom_body * T_tracked_body;
  Matrix6d carry = Matrix6d::Identity();
  carry.topRightCorner<3, 3>() = -skew(points_.body_m);
  result_.velocity_body = carry * result_.velocity_body;
  for (Matrix6d* m : {&result_.covariance, &result_.velocity_covariance, &result_.odometry.noise})
    *m = carry * *m * carry.transpose();  // the drift, in odom's axes, is that of any point of the body
}

void FrontEnd::fill_pose(const SE3& T_map_body, const Matrix6d& covariance) {
  odometry_.advance(T_map_body, result_.utime, std::sqrt(covariance.topLeftCorner<3, 3>().trace()));
  posed_utime_ = result_.utime;
  result_.has_pose = true;
  result_.T_map_body = T_map_body;
  note_metre();
  result_.T_odom_body = odometry_.T_odom_body();
  result_.map_from_odom = odometry_.map_from_odom(T_map_body);
  const double unit = 1.0 / result_.map_from_odom.scale;
  result_.velocity_body = tracker_.velocity().velocity();
  result_.velocity_body.head<3>() *= unit;
  fill_errors();
}

void FrontEnd::note_metre() {
  if (tracker_.view() == nullptr) return;
  const MapJudgement& judgement = tracker_.view()->judgement;
  result_.wheels = judgement.wheels;
  result_.metre = judgement.metre();
  if (judgement.metric) result_.scale = ScaleState::kMetric;
}

// Of a pose that adds a frame's motion. One that is held adds none.
void FrontEnd::note_errors() {
  const LocalView& view = *tracker_.view();
  OdometryStep step;
  step.T_odom_body = result_.T_odom_body;
  step.utime = result_.utime;
  step.map_units = result_.map_from_odom.scale;
  step.correction = odometry_.correction();
  step.view_sequence = view.sequence;
  step.metric = view.judgement.metric;
  step.unit_sigma = view.judgement.unit_sigma;
  uncertainty_.advance(step, tracker_.pose_errors());
  fill_errors();
}

void FrontEnd::fill_errors() {
  const PoseErrors& errors = tracker_.pose_errors();
  result_.covariance = errors.known ? errors.noise : unknown_covariance();
  result_.odometry = uncertainty_.errors();
  result_.velocity_covariance = in_unit(tracker_.velocity().covariance(), 1.0 / result_.map_from_odom.scale);
  if (!std::isfinite(result_.odometry.scale_sigma)) return;
  const Eigen::Vector3d of_scale = result_.odometry.scale_sigma * result_.velocity_body.head<3>();
  result_.velocity_covariance.topLeftCorner<3, 3>() += of_scale * of_scale.transpose();
}

std::vector<std::pair<std::string, std::size_t>> FrontEnd::memory_table() const {
  auto table = intake_.memory_table();
  table.emplace_back("tracker", tracker_.bytes());
  table.emplace_back("initialiser", initialiser_.bytes());
  table.emplace_back("repeated features", repeated_.bytes());
  table.emplace_back("sensor samples", imu_.bytes() + wheels_.bytes());
  return table;
}

}  // namespace farpoint::slam
