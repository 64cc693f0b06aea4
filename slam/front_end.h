// Tracking's half of the estimator: frames in, poses out, jobs for mapping. Waits for nobody, and makes no
// heap call once a map has settled (finding the first map may: two-view geometry has no fixed size).
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "slam/estimator.h"
#include "slam/exchange.h"
#include "slam/image/extractor.h"
#include "slam/image/pyramid.h"
#include "slam/map/shared_pool.h"
#include "slam/tracking/initialiser.h"
#include "slam/tracking/keyframe_policy.h"
#include "slam/tracking/tracker.h"

namespace farpoint::slam {

// Which of mapping's replies a frame may take.
struct ReplyLimit {
  // Lockstep: those that are due by the configured delays. Else by number.
  bool by_delay = true;
  std::uint64_t up_to = ~std::uint64_t{0};  // number of the last one
};

class TrackingSide {
 public:
  TrackingSide(const EstimatorConfig& config, const Rig& rig, Exchange* exchange);

  void listen(StageListener* listener);

  const FrameResult& track(const FrameInput& input, const ReplyLimit& limit);
  const FrameResult& track(FeatureInput&& input, const ReplyLimit& limit);
  // Lockstep, after mapping has worked on what the frame asked for: replies that cost no frame.
  const FrameResult& take_replies_at_once();
  // At the end: asks mapping for the frames that still wait for a pose; then, when mapping has done it, takes
  // its last counts.
  void finish();
  // No frame can be processed afterwards.
  void release_frames();
  void take_counts();

  [[nodiscard]] const EstimatorCounts& counts() const { return counts_; }
  // Bytes of every pool and work space.
  [[nodiscard]] std::vector<std::pair<std::string, std::size_t>> memory_table() const;

 private:
  // A pyramid with its FrameImage face.
  struct PyramidFrame;

  bool acceptable(std::int64_t utime, int camera_index);
  const FrameResult& reject(std::int64_t utime);
  [[nodiscard]] std::shared_ptr<Frame> take_frame(std::int64_t utime, std::int64_t sequence,
                                                  int camera_index);
  const FrameResult& step(const std::shared_ptr<Frame>& frame, const ReplyLimit& limit);

  [[nodiscard]] bool is_due(const MappingReply& reply, std::uint64_t frame_number,
                            const ReplyLimit& limit) const;
  void take_replies(std::uint64_t frame_number, const ReplyLimit& limit);
  void take(const MappingReply& reply);
  void note_counts(const MappingReply& reply);
  void take_view(std::shared_ptr<const LocalView> view);
  void begin_map(const MappingReply& reply);
  [[nodiscard]] bool mapping_is_free(std::uint64_t frame_number) const;
  // The next job's slot; null where mapping has as many as it may have.
  [[nodiscard]] MappingJob* begin_job(MappingJobKind kind);
  void end_job();

  void initialise(const std::shared_ptr<Frame>& frame);
  void see_nothing();
  void note_interval(std::int64_t utime);
  [[nodiscard]] bool after_gap(std::int64_t utime) const;
  void follow(const std::shared_ptr<Frame>& frame);
  void try_out(const Frame& frame, const TrackOutcome& outcome);
  void go_on(const std::shared_ptr<Frame>& frame, const TrackOutcome& outcome);
  void lose(const std::shared_ptr<Frame>& frame);
  void maybe_keyframe(const std::shared_ptr<Frame>& frame, const TrackOutcome& outcome);
  void pose_waiting();
  [[nodiscard]] RecordedFrame place(const Frame& frame, const TrackOutcome& outcome) const;
  void record(const RecordedFrame& frame);
  void fill_pose(const SE3& T_map_body, const Matrix6d& covariance);

  const EstimatorConfig config_;
  const Rig rig_;
  const Camera& camera_;
  Exchange& exchange_;
  Extractor extractor_;
  SharedPool<Frame> frames_;
  SharedPool<PyramidFrame> pyramids_;
  Initialiser initialiser_;
  Tracker tracker_;
  StageListener* listener_ = nullptr;

  State state_ = State::kInitialising;
  EstimatorCounts counts_;
  FrameResult result_;
  std::uint64_t frame_number_ = 0;  // of the next frame
  std::int64_t last_utime_ = 0;
  bool any_frame_ = false;
  std::uint64_t image_hash_ = 0;  // of the last image

  std::int32_t map_id_ = 0;
  std::uint64_t jobs_ = 0;              // sent
  std::size_t jobs_under_way_ = 0;      // sent and not ended by a reply that was taken
  std::uint64_t first_job_of_map_ = 1;  // replies to older ones are of a map that was given up
  std::uint64_t busy_until_frame_ = 0;  // lockstep: a new map's first view costs mapping so long
  std::shared_ptr<Frame> start_first_, start_second_;  // the pair that a map is being made from
  int frames_since_keyframe_ = 0;
  int lost_frames_ = 0;  // that were searched in vain
  std::int64_t lost_since_utime_ = 0;
  std::optional<RecordedFrame> trial_;  // a place found again, which the next frame has to bear out
  // Of frames that showed something.
  static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::min();
  std::int64_t seen_utime_ = kNever, interval_us_ = 0;
  bool settled_ = false;
  // Frames from before the map, posed once it has settled.
  std::vector<std::shared_ptr<Frame>> waiting_;
  std::uint64_t last_before_map_ = 0;

  // odom: integrates relative motion in the present unit.
  SE3 T_odom_body_;
  SE3 T_map_body_last_;
  bool has_last_ = false;
  std::uint32_t resets_ = 0;
};

}  // namespace farpoint::slam
