// SPDX-License-Identifier: Apache-2.0
// Input and result of the estimator for one frame.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "slam/geometry/se3.h"
#include "slam/image/extractor.h"
#include "slam/map/map_judgement.h"
#include "slam/mapping/counts.h"
#include "slam/odometry_errors.h"

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

// An image of one camera of the rig.
struct CameraImage {
  int camera = 0;
  ImageView image;
};

// `others`: images of further cameras, exposed at the same time; valid during the call.
struct FrameInput {
  std::int64_t utime = 0;  // mid-exposure, microseconds
  std::int64_t sequence = 0;
  int camera = 0;
  ImageView image;
  // Features extracted at most; fewer than configured where time is short.
  int most_features = Extractor::kAllFeatures;
  std::span<const CameraImage> others = {};
};

// Features measured elsewhere, by a simulator of features. The estimator shares `image` while it uses the
// frame.
struct FeatureInput {
  std::int64_t utime = 0;
  std::int64_t sequence = 0;
  int camera = 0;
  FeatureSet features;
  std::shared_ptr<const FrameImage> image;
};

// What tracking had taken before it tracked a frame, since the start. A run of threads repeats where each of
// its frames takes the same again.
struct FrameTaken {
  std::uint64_t replies = 0;  // of mapping
  std::uint64_t imu = 0;      // samples, late ones included
  std::uint64_t wheels = 0;   // samples, late ones included
};

// The estimate after one frame. Map units are metres only with `scale` metric or assumed.
struct FrameResult {
  std::int64_t utime = 0;
  std::int64_t sequence = 0;
  State state = State::kStarting;
  bool has_pose = false;    // T_map_body is an estimate (not necessarily valid, see state)
  bool from_vision = true;  // false: carried on by wheels alone
  SE3 T_map_body;
  SE3 T_odom_body;  // continuous: integrates relative motion, never jumps
  Sim3 map_from_odom;
  Vector6d velocity_body = Vector6d::Zero();  // m/s (odom units/s), rad/s in body axes, at utime
  // Order (translation, rotation), body axes; NaN where unknown.
  Matrix6d covariance = unknown_covariance();           // of T_map_body against the map
  Matrix6d velocity_covariance = unknown_covariance();  // of velocity_body
  OdometryErrors odometry;                              // of T_odom_body
  Refusal refusal;                                      // why the pose is not valid
  int quality = -1;                                     // -1 unknown, 0..100
  std::uint32_t reset_counter = 0;
  ScaleState scale = ScaleState::kUnknown;
  MetreSource metre = MetreSource::kNone;
  WheelTrust wheels = WheelTrust::kNone;  // what the images say of the wheels
  std::int32_t map_id = 0;
  std::uint64_t view_sequence = 0;  // of the local map that this frame was tracked against; 0: none
  int features = 0, matches = 0, inliers = 0, aligned = 0;
  bool keyframe = false;  // sent to mapping
  FrameTaken taken;
  std::uint64_t job = 0;   // number of the last job sent to mapping by this frame; 0: none
  int jobs_under_way = 0;  // jobs waiting for mapping, and the one in work

  [[nodiscard]] bool knows_velocity() const { return velocity_covariance.allFinite(); }
  // The velocity in map units a second.
  [[nodiscard]] Vector6d velocity_in_map() const {
    Vector6d velocity = velocity_body;
    velocity.head<3>() *= map_from_odom.scale;
    return velocity;
  }
  // Tracked against a map that existed before the frame. Tracking's times are measured over such frames.
  [[nodiscard]] bool followed() const { return view_sequence > 0 && state != State::kInitialising; }
};

// Samples of one sensor since the start.
struct SampleCounts {
  std::uint64_t used = 0;     // kept for fusion
  std::uint64_t late = 0;     // not after the newest one used, or not after an earlier frame
  std::uint64_t dropped = 0;  // no room: tracking had not taken those before

  [[nodiscard]] std::uint64_t taken() const { return used + late; }
};

// Counts over the whole run and of the present map.
struct EstimatorCounts {
  std::uint64_t frames = 0, frames_rejected = 0, maps = 0, lost = 0;
  std::uint64_t keyframes_dropped = 0;    // wanted, not made because mapping was behind
  std::uint64_t frames_not_recorded = 0;  // missing in the final trajectory because mapping was far behind
  SampleCounts imu, wheels;
  MappingCounts mapping;                       // as of the newest reply that tracking took
  std::uint32_t keyframes = 0, landmarks = 0;  // alive, as of that reply
};

// A view that mapping has made.
struct MappingNote {
  std::uint64_t reply = 0;  // a frame with taken.replies of at least this has taken the view
  std::int64_t utime = 0;   // of the frame that asked for it
  std::int32_t map_id = 0;
  bool full = false;  // after local bundle adjustment
};

}  // namespace farpoint::slam
