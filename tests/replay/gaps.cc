// SPDX-License-Identifier: Apache-2.0
#include "tests/replay/gaps.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <utility>

#include "daemon/config/config.h"
#include "daemon/config/rig.h"
#include "daemon/input/log_frame_source.h"
#include "slam/geometry/point_alignment.h"
#include "tools/evaluate/log_input.h"

namespace farpoint::test {
namespace {

using slam::SE3;

constexpr double kDegree = std::numbers::pi / 180.0;
// A landmark at more than twice or less than half the distance looks another, as a corner.
constexpr double kLikeSize = 2.0;
// A view is one seen before when a quarter of what was in the image is still in it, and three times as many
// landmarks as a pose needs.
constexpr double kSharedView = 0.25;
constexpr int kSharedLandmarks = 90;
// A pose is wrong where it errs by more than twice what it does without a gap, beyond a hundredth of the way
// (what drift may differ by) and the truth's own noise. One of another place errs by metres.
constexpr double kFactor = 2.0, kDrift = 0.01, kTruth_m = 0.02, kTruth_deg = 0.2;

MotionError motion_error(const SE3& T_told_a, const SE3& T_told_b, const SE3& T_true_a, const SE3& T_true_b,
                         double scale) {
  SE3 told = T_told_a.inverse() * T_told_b;
  told.t *= scale;
  const SE3 error = (T_true_a.inverse() * T_true_b).inverse() * told;
  return {error.t.norm(), slam::so3_log(error.q).norm() / kDegree};
}

MotionError motion_error(const TrackedFrame& a, const TrackedFrame& b, double scale) {
  return motion_error(a.T_map_body, b.T_map_body, a.T_truth_body, b.T_truth_body, scale);
}

void keep_worst(const MotionError& error, MotionError* worst) {
  worst->translation_m = std::max(worst->translation_m, error.translation_m);
  worst->rotation_deg = std::max(worst->rotation_deg, error.rotation_deg);
}

// Metres a map unit, by the valid poses of one map up to a time. Empty where there are too few.
std::optional<double> scale_of(const std::vector<TrackedFrame>& frames, std::int32_t map_id, double until_s) {
  std::vector<Eigen::Vector3d> told, truth;
  for (const TrackedFrame& f : frames) {
    if (!f.valid() || f.map_id != map_id || f.time_s > until_s) continue;
    told.push_back(f.T_map_body.t);
    truth.push_back(f.T_truth_body.t);
  }
  const slam::PointAlignment a = slam::align_points(told, truth, slam::AlignmentKind::kSim3);
  if (!a.ok) return {};
  return a.S_target_source.scale;
}

std::optional<double> scale_at(const std::vector<TrackedFrame>& frames, const TrackedFrame& frame) {
  return scale_of(frames, frame.map_id, frame.time_s);
}

// Of odometry's motion between two frames of one map.
double odometry_error_m(const TrackedFrame& a, const TrackedFrame& b, double scale) {
  return motion_error(a.T_odom_body, b.T_odom_body, a.T_truth_body, b.T_truth_body, scale).translation_m;
}

// Length of the true path from one frame to a later one, along the poses of `frames` in between.
double true_way_m(const std::vector<TrackedFrame>& frames, const TrackedFrame& from, const TrackedFrame& to) {
  double way_m = 0.0;
  const TrackedFrame* last = &from;
  for (const TrackedFrame& f : frames) {
    if (f.time_s <= from.time_s || f.time_s > to.time_s) continue;
    way_m += (f.T_truth_body.t - last->T_truth_body.t).norm();
    last = &f;
  }
  return way_m;
}

const TrackedFrame* frame_at(const std::vector<TrackedFrame>& frames, double time_s) {
  const auto at = std::find_if(frames.begin(), frames.end(),
                               [&](const TrackedFrame& f) { return std::abs(f.time_s - time_s) < 1e-4; });
  return at == frames.end() ? nullptr : &*at;
}

bool is_in(const Gap& gap, double time_s) {
  return time_s >= gap.start_s && time_s < gap.start_s + gap.length_s;
}

SE3 nearest_truth(const tools::Trajectory& truth, double time_s) {
  const auto later = std::lower_bound(truth.poses.begin(), truth.poses.end(), time_s,
                                      [](const tools::TimedPose& p, double t) { return p.time_s < t; });
  if (later == truth.poses.end()) return truth.poses.back().pose;
  if (later == truth.poses.begin()) return later->pose;
  const auto earlier = std::prev(later);
  return time_s - earlier->time_s < later->time_s - time_s ? earlier->pose : later->pose;
}

// Landmarks of the map that the keyframes of the last second saw.
std::vector<Eigen::Vector3d> landmarks_of_late(const slam::Estimator& estimator, std::int64_t now_utime) {
  std::vector<Eigen::Vector3d> points;
  const slam::Inspection inspection = estimator.inspect();
  for (const slam::LandmarkInfo& l : inspection.landmarks()) {
    if (!l.full) continue;
    const std::vector<slam::LandmarkSighting> sightings = inspection.sightings(l);
    if (!sightings.empty() && sightings.back().utime > now_utime - 1'000'000)
      points.push_back(l.position_map);
  }
  return points;
}

}  // namespace

// What was known when a gap began.
struct GapExperiment::Snapshot {
  std::vector<Eigen::Vector3d> points_map;
  slam::RigCamera camera;

