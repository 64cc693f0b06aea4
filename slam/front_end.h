// SPDX-License-Identifier: Apache-2.0
// Tracking's half of the estimator: frames in, poses out, jobs for mapping. Never waits. Makes no heap call
// after construction while frames and views keep to the configured capacities.
//
// The order of one frame's work is here. Its parts: FrameIntake makes the frame, MappingPort exchanges jobs
// and replies, Recovery decides what a lost frame means, Odometry keeps `odom`.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "slam/frame_intake.h"
#include "slam/frame_result.h"
#include "slam/fusion/wheel_way.h"
#include "slam/mapping_port.h"
#include "slam/measurement.h"
#include "slam/odometry.h"
#include "slam/recovery.h"
#include "slam/sample_queue.h"
#include "slam/standstill.h"
#include "slam/tracking/fixed_features.h"
#include "slam/tracking/initialiser.h"
#include "slam/tracking/keyframe_policy.h"
#include "slam/tracking/repeated_features.h"
#include "slam/tracking/tracker.h"
#include "slam/uncertainty.h"
#include "slam/validity.h"
#include "slam/wheel_prior.h"

namespace farpoint::slam {

// What a frame may take of mapping and of the sensors.
struct TakeLimit {
  // Lockstep: replies that are due by the configured delays. Else those up to a number.
  bool replies_by_delay = true;
  FrameTaken up_to = {~std::uint64_t{0}, ~std::uint64_t{0}, ~std::uint64_t{0}};
};

class FrontEnd {
 public:
  FrontEnd(const EstimatorConfig& config, const Rig& rig, MappingRings* rings,
           const VehiclePoints& points = {});

  void listen(StageListener* listener);

  // Any one thread a sensor: queued until a frame takes it. False where the queue is full: the sample is
  // dropped and counted.
  bool add(const ImuSample& sample) { return imu_.add(sample); }
  bool add(const WheelSample& sample) { return wheels_.add(sample); }

  const FrameResult& track(const FrameInput& input, const TakeLimit& limit);
  const FrameResult& track(FeatureInput&& input, const TakeLimit& limit);
  // Lockstep, after mapping has worked on the frame's jobs: takes the replies that are due within the frame.
  const FrameResult& take_replies_at_once();
  // End of the run: asks mapping to pose the frames that still wait for it.
  void finish();
  // After mapping has worked on that: takes its last counts.
  void take_counts();
  // Gives up the pools. No frame can be tracked afterwards.
  void release_frames();

  [[nodiscard]] const EstimatorCounts& counts() const { return counts_; }
  // Samples that the frames so far have taken, the newest ones.
  [[nodiscard]] const SampleHistory<ImuSample>& imu() const { return imu_.history(); }
  [[nodiscard]] const SampleHistory<WheelSample>& wheels() const { return wheels_.history(); }
  // Bytes of every pool and work space.
  [[nodiscard]] std::vector<std::pair<std::string, std::size_t>> memory_table() const;

 private:
  const FrameResult& reject(std::int64_t utime);
  // Why the present frame has no valid pose.
  [[nodiscard]] Refusal refusal_of(const Frame& frame, bool blind) const;
  const FrameResult& step(const std::shared_ptr<Frame>& frame, const TakeLimit& limit);

  void take_samples(const Frame& frame, const FrameTaken& up_to);
  void read_wheels();
  void take_replies(std::int64_t utime, const ReplyLimit& limit);
  void take_reply(const MappingReply& reply);
  void note_counts(const MappingReply& reply);
  void take_view(std::shared_ptr<const LocalView> view);
  void note_judgement();
  void start_map(const MappingReply& reply);
  [[nodiscard]] MappingJob* begin_job(MappingJobKind kind);
  void add_wheels(MappingJob* job);
  void send_job() { result_.job = port_.send_job(); }

  void initialise(const std::shared_ptr<Frame>& frame);
  void start_from(const InitialPair& pair);
  [[nodiscard]] bool may_start_metric(const Frame& frame) const;
  [[nodiscard]] bool replaces_map(const Frame& frame) const;
  void skip_blind_frame(const Frame& frame);
  void hold_pose(const Frame& frame);
  [[nodiscard]] bool stands_still(const Frame& frame, const TrackOutcome& outcome) const;
  [[nodiscard]] std::optional<SE3> unseen_motion(const Frame& frame) const;
  void carry_on(const Frame& frame);
  void fill_carried(const SE3& T_from_to, double dt_s);
  void rejoin_map(const Frame& frame, const SE3& T_map_body);
  void follow(const std::shared_ptr<Frame>& frame);
  TrackOutcome search_for(const Frame& frame, Recovery::Search search);
  void note_relocalised(const Frame& frame, const TrackOutcome& outcome);
  void note_tracked(const std::shared_ptr<Frame>& frame, TrackOutcome outcome);
  void note_lost(const std::shared_ptr<Frame>& frame);
  void look_for_fixed_features(const Frame& frame);
  [[nodiscard]] Refusal explained(const Refusal& refusal) const;
  void give_up_map(MappingJobKind kind, const std::shared_ptr<Frame>& frame);
  void maybe_keyframe(const std::shared_ptr<Frame>& frame, const TrackOutcome& outcome);
  void pose_waiting_frames();
  void fill_map_state();
  void place_body();
  void fill_pose(const SE3& T_map_body, const Matrix6d& covariance);
  void note_metre();
  void note_errors();
  void fill_errors();
  [[nodiscard]] RecordedFrame relative_to_reference(const Frame& frame, const TrackOutcome& outcome) const;
  void record(const RecordedFrame& frame);

  const EstimatorConfig config_;
  const VehiclePoints points_;
  FrameIntake intake_;
  Initialiser initialiser_;
  Tracker tracker_;
  MappingPort port_;
  Recovery recovery_;
  Odometry odometry_;
  Uncertainty uncertainty_;
  Standstill standstill_;
  RepeatedFeatures repeated_;
  double repeated_share_ = 0;  // of the present frame
  FixedFeatures fixed_;
  Validity validity_;
  SampleQueue<ImuSample> imu_;
  SampleQueue<WheelSample> wheels_;
  WheelMotionModel wheel_motion_;
  WheelPrior wheel_prior_{&tracker_, &wheel_motion_};
  std::int64_t wheels_read_utime_ = std::numeric_limits<std::int64_t>::min();  // by wheel_motion_
  std::int64_t wheels_sent_utime_ = std::numeric_limits<std::int64_t>::min();  // to mapping
  StageListener* listener_ = nullptr;

  State state_ = State::kInitialising;
  EstimatorCounts counts_;
  FrameResult result_;
  TrackOutcome last_outcome_;                  // accepted
  std::int64_t posed_utime_ = 0;               // of odom's newest pose
  std::optional<std::int64_t> valid_utime_{};  // of the newest valid pose by images, of this map
  WheelWay carried_;
  bool by_wheels_ = false;  // the present frame has its pose by wheels

  std::int32_t map_id_ = 0;
  // That a map is being made from; the second is null where one frame's cameras are the pair.
  std::pair<std::shared_ptr<Frame>, std::shared_ptr<Frame>> start_pair_;
  // Time of the last frame whose cameras showed too little depth for a map.
  std::optional<std::int64_t> no_depth_utime_;
  std::int64_t keyframe_utime_ = 0;  // of the last keyframe sent
  // Frames from before the map, posed once it has settled.
  std::vector<std::shared_ptr<Frame>> waiting_;
  std::uint64_t last_before_map_ = 0;
};

}  // namespace farpoint::slam
