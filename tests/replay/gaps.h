// SPDX-License-Identifier: Apache-2.0
// Replays a recording with stretches of its images taken away, and measures how the estimator finds back:
// into which map, how soon, whether the poses it then calls valid are right by the recording's truth, and
// whether odometry kept the motion.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "slam/config.h"
#include "slam/estimator.h"

namespace farpoint::test {

enum class GapKind : std::uint8_t {
  kMissing,  // the frames do not come
  kBlack,    // they come, and show nothing
};

struct Gap {
  GapKind kind = GapKind::kMissing;
  double start_s = 0.0;  // since the recording's first frame
  double length_s = 0.0;
};

// Gaps evenly over [first_s, last_s], of these lengths, missing and black by turns, dealt to as many replays
// as it takes for `apart_s` between the starts of two gaps of one replay.
struct GapSpread {
  double first_s = 0.0, last_s = 0.0;
  int count = 0;
  double apart_s = 0.0;
  std::vector<double> lengths_s = {0.5, 1.0, 1.5, 2.0};
};
[[nodiscard]] std::vector<std::vector<Gap>> spread_gaps(const GapSpread& spread);

struct TrackedFrame {
  double time_s = 0.0;  // since the recording's first frame
  slam::State state = slam::State::kStarting;
  std::int32_t map_id = 0;
  // The body at camera 0. Valid states have the first two, all states the truth.
  slam::SE3 T_map_body, T_odom_body, T_truth_body;
  std::uint32_t reset_counter = 0;
  [[nodiscard]] bool valid() const { return slam::is_valid(state); }
};

// A motion that the estimator told, in metres, against the true one.
struct MotionError {
  double translation_m = 0.0, rotation_deg = 0.0;
};

// From the last valid frame before a gap to the first one after it, whatever lies between.
struct OdometryOverGap {
  bool judged = false;    // both frames are there, and the map before the gap has a scale by the truth
  bool reset = false;     // the counter rose: odometry claims no motion
  double silent_s = 0.0;  // between the two frames
  double way_m = 0.0;     // truth, along the path
  double error_m =
      0.0;  // of odometry's motion, at the scale that fits the map to the truth over the whole run
  double error_without_m = -1.0;  // the same in a replay without gaps; negative: not known

  // Odometry told the motion within 5 cm and 2 % of the way, or that it did not.
  [[nodiscard]] bool kept() const { return reset || error_m <= 0.05 + 0.02 * way_m; }
};

struct GapOutcome {
  Gap gap;
  OdometryOverGap odometry;
  bool tracked_before = false;  // the last frame before the gap had a valid pose; else nothing below is known
  // Of the landmarks that the keyframes of the last second before the gap saw, how many lie in the image of
  // the last frame before it, and by the true motion at a like size in that of the first frame after it.
  int landmarks_before = 0, landmarks_after = 0;
  double moved_m = 0.0, turned_deg = 0.0;  // truth, from the last frame before the gap to the first after it
  double back_after_s = -1.0;  // from that frame to the first valid pose in the same map; negative: never
  int poses = 0;               // valid ones in the same map within kJudged_s after the gap
  MotionError error;           // the worst of them, against the last pose before the gap
  MotionError error_without;   // the worst of the same pairs of poses in a replay without gaps
  int wrong_poses = 0;         // of them, and those in the gap, which show nothing

  // By the counts of landmarks: a quarter of what was in the image is in it still.
  [[nodiscard]] bool seen_before() const;
};

// Poses are judged for so long after a gap.
inline constexpr double kJudged_s = 3.0;

class GapExperiment {
 public:
  // Replays the recording once as it is, up to `until_s`. Throws where the log cannot be read.
  GapExperiment(std::string log, double until_s);
  [[nodiscard]] double length_s() const { return whole_.empty() ? 0.0 : whole_.back().time_s; }
  // One lockstep replay with these gaps, ascending in time.
  [[nodiscard]] std::vector<GapOutcome> run(const std::vector<Gap>& gaps) const;

 private:
  struct Snapshot;
  std::vector<TrackedFrame> replay(const std::vector<Gap>& gaps, std::vector<Snapshot>* snapshots) const;
  void judge_pose(const TrackedFrame& before, const TrackedFrame& frame, double scale,
                  GapOutcome* outcome) const;
  [[nodiscard]] OdometryOverGap judge_odometry(const std::vector<TrackedFrame>& frames, const Gap& gap) const;

  const std::string log_;
  const double until_s_;
  std::vector<TrackedFrame> whole_;
};

// One line a gap.
[[nodiscard]] std::string to_text(const GapOutcome& outcome);
[[nodiscard]] std::string odometry_to_text(const GapOutcome& outcome);

}  // namespace farpoint::test
