// The facade of the estimator: frames in, poses out. No I/O, no threads, no clock, no logging, no globals.
//
// Two halves that share nothing but fixed rings: tracking (slam/front_end.h) and mapping
// (slam/back_end.h). Who runs them is the caller's choice:
//   lockstep  process() tracks one frame, runs the mapping jobs it asked for, and takes their results a
//             configured number of frames later, as a real-time run would;
//   threads   track() on one thread, map() on another; a frame takes what mapping has ready;
//   recorded  process_recorded() repeats a run of threads: each frame takes what it took then.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "slam/config.h"
#include "slam/image/extractor.h"
#include "slam/stages.h"

namespace farpoint::slam {

enum class State : std::uint8_t {
  kStarting = 0,
  kInitialising = 1,
  kSettling = 2,
  kTracking = 3,
  kDegraded = 4,
  kLost = 5,
  kRelocalising = 6,
  kNoCamera = 7,
};
[[nodiscard]] const char* to_string(State state);
// Only these poses count as valid.
[[nodiscard]] inline bool is_valid(State state) {
  return state == State::kTracking || state == State::kDegraded;
}

enum class ScaleState : std::uint8_t { kUnknown = 0, kAssumed = 1, kMetric = 2 };

// One image of one camera.
struct FrameInput {
  std::int64_t utime = 0;  // mid-exposure, microseconds
  std::int64_t sequence = 0;
  int camera = 0;
  ImageView image;
  // Where time is short: fewer features than configured.
  int most_features = Extractor::kAllFeatures;
};

// Features measured elsewhere: the feature-level simulator's way in. `image` must outlive the estimator's use
// of the frame, hence shared.
struct FeatureInput {
  std::int64_t utime = 0;
  std::int64_t sequence = 0;
  int camera = 0;
  FeatureSet features;
  std::shared_ptr<const FrameImage> image;
};

// What is known after one frame. Map units are metres only where scale says so.
struct FrameResult {
  std::int64_t utime = 0;
  std::int64_t sequence = 0;
  State state = State::kStarting;
  bool has_pose = false;  // T_map_body is an estimate (not necessarily valid, see state)
  SE3 T_map_body;
  SE3 T_odom_body;  // continuous: integrates relative motion, never jumps
  Sim3 map_from_odom;
  Vector6d velocity_body = Vector6d::Zero();  // m/s (map units/s), rad/s in body axes
  Matrix6d covariance = Matrix6d::Zero();     // of T_map_body, order (translation, rotation), body axes
  int quality = -1;                           // -1 unknown, 0..100
  std::uint32_t reset_counter = 0;
  ScaleState scale = ScaleState::kUnknown;
  std::int32_t map_id = 0;
  std::uint64_t view_sequence = 0;  // local-map view this frame was tracked against
  int features = 0, matches = 0, inliers = 0, aligned = 0;
  bool keyframe = false;            // sent to mapping
  std::uint64_t replies_taken = 0;  // of mapping, since the start: what the frame knew of the map
  std::uint64_t job = 0;            // number of the last job it gave to mapping, 0: none
  int jobs_under_way = 0;           // mapping's queue, the job being worked on included

