#include "slam/exchange.h"

#include "slam/tracking/initialiser.h"

namespace farpoint::slam {

namespace {

// A job with room for the largest of its kinds.
MappingJob roomy_job(const EstimatorConfig& config) {
  const auto features = static_cast<std::size_t>(config.extractor.features);
  MappingJob job;
  // Touched, not only reserved: a page that is first used on the road is a page fault on the road.
  job.pair.points.resize(features);
  job.keyframe.sightings.resize(features);
  job.keyframe.counts.resize(static_cast<std::size_t>(config.capacity.landmarks));
  job.frames.resize(Initialiser::kHistoryFrames);
  job.seen.resize(features);
  return job;
}

void empty(MappingJob* job) {
  job->pair.points.clear();
  job->keyframe.sightings.clear();
  job->keyframe.counts.clear();
  job->frames.clear();
  job->seen.clear();
}

}  // namespace

Exchange::Exchange(const EstimatorConfig& config)
    : jobs(kJobs, roomy_job(config)), replies(kReplies), recorded(kRecords) {
  // Copies of the roomy job have its sizes; clearing keeps the memory.
  for (std::size_t i = 0; i < kJobs; ++i) {
    empty(jobs.begin_push());
    jobs.end_push();
  }
  for (std::size_t i = 0; i < kJobs; ++i) jobs.pop();
}

std::size_t Exchange::bytes() const {
  const MappingJob& job = jobs.sample();
  const std::size_t job_bytes = sizeof(MappingJob) + job.pair.points.capacity() * sizeof(InitialPoint) +
                                job.keyframe.sightings.capacity() * sizeof(Sighting) +
                                job.keyframe.counts.capacity() * sizeof(SightingCount) +
                                job.frames.capacity() * sizeof(std::shared_ptr<Frame>) +
                                job.seen.capacity() * sizeof(LandmarkHandle);
  return kJobs * job_bytes + kReplies * sizeof(MappingReply) + kRecords * sizeof(RecordedFrame);
}

}  // namespace farpoint::slam
