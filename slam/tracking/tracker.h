// Frame -> pose against an immutable local view. Touches no map, waits for nobody.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "slam/config.h"
#include "slam/geometry/pnp.h"
#include "slam/map/frame.h"
#include "slam/map/local_view.h"
#include "slam/map/predict.h"
#include "slam/stages.h"
#include "slam/tracking/pose_solver.h"

namespace farpoint::slam {

// A view landmark matched to a feature of the present frame.
struct Match {
  std::uint32_t view_index = 0;
  std::int32_t feature = -1;
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();
  float sigma_px = 1.0F;
  bool aligned = false;
  bool inlier = false;
};

struct TrackOutcome {
  bool ok = false;  // a pose that may be used
  SE3 T_world_body;
  Matrix6d covariance = Matrix6d::Zero();
  int matches = 0;                // after the local search
  int inliers = 0, aligned = 0;   // of the final pose
  int reference_inliers = 0;      // inliers among the reference keyframe's landmarks
  double reference_nearness = 0;  // theirs in sum
  int expected = 0;               // landmarks that project into the image
  double median_motion_px = 0;    // of inliers against the reference keyframe, rotation taken out
  double rms = 0;

  // A pose that a third of the matched landmarks contradict is not to be trusted. Rigid scenes show 0.7 and
  // more.
  static constexpr double kMinAgreement = 0.65;
  [[nodiscard]] bool agreed() const { return inliers >= kMinAgreement * matches; }
};

class Tracker {
 public:
  explicit Tracker(const EstimatorConfig& config);
  void listen(StageListener* listener) { listener_ = listener; }

  // Takes a newer view. Pose and motion prior move with the reference keyframe's correction.
  void set_view(std::shared_ptr<const LocalView> view);
  [[nodiscard]] const LocalView* view() const { return view_.get(); }
  [[nodiscard]] std::shared_ptr<const LocalView> shared_view() const { return view_; }
  // Another tracker's view, and the landmarks its newest frame saw: for frames posed afterwards. Null lets go
  // of it.
  void adopt(std::shared_ptr<const LocalView> view, std::span<const LandmarkHandle> seen);

  // Forgets pose, prior and matches: a new map begins at this pose.
  void start(const SE3& T_world_body, std::int64_t utime);

  // Pose of the frame by the constant-velocity prior, the last frame's landmarks, then the local map.
  TrackOutcome track(const Frame& frame);
  // The same from a given prior, leaving the tracker's own state alone: for frames posed afterwards.
  TrackOutcome track_from(const Frame& frame, const SE3& prior);
  // The way back after frames without a pose: descriptors and PnP, of the landmarks seen last and then of the
  // whole view, where the last motion would have led, where the vehicle was last, and anywhere in the image;
  // then the local map. Not ok where the landmarks that were found contradict each other.
  TrackOutcome relocalise(const Frame& frame);

  // Accepts the outcome of track() as this frame's pose.
  void accept(const Frame& frame, const TrackOutcome& outcome);
  // The same of relocalise(), on trial: until the next accept(), relocalise() still starts from the last pose
  // that was accepted.
  void accept_on_trial(const Frame& frame, const TrackOutcome& outcome);

  // Inlier sightings of the last search, and the counts since take_counts() was last called.
  void sightings(std::vector<Sighting>* out) const;
  void take_counts(std::vector<SightingCount>* out);
  // Landmarks that the last accepted frame saw.
  void last_seen(std::vector<LandmarkHandle>* out) const { *out = last_seen_; }

  [[nodiscard]] const SE3& T_world_body() const { return now_.T_world_body; }
  [[nodiscard]] const std::vector<Match>& matches() const { return matches_; }
  // Relative motion of the last accepted frames per second, body axes (translation, rotation).
  [[nodiscard]] Vector6d velocity_body() const { return now_.velocity; }
  // Of the work space.
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Candidate {
    std::uint32_t view_index = 0;
    Prediction prediction;
    int level = 0;
  };
  // Which of the view's landmarks are looked for.
  enum class Among : std::uint8_t { kLastFrame, kRecent, kAll };  // recent: and the reference keyframe's
  // A landmark and a feature that may show it.
  struct Pair {
    std::uint32_t view_index = 0;
    std::int32_t feature = -1;
  };
  // Where the body was, and how it moved.
  struct Motion {
    SE3 T_world_body;
    std::int64_t utime = 0;
    Vector6d velocity = Vector6d::Zero();  // a second, body axes
    bool has_velocity = false;
  };

  void mark_seen(std::span<const LandmarkHandle> seen);
  [[nodiscard]] SE3 predict_pose(std::int64_t utime) const;
  void project_view(const Frame& frame, const SE3& T_world_body, Among among,
                    std::vector<Candidate>* out) const;
  bool coarse_pose(const Frame& frame, SE3* T_world_body);
  [[nodiscard]] Match match_of(const Frame& frame, std::uint32_t view_index, std::int32_t feature) const;
  int match_candidates(const Frame& frame, const std::vector<Candidate>& candidates, double radius_px,
                       float ratio);
  void align_matches(const Frame& frame, const std::vector<Candidate>& candidates);
  PoseSolution pose_from_matches(const Frame& frame, const SE3& start);
  TrackOutcome fine_pose(const Frame& frame, const SE3& start);
  void begin_matching(const Frame& frame);
  [[nodiscard]] bool is_among(std::size_t view_index, Among among) const;
  [[nodiscard]] SE3 gone_on(double gone_s) const;
  void pair_around(const Frame& frame, const SE3& T_world_body, double radius_px, Among among);
  void pair_anywhere(const Frame& frame, Among among);
  void pair_one(const Frame& frame, std::uint32_t view_index, const DescriptorQuery& query);
  TrackOutcome pose_from_pairs(const Frame& frame);
  void note_pose(const Frame& frame, const TrackOutcome& outcome, double longest_s);
  void count_sightings();
  [[nodiscard]] double motion_since_reference(const Frame& frame, const SE3& T_world_body);

  const EstimatorConfig config_;
  StageListener* listener_ = nullptr;
  std::shared_ptr<const LocalView> view_;

  Motion now_;   // of the last accepted frame
  Motion sure_;  // of the last that was not on trial

  std::vector<double> level_scale_;  // of each pyramid level

  // Work space, allocated at start for the largest view and the most features, and reused.
  std::vector<Candidate> candidates_;
  std::vector<Match> matches_;
  std::vector<std::int32_t> feature_match_;  // one a feature: index in matches_, or -1
  std::vector<PoseMeasurement> measurements_;
  std::vector<LandmarkHandle> last_seen_;      // inliers of the last accepted frame
  std::vector<LandmarkHandle> sure_seen_;      // of the last that was not on trial
  std::vector<std::uint8_t> seen_last_frame_;  // one a view landmark
  std::vector<std::uint8_t> matched_;          // the same
  std::vector<std::int32_t> candidate_of_;     // the same: index in candidates_, or -1
  std::vector<double> motions_;
  std::vector<Pair> pairs_;                         // of relocalise()
  std::vector<Eigen::Vector3d> bearings_, points_;  // the same
  PnpWorkspace pnp_;
  // One a landmark slot of the map: index in the view; valid where the view says so.
  std::vector<std::uint32_t> view_index_of_slot_;
  std::vector<SightingCount> counts_;  // one a landmark slot of the map
  std::vector<std::uint32_t> counted_slots_;
};

}  // namespace farpoint::slam
