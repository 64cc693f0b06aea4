// SPDX-License-Identifier: Apache-2.0
#include "slam/back_end.h"

#include <algorithm>

namespace farpoint::slam {

BackEnd::BackEnd(const EstimatorConfig& config, const Rig& rig, MappingRings* rings,
                 const VehiclePoints& points)
    : config_(config),
      points_(points),
      rings_(*rings),
      wheels_(config.wheels, points.wheels_m),
      mapper_(config, rig),
      poser_(config, static_cast<int>(rig.cameras.size())) {
  if (config.wheels.use) mapper_.use_motion(&wheels_);
}

void BackEnd::collect_recorded() {
  while (const RecordedFrame* frame = rings_.recorded.front()) {
    if (config_.capacity.whole_trajectory) recorded_.emplace_back(*frame);
    rings_.recorded.pop();
  }
}

bool BackEnd::step() {
  MappingJob* job = rings_.jobs.front();
  if (job == nullptr) return false;
  const StageSpan span(listener_, Stage::kMapping);
  collect_recorded();
  // There is room: a job has two replies at most, and tracking sends no more jobs than have room for theirs.
  reply_ = rings_.replies.begin_push();
  reply_->number = ++replies_;
  reply_->job_number = job->number;
  reply_->frame_number = job->frame_number;
  reply_->utime = job->utime;
  reply_->stage = MappingStage::kDone;
  reply_->ends_job = true;
  if (!inserted_) wheels_.add(job->wheels);
  switch (job->kind) {
    case MappingJobKind::kStartMap:
      reply_->stage = MappingStage::kStarted;
      reply_->view = mapper_.start_map(job->pair, job->map_id);
      break;
    case MappingJobKind::kKeyframe:
      reply_->view = inserted_ ? mapper_.refine() : mapper_.insert(job->keyframe);
      if (inserted_ || reply_->view) reply_->stage = inserted_ ? MappingStage::kFull : MappingStage::kQuick;
      inserted_ = reply_->stage == MappingStage::kQuick;
      reply_->ends_job = !inserted_;
      break;
    case MappingJobKind::kPoseFrames:
      pose_frames(*job);
      break;
    case MappingJobKind::kDiscardMap:
      discard_map(job->map_id);
      break;
    case MappingJobKind::kRetireMap:
      mapper_.retire_map(job->map_id);
      break;
  }
  reply_->counts = mapper_.counts();
  reply_->keyframes = static_cast<std::uint32_t>(mapper_.map().keyframes().size());
  reply_->landmarks = static_cast<std::uint32_t>(mapper_.map().landmarks().size());
  return true;
}

void BackEnd::hand_over() {
  if (reply_->ends_job) {
    rings_.jobs.front()->clear();
    rings_.jobs.pop();
  }
  rings_.replies.end_push();
}

void BackEnd::discard_map(std::int32_t map_id) {
  std::erase_if(recorded_, [&](const KeptFrame& r) { return r.map_id == map_id; });
  mapper_.discard_map(map_id);
}

bool BackEnd::pose_frame(const MappingJob& job, const Frame& frame, SE3* prior,
                         std::vector<RecordedFrame>* posed) {
  const TrackOutcome o = poser_.track_from(frame, *prior);
  if (!o.ok || o.inliers < config_.tracking.min_inliers) return false;
  *prior = o.T_world_body;
  posed->push_back({frame.utime, job.map_id, job.view->reference_id,
                    job.view->S_world_reference().inverse() * o.T_world_body});
  return true;
}

// Pose of a keyframe, in the unit of a view that may be older than the map's present unit.
bool BackEnd::pose_in_view(const LocalView& view, std::uint64_t keyframe_id, SE3* T_view_body) const {
  const Map& map = mapper_.map();
  Sim3 S_world_reference;
  if (!map.similarity_of(view.reference_id, &S_world_reference)) return false;
  SE3 T;
  if (!map.pose_of(keyframe_id, &T)) return false;
  if (S_world_reference.scale != view.reference_scale)
    T = view.S_world_reference() * (S_world_reference.inverse() * T);
  *T_view_body = T;
  return true;
}

// Frames from before the map: backwards from the pair that began it, and forwards those that came while the
// map was being made.
void BackEnd::pose_frames(const MappingJob& job) {
  const auto first = std::find_if(recorded_.begin(), recorded_.end(),
                                  [&](const KeptFrame& r) { return r.map_id == job.map_id; });
  SE3 T_view_first;
  if (first == recorded_.end() || !pose_in_view(*job.view, first->reference_id, &T_view_first)) return;
  poser_.adopt(job.view, job.seen);
  std::vector<const Frame*> frames;
  for (const auto& f : job.frames) frames.push_back(f.get());
  std::stable_sort(frames.begin(), frames.end(),
                   [](const Frame* a, const Frame* b) { return a->number > b->number; });
  std::vector<RecordedFrame> posed;
  SE3 prior = T_view_first;
  for (const Frame* f : frames)
    if (f->number < job.last_before_map) (void)pose_frame(job, *f, &prior, &posed);
  // The pair's second frame was recorded next, and stands at the second keyframe.
  if (const auto second = std::next(first); second != recorded_.end())
    (void)pose_in_view(*job.view, second->reference_id, &prior);
  std::for_each(frames.rbegin(), frames.rend(), [&](const Frame* f) {
    if (f->number > job.last_before_map) (void)pose_frame(job, *f, &prior, &posed);
  });
  poser_.adopt(nullptr, {});
  for (const RecordedFrame& frame : posed) recorded_.emplace_back(frame);
}

}  // namespace farpoint::slam
