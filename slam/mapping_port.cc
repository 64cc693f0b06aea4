// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping_port.h"

#include <cmath>

namespace farpoint::slam {

namespace {

std::int64_t microseconds(double ms) {
  return static_cast<std::int64_t>(std::llround(1000.0 * ms));
}

}  // namespace

MappingPort::MappingPort(const MappingConfig& config, MappingRings* rings)
    : config_(config), rings_(*rings) {}

MappingJob* MappingPort::begin_job(MappingJobKind kind, const JobOrigin& origin) {
  // Replies not taken yet count as under way, or their ring could overflow.
  if (jobs_under_way_ == MappingRings::kJobs) return nullptr;
  MappingJob* job = rings_.jobs.begin_push();
  if (job == nullptr) return nullptr;
  job->kind = kind;
  job->number = jobs_ + 1;
  job->frame_number = origin.frame_number;
  job->utime = origin.utime;
  job->map_id = origin.map_id;
  return job;
}

std::uint64_t MappingPort::send_job() {
  ++jobs_;
  ++jobs_under_way_;
  rings_.jobs.end_push();
  return jobs_;
}

bool MappingPort::is_due(const MappingReply& reply, std::int64_t utime, const ReplyLimit& limit) const {
  if (!limit.by_delay) return reply.number <= limit.up_to;
  double delay_ms = 0.0;
  if (reply.stage == MappingStage::kStarted || reply.stage == MappingStage::kQuick)
    delay_ms = config_.quick_view_delay_ms;
  if (reply.stage == MappingStage::kFull) delay_ms = config_.full_view_delay_ms;
  return reply.utime + microseconds(delay_ms) <= utime;
}

const MappingReply* MappingPort::take_reply(std::int64_t utime, const ReplyLimit& limit) {
  const MappingReply* reply = rings_.replies.front();
  if (reply == nullptr || !is_due(*reply, utime, limit)) return nullptr;
  replies_taken_ = reply->number;
  if (reply->ends_job) --jobs_under_way_;
  return reply;
}

void MappingPort::release_reply() {
  // The slot would keep the view from its pool.
  rings_.replies.front()->view.reset();
  rings_.replies.pop();
}

void MappingPort::give_up_map() {
  first_job_of_map_ = jobs_ + 1;
}

}  // namespace farpoint::slam
