// SPDX-License-Identifier: Apache-2.0
// Jobs from tracking to mapping, replies back, and the fixed rings between them. Neither side waits.
//
// Tracking sends jobs and, one a posed frame, that frame's pose. Mapping answers every job with one or two
// replies, in order. A frame depends on mapping only through the number of replies taken before it, so that a
// list of these numbers repeats a run.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "slam/config.h"
#include "slam/map/local_view.h"
#include "slam/map/request.h"
#include "slam/mapping/counts.h"
#include "slam/measurement.h"
#include "slam/spsc_ring.h"

namespace farpoint::slam {

// Wheel samples that tracking keeps, and most in one job: five seconds at 100 Hz.
inline constexpr std::size_t kWheelsKept = 512;

enum class MappingJobKind : std::uint8_t {
  kStartMap,    // from two views; one reply
  kKeyframe,    // quick view, then full view
  kPoseFrames,  // frames from before the map; one reply without a view
  kDiscardMap,  // one reply without a view
  kRetireMap,   // one reply without a view
};

struct MappingJob {
  MappingJobKind kind = MappingJobKind::kKeyframe;
  std::uint64_t number = 0;        // from 1
  std::uint64_t frame_number = 0;  // of the frame that asked for it
  std::int64_t utime = 0;          // of that frame
  std::int32_t map_id = 0;
  InitialPair pair;          // kStartMap
  KeyframeRequest keyframe;  // kKeyframe
  // kPoseFrames: the frames, the view to pose them against, and the landmarks that the newest frame saw.
  std::vector<std::shared_ptr<Frame>> frames;
  std::uint64_t last_before_map = 0;  // number of the second frame of the pair that began the map
  std::shared_ptr<const LocalView> view;
  std::vector<LandmarkHandle> seen;
  // kStartMap, kKeyframe: wheel samples that tracking has taken since the last such job.
  std::vector<WheelSample> wheels;

  // Gives frames and views back to their pools, and empties every list. Keeps the lists' memory.
  void clear();
};

enum class MappingStage : std::uint8_t {
  kStarted,  // the first view of a map; null where the structure did not hold
  kQuick,    // new landmarks, poses not yet optimised
  kFull,     // after local BA
  kDone,     // no view: the job was of another kind, or the keyframe could not be used
};

struct MappingReply {
  std::uint64_t number = 0;  // from 1
  std::uint64_t job_number = 0;
  std::uint64_t frame_number = 0;  // of the job
  std::int64_t utime = 0;          // of the job
  MappingStage stage = MappingStage::kDone;
  bool ends_job = false;
  std::shared_ptr<const LocalView> view;
  MappingCounts counts;
  std::uint32_t keyframes = 0, landmarks = 0;  // alive
};

// A frame's pose relative to a keyframe, in the keyframe's own unit (Keyframe::S_world_body): it follows the
// keyframe through every later optimisation and change of unit.
struct RecordedFrame {
  std::int64_t utime = 0;
  std::int32_t map_id = 0;
  std::uint64_t reference_id = 0;
  SE3 T_reference_body;
};

// A recorded frame in half the room, kept to the end of a run. Single precision turns it by up to 6e-8 rad
// and moves it by 6e-8 of its way from the keyframe: thousandths of any pose's sigma.
class KeptFrame {
 public:
  explicit KeptFrame(const RecordedFrame& frame);

  std::int64_t utime;
  std::int32_t map_id;
  std::uint32_t reference_id;  // a keyframe's: 4 billion of them take 13 years at 10 a second
  [[nodiscard]] SE3 T_reference_body() const;

 private:
  std::array<float, 4> q_;  // x, y, z, w
  std::array<float, 3> t_;
};

struct MappingRings {
  // Jobs that may be under way at once: one keyframe at most, and room for the rarer kinds.
  static constexpr std::size_t kJobs = 4;
  static constexpr std::size_t kReplies = 2 * kJobs;
  // Frames tracked while mapping works on one job: far more than one job's time.
  static constexpr std::size_t kRecords = 1024;

  explicit MappingRings(const EstimatorConfig& config);
  [[nodiscard]] std::size_t bytes() const;

  SpscRing<MappingJob> jobs;         // tracking -> mapping
  SpscRing<MappingReply> replies;    // mapping -> tracking
  SpscRing<RecordedFrame> recorded;  // tracking -> mapping
};

}  // namespace farpoint::slam