  // Tracked against a map that had been there before the frame: what tracking's times are about.
  [[nodiscard]] bool followed() const { return view_sequence > 0 && state != State::kInitialising; }
};

// Counts over the whole run and of the present map.
struct EstimatorCounts {
  std::uint64_t frames = 0, frames_rejected = 0, keyframes_made = 0, keyframes_culled = 0, maps = 0, lost = 0;
  // Because the map was full. The keyframes are among the culled ones.
  std::uint64_t keyframes_forgotten = 0, landmarks_forgotten = 0;
  std::uint64_t keyframes_dropped = 0;    // wanted, and not made because mapping was behind
  std::uint64_t frames_not_recorded = 0;  // missing in the final trajectory: mapping was far behind
  std::uint64_t landmarks_made = 0, landmarks_culled = 0, landmarks_fused = 0;
  std::uint64_t vmp_made = 0, vmp_attached = 0, vmp_merged = 0, vmp_promoted = 0, vmp_rejected = 0,
                vmp_evicted = 0;
  std::uint64_t local_ba = 0;
  std::uint32_t keyframes = 0, landmarks = 0, vmps = 0;  // alive now
  bool calibration_contradicted = false;  // now: the images say that camera 0's is wrong, no pose is valid
};

struct PosedFrame {
  std::int64_t utime = 0;
  SE3 T_map_body;
};

// One map's frames, posed through their reference keyframes after the last optimisation, ascending in time.
struct MapTrajectory {
  std::int32_t map_id = 0;
  std::vector<PosedFrame> frames;
};

// One landmark for statistics and pictures.
struct LandmarkInfo {
  std::uint64_t id = 0;
  std::int32_t map_id = 0;
  Eigen::Vector3d position_map = Eigen::Vector3d::Zero();  // map units
  double inverse_depth = 0, inverse_depth_sigma = 0;       // 1/map units, at the host
  double creation_depth = 0;  // distance from the newest observing keyframe when it was made, map units
  double creation_relative_sigma = 0;  // sigma(depth)/depth then
  bool through_vmp = false;
  bool full = false;  // else bearing or weak
  int observations = 0;
  // Where its bearing comes from: the first frame that saw it, the pixel there, and that camera's centre.
  std::int64_t anchor_utime = 0;
  int anchor_camera = 0;
  Eigen::Vector2d anchor_pixel = Eigen::Vector2d::Zero();
  Eigen::Vector3d anchor_map = Eigen::Vector3d::Zero();  // map units
  std::int64_t created_utime = 0;  // of the keyframe at which it became a point; bearings: when it was made
  std::uint64_t tag = 0;           // simulator: which true point the host patch shows; 0 elsewhere
  std::uint32_t slot = 0, generation = 0;  // where the map keeps it (Estimator::sightings)
};

// Where a keyframe saw a landmark.
struct LandmarkSighting {
  std::int64_t utime = 0;
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  // level-0 pixel
};

// Camera 0's calibration as refined from the map, relative to the given one; zero where refinement is off.
struct CalibrationInfo {
  double focal_scale = 0, cx_px = 0, cy_px = 0, k1 = 0;  // focal_scale: log of the factor
  double focal_scale_sigma = 0, cx_sigma_px = 0, cy_sigma_px = 0, k1_sigma = 0;  // 1 sigma
  bool contradicted = false;
  double focal_scale_of_images = 0;  // without the given one's say
};

// A view that mapping has made.
struct MappingNote {
  std::uint64_t reply = 0;  // a frame with replies_taken of at least this has taken it
  std::int64_t utime = 0;   // of the frame that asked for it
  std::int32_t map_id = 0;
  bool full = false;  // after local bundle adjustment
};

class Estimator {
 public:
  // Allocates everything. Throws std::invalid_argument with a sentence a user can act on where the
  // configuration or the rig cannot work.
  Estimator(const EstimatorConfig& config, const Rig& rig);
  ~Estimator();
  Estimator(const Estimator&) = delete;
  Estimator& operator=(const Estimator&) = delete;

  // Tracks one frame. A frame that cannot be used (wrong size, time not after the last frame's) is counted in
  // counts().frames_rejected; the result then repeats the last state without a pose.
  const FrameResult& process(const FrameInput& input);
  const FrameResult& process(FeatureInput&& input);

  // Announces the stages of every later frame; null: to nobody. The listener must outlive its use, and is
  // called on the thread that does the work: for one thread only.
  void listen(StageListener* listener);

  // Threads. track() is process() without mapping. map() works on the oldest job up to its next reply; false
  // where no job waits (FrameResult::job says when one was given).
  const FrameResult& track(const FrameInput& input);
  bool map();

  // Repeats one frame of a run of threads: mapping works until it has given so many replies, and the frame
  // takes them all (FrameResult::replies_taken). Where mapping runs out of jobs before, the run is another:
  // the result's replies_taken is then smaller.
  const FrameResult& process_recorded(const FrameInput& input, std::uint64_t replies_taken);

  // Is called when mapping has made a view, on mapping's thread, before tracking can take it. landmarks() and
  // keyframe_poses() may be called then.
  void on_view(std::function<void(const MappingNote&)> observer);

  // Finishes what mapping had queued; no extra optimisation. Threads must have ended.
  void finish();
  // After finish(): gives up the frames and images that wait to be filled, so that what is made of the run
  // needs no more memory than the run did. No frame can be processed afterwards.
  void release_frames();

  // As of the last frame; tracking's thread. After finish(): of the whole run.
  [[nodiscard]] const EstimatorCounts& counts() const;
  // What follows belongs to mapping's thread, or to anyone while no thread runs.
  // All maps, most frames first.
  [[nodiscard]] std::vector<MapTrajectory> trajectories() const;
  [[nodiscard]] std::vector<LandmarkInfo> landmarks() const;
  // Calls visit(distance, relative_sigma) for every observation of the final maps' full landmarks:
  // camera-to-point distance in map units.
  void visit_observation_distances(
      const std::function<void(std::int32_t map_id, double distance)>& visit) const;
  // By ascending keyframe; empty where the landmark has gone since landmarks() told of it.
  [[nodiscard]] std::vector<LandmarkSighting> sightings(const LandmarkInfo& landmark) const;
  [[nodiscard]] std::vector<SE3> keyframe_poses() const;
  [[nodiscard]] CalibrationInfo calibration() const;
  // Bytes of every pool, for the table printed at start.
  [[nodiscard]] std::vector<std::pair<std::string, std::size_t>> memory_table() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace farpoint::slam
