// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping_rings.h"

#include "slam/tracking/initialiser.h"

namespace farpoint::slam {

namespace {

// A job as large as any.
MappingJob largest_job(const EstimatorConfig& config) {
  const auto features = static_cast<std::size_t>(config.extractor.features);
  MappingJob job;
  // Touched, not only reserved: no page fault after the start.
  job.pair.points.resize(features);
  job.keyframe.sightings.resize(features);
  job.keyframe.counts.resize(static_cast<std::size_t>(config.capacity.landmarks));
  job.frames.resize(Initialiser::kHistoryFrames);
  job.seen.resize(features);
  job.wheels.resize(kWheelsKept);
  return job;
}

}  // namespace

void MappingJob::clear() {
  pair.first.reset();
  pair.second.reset();
  pair.points.clear();
  keyframe.frame.reset();
  keyframe.sightings.clear();
  keyframe.counts.clear();
  frames.clear();
  view.reset();
  seen.clear();
  wheels.clear();
}

KeptFrame::KeptFrame(const RecordedFrame& frame)
    : utime(frame.utime), map_id(frame.map_id), reference_id(static_cast<std::uint32_t>(frame.reference_id)) {
  const SE3& T = frame.T_reference_body;
  Eigen::Map<Eigen::Vector4f>(q_.data()) = T.q.coeffs().cast<float>();
  Eigen::Map<Eigen::Vector3f>(t_.data()) = T.t.cast<float>();
}

SE3 KeptFrame::T_reference_body() const {
  const Eigen::Vector4d q = Eigen::Map<const Eigen::Vector4f>(q_.data()).cast<double>();
  return {Eigen::Quaterniond(q).normalized(), Eigen::Map<const Eigen::Vector3f>(t_.data()).cast<double>()};
}

MappingRings::MappingRings(const EstimatorConfig& config)
    : jobs(kJobs, largest_job(config)), replies(kReplies), recorded(kRecords) {
  // Copies of the largest job have its sizes; clear() keeps the memory.
  for (std::size_t i = 0; i < kJobs; ++i) {
    jobs.begin_push()->clear();
    jobs.end_push();
  }
  for (std::size_t i = 0; i < kJobs; ++i) jobs.pop();
}

std::size_t MappingRings::bytes() const {
  const MappingJob& job = jobs.sample();
  const std::size_t job_bytes = sizeof(MappingJob) + job.pair.points.capacity() * sizeof(InitialPoint) +
                                job.keyframe.sightings.capacity() * sizeof(Sighting) +
                                job.keyframe.counts.capacity() * sizeof(SightingCount) +
                                job.frames.capacity() * sizeof(std::shared_ptr<Frame>) +
                                job.seen.capacity() * sizeof(LandmarkHandle);
  return kJobs * job_bytes + kReplies * sizeof(MappingReply) + kRecords * sizeof(RecordedFrame);
}

}  // namespace farpoint::slam