  // Counts what is in the images before and after the gap.
  void count(const SE3& T_map_before, const SE3& T_map_after, GapOutcome* outcome) const {
    const SE3 T_before_map = (T_map_before * camera.T_body_camera).inverse();
    const SE3 T_after_map = (T_map_after * camera.T_body_camera).inverse();
    const auto in_image = [this](const Eigen::Vector3d& p) {
      Eigen::Vector2d pixel;
      return camera.camera.project(p, &pixel) && camera.camera.in_image(pixel);
    };
    for (const Eigen::Vector3d& p : points_map) {
      const Eigen::Vector3d before = T_before_map * p, after = T_after_map * p;
      if (!in_image(before)) continue;
      ++outcome->landmarks_before;
      const double size = before.norm() / after.norm();
      if (in_image(after) && size < kLikeSize && size > 1.0 / kLikeSize) ++outcome->landmarks_after;
    }
  }
};

bool GapOutcome::seen_before() const {
  return landmarks_after >= kSharedLandmarks && landmarks_after >= kSharedView * landmarks_before;
}

std::vector<std::vector<Gap>> spread_gaps(const GapSpread& spread) {
  const double step_s = (spread.last_s - spread.first_s) / std::max(1, spread.count - 1);
  const int replays = std::max(1, static_cast<int>(std::ceil(spread.apart_s / step_s)));
  std::vector<std::vector<Gap>> out(static_cast<std::size_t>(replays));
  for (int i = 0; i < spread.count; ++i) {
    const GapKind kind = i % 2 == 0 ? GapKind::kMissing : GapKind::kBlack;
    // Every length with either kind.
    const double length_s = spread.lengths_s[static_cast<std::size_t>(i / 2) % spread.lengths_s.size()];
    out[static_cast<std::size_t>(i % replays)].push_back({kind, spread.first_s + i * step_s, length_s});
  }
  return out;
}

GapExperiment::GapExperiment(std::string log, double until_s) : log_(std::move(log)), until_s_(until_s) {
  whole_ = replay({}, nullptr);
}

std::vector<TrackedFrame> GapExperiment::replay(const std::vector<Gap>& gaps,
                                                std::vector<Snapshot>* snapshots) const {
  tools::Trajectory truth = tools::read_recording_log(log_).truth;
  if (truth.poses.empty() || !truth.has_orientation)
    throw std::runtime_error(log_ + ": no truth with rotation");
  daemon::LogFrameSource source(log_, daemon::Config{});
  daemon::StageClock clock;
  daemon::SourceFrame frame;
  if (!source.next(&frame, &clock)) return {};
  const std::int64_t first_utime = frame.meta.utime;
  slam::Rig rig = daemon::make_rig(source.calibration(), 0);
  // The estimator's body stands at camera 0 while the scale is unknown.
  tools::move_reference_point({Eigen::Quaterniond::Identity(), rig.cameras[0].T_body_camera.t}, &truth);
  rig.cameras[0].T_body_camera.t.setZero();
  slam::Estimator estimator(daemon::Config{}.estimator, rig);

  std::vector<TrackedFrame> out;
  const Gap* last_gap = nullptr;
  do {
    const double time_s = 1e-6 * static_cast<double>(frame.meta.utime - first_utime);
    if (time_s > until_s_) break;
    const auto gap = std::find_if(gaps.begin(), gaps.end(), [&](const Gap& g) { return is_in(g, time_s); });
    slam::ImageView image = frame.view();
    std::vector<std::uint8_t> black;
    if (gap != gaps.end()) {
      if (std::exchange(last_gap, &*gap) != &*gap)
        snapshots->push_back({landmarks_of_late(estimator, frame.meta.utime), rig.cameras[0]});
      if (gap->kind == GapKind::kMissing) continue;
      black.assign(static_cast<std::size_t>(image.stride_bytes * image.height_px), 0);
      image.data = black.data();
    }
    const slam::FrameResult& r = estimator.process({frame.meta.utime, frame.meta.sequence, 0, image});
    out.push_back({time_s, r.state, r.map_id, r.T_map_body, r.T_odom_body,
                   nearest_truth(truth, tools::seconds_of(frame.meta.utime)), r.reset_counter});
  } while (source.next(&frame, &clock));
  return out;
}

// One valid pose after the gap, in the map of before.
void GapExperiment::judge_pose(const TrackedFrame& before, const TrackedFrame& frame, double scale,
                               GapOutcome* outcome) const {
  const MotionError error = motion_error(before, frame, scale);
  MotionError without;
  const TrackedFrame *a = frame_at(whole_, before.time_s), *b = frame_at(whole_, frame.time_s);
  if (a != nullptr && b != nullptr && a->valid() && b->valid() && a->map_id == b->map_id)
    if (const std::optional<double> scale_whole = scale_at(whole_, *a))
      without = motion_error(*a, *b, *scale_whole);
  const double way_m = (frame.T_truth_body.t - before.T_truth_body.t).norm();
  const bool right = error.translation_m <= kFactor * without.translation_m + kDrift * way_m + kTruth_m &&
                     error.rotation_deg <= kFactor * without.rotation_deg + kTruth_deg;
  if (!right) ++outcome->wrong_poses;
  ++outcome->poses;
  keep_worst(error, &outcome->error);
  keep_worst(without, &outcome->error_without);
}

OdometryOverGap GapExperiment::judge_odometry(const std::vector<TrackedFrame>& frames, const Gap& gap) const {
  OdometryOverGap out;
  const auto begin = std::find_if(frames.begin(), frames.end(),
                                  [&](const TrackedFrame& f) { return f.time_s >= gap.start_s; });
  const auto before = std::find_if(std::make_reverse_iterator(begin), frames.rend(),
                                   [](const TrackedFrame& f) { return f.valid(); });
  const auto after = std::find_if(begin, frames.end(), [&](const TrackedFrame& f) {
    return f.valid() && f.time_s >= gap.start_s + gap.length_s;
  });
  if (before == frames.rend() || after == frames.end()) return out;
  const std::optional<double> scale =
      scale_of(frames, before->map_id, std::numeric_limits<double>::infinity());
  if (!scale) return out;
  out.judged = true;
  out.reset = after->reset_counter != before->reset_counter;
  out.silent_s = after->time_s - before->time_s;
  // The frames of the replay without gaps are all there.
  out.way_m = true_way_m(whole_, *before, *after);
  out.error_m = odometry_error_m(*before, *after, *scale);
  const TrackedFrame *a = frame_at(whole_, before->time_s), *b = frame_at(whole_, after->time_s);
  if (a == nullptr || b == nullptr || !a->valid() || !b->valid() || a->map_id != b->map_id) return out;
  if (const auto whole = scale_of(whole_, a->map_id, std::numeric_limits<double>::infinity()))
    out.error_without_m = odometry_error_m(*a, *b, *whole);
  return out;
}

std::vector<GapOutcome> GapExperiment::run(const std::vector<Gap>& gaps) const {
  std::vector<Snapshot> snapshots;
  const std::vector<TrackedFrame> frames = replay(gaps, &snapshots);
  std::vector<GapOutcome> out;
  for (std::size_t g = 0; g < snapshots.size(); ++g) {
    GapOutcome& o = out.emplace_back();
    o.gap = gaps[g];
    o.odometry = judge_odometry(frames, o.gap);
    const double end_s = o.gap.start_s + o.gap.length_s;
    const double next_s = g + 1 < gaps.size() ? gaps[g + 1].start_s : std::numeric_limits<double>::infinity();
    o.wrong_poses = static_cast<int>(std::count_if(frames.begin(), frames.end(), [&](const TrackedFrame& f) {
      return is_in(o.gap, f.time_s) && f.valid();
    }));
    const auto after =
        std::find_if(frames.begin(), frames.end(), [&](const TrackedFrame& f) { return f.time_s >= end_s; });
    const auto begin = std::find_if(frames.begin(), frames.end(),
                                    [&](const TrackedFrame& f) { return f.time_s >= o.gap.start_s; });
    if (after == frames.end() || begin == frames.begin()) continue;
    const TrackedFrame& before = *std::prev(begin);
    const std::optional<double> scale = scale_at(frames, before);
    o.tracked_before = before.valid() && scale.has_value();
    if (!o.tracked_before) continue;
    const SE3 motion = before.T_truth_body.inverse() * after->T_truth_body;
    o.moved_m = motion.t.norm();
    o.turned_deg = slam::so3_log(motion.q).norm() / kDegree;
    snapshots[g].count(before.T_map_body, before.T_map_body * SE3{motion.q, motion.t / *scale}, &o);
    for (auto f = after; f != frames.end() && f->time_s <= end_s + kJudged_s && f->time_s < next_s; ++f) {
      if (!f->valid() || f->map_id != before.map_id) continue;
      if (o.poses == 0) o.back_after_s = f->time_s - after->time_s;
      judge_pose(before, *f, *scale, &o);
    }
  }
  return out;
}

std::string to_text(const Gap& gap) {
  return fmt::format("{:7} {:5.2f} s +{:.1f} s", gap.kind == GapKind::kMissing ? "missing" : "black",
                     gap.start_s, gap.length_s);
}

std::string to_text(const GapOutcome& o) {
  const std::string gap = to_text(o.gap);
  if (!o.tracked_before) return gap + ": no pose before it";
  return gap + fmt::format(
                   ": moved {:.2f} m {:.1f} deg, landmarks {} -> {} ({}), back after {:.2f} s, {} poses, "
                   "error {:.3f} m {:.2f} deg (without the gap {:.3f} m {:.2f} deg), {} wrong",
                   o.moved_m, o.turned_deg, o.landmarks_before, o.landmarks_after,
                   o.seen_before() ? "seen before" : "new", o.back_after_s, o.poses, o.error.translation_m,
                   o.error.rotation_deg, o.error_without.translation_m, o.error_without.rotation_deg,
                   o.wrong_poses);
}

std::string odometry_to_text(const GapOutcome& outcome) {
  const OdometryOverGap& o = outcome.odometry;
  const std::string gap = to_text(outcome.gap);
  if (!o.judged) return gap + ": no valid frame before or after it";
  return gap +
         fmt::format(": silent {:.2f} s, way {:.2f} m, odometry off by {:.3f} m ({:.3f} without the gap), {}",
                     o.silent_s, o.way_m, o.error_m, o.error_without_m,
                     o.reset ? "counter rose" : (o.kept() ? "kept" : "LOST"));
}

}  // namespace farpoint::test
