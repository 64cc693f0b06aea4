// SPDX-License-Identifier: Apache-2.0
// Tracking's end of the rings to mapping: which jobs are sent, which replies are due. Never waits.
#pragma once

#include <cstdint>

#include "slam/config.h"
#include "slam/mapping_rings.h"

namespace farpoint::slam {

// Which of mapping's replies a frame may take.
struct ReplyLimit {
  // Lockstep: those that are due by the configured delays. Else by number.
  bool by_delay = true;
  std::uint64_t up_to = ~std::uint64_t{0};  // number of the last one
};

// The frame that sends a job.
struct JobOrigin {
  std::uint64_t frame_number = 0;
  std::int64_t utime = 0;
  std::int32_t map_id = 0;
};

class MappingPort {
 public:
  MappingPort(const MappingConfig& config, MappingRings* rings);

  // The next job's slot, its head filled in, empty otherwise. Null while as many jobs are under way as the
  // ring of replies has room for. A job that is not sent costs nothing.
  [[nodiscard]] MappingJob* begin_job(MappingJobKind kind, const JobOrigin& origin);
  // Sends it. Returns its number.
  std::uint64_t send_job();

  // The oldest reply that the frame at `utime` may take; null where none is due. In use until
  // release_reply(). Each reply is given once.
  [[nodiscard]] const MappingReply* take_reply(std::int64_t utime, const ReplyLimit& limit);
  void release_reply();
  // False for a reply to a job of a map that was given up.
  [[nodiscard]] bool is_of_present_map(const MappingReply& reply) const {
    return reply.job_number >= first_job_of_map_;
  }

  // Whether mapping would begin a job at once: only then is a keyframe sent.
  [[nodiscard]] bool is_free() const { return jobs_under_way_ == 0; }
  // The present map is given up: replies to the jobs sent so far are of a map that is gone.
  void give_up_map();

  // False where the ring is full: the frame is missing in the final trajectory.
  [[nodiscard]] bool record(const RecordedFrame& frame) { return rings_.recorded.push(frame); }

  [[nodiscard]] std::uint64_t replies_taken() const { return replies_taken_; }
  // Sent, and not ended by a reply that was taken.
  [[nodiscard]] std::size_t jobs_under_way() const { return jobs_under_way_; }

 private:
  [[nodiscard]] bool is_due(const MappingReply& reply, std::int64_t utime, const ReplyLimit& limit) const;

  const MappingConfig config_;
  MappingRings& rings_;
  std::uint64_t jobs_ = 0;  // sent
  std::size_t jobs_under_way_ = 0;
  std::uint64_t first_job_of_map_ = 1;
  std::uint64_t replies_taken_ = 0;
};

}  // namespace farpoint::slam
