// SPDX-License-Identifier: Apache-2.0
// Every parameter of the estimator: plain values, with units. The daemon fills them from farpoint.yaml; the
// defaults here equal the shipped file. Nothing here may be fitted to one camera or recording.
#pragma once

#include <cstdint>
#include <string>

#include "slam/geometry/rig.h"
#include "slam/image/extractor.h"
#include "slam/image/pyramid.h"

namespace farpoint::slam {

// How landmarks are promoted and used (METHOD.md). The landmark type and the tracker are the same in every
// mode.
enum class LandmarkMode { kBaseline, kVmp };

struct CapacityConfig {
  int keyframes = 1000;                // of all maps together
  int landmarks = 40000;               // bearing, weak and full together
  int observations_per_landmark = 48;  // beyond it the oldest in between are thinned out
  int window_images = 24;              // keyframes that keep their pyramid for alignment
  int view_landmarks = 6000;           // most in one local view
  // Keeps the pose of every frame and removed keyframe for trajectories(): memory grows with the way.
  bool whole_trajectory = true;
};

struct InitialisationConfig {
  double min_parallax_rad = 0.0175;  // a quarter of the points must show it: one degree
  int min_landmarks = 80;            // good points two views must give
  double max_age_s = 6.0;            // age at which the reference frame is replaced
};

struct TrackingConfig {
  double prior_search_px = 15;  // window around the motion prior, level-0 pixels (times level scale)
  double local_search_px = 4;   // window once a first pose is known
  int min_matches = 20;         // first pose from the prior
  int min_inliers = 30;         // fewer: lost
  int degraded_inliers = 50;    // fewer: degraded
  int max_hamming = 64;         // of 256 bits
  double pixel_sigma_px = 0.5;  // floor of an aligned measurement's error, level-0
};

struct KeyframeConfig {
  double tracked_ratio = 0.85;      // of the reference keyframe's landmarks: fewer, new keyframe
  double min_interval_s = 0.13;     // between two keyframes: the local window must reach back far enough
  double max_interval_s = 1.0;      // with motion
  double min_parallax_rad = 0.021;  // median motion since the last keyframe that asks for a new one
};

struct LandmarkConfig {
  LandmarkMode mode = LandmarkMode::kVmp;
  double promote_parallax_rad = 0.020;   // largest parallax: acos(0.9998), as in the paper
  double promote_relative_sigma = 0.05;  // vmp: sigma(inverse depth) / inverse depth
  int bearing_observations = 3;          // vmp: sightings from which a virtual point guides tracking
  int max_bearing = 4000;                // candidates alive at once
};

struct BundleOptions;
struct BundleProblem;
struct BundleSummary;
// Minimises a bundle problem (slam/solver/bundle_problem.h).
using SolveBundle = void (*)(const BundleOptions*, BundleProblem*, BundleSummary*);

struct MappingConfig {
  int neighbours = 20;              // keyframes searched for new landmarks
  int window_keyframes = 20;        // optimised by local BA
  int window_landmarks = 4000;      // most in one local BA
  int window_sightings = 24000;     // of these landmarks, most in one local BA
  int fixed_keyframes = 40;         // historical observers held fixed
  int iterations = 8;               // LM steps, never a time limit
  double quick_view_delay_ms = 50;  // lockstep: from a keyframe to the view with its triangulation
  double full_view_delay_ms = 100;  // lockstep: from a keyframe to the view after its local BA
  std::string solver = "schur";     // schur | ceres
  // Solves instead of the estimator's own solver. Required where `solver` is ceres.
  SolveBundle solve_instead = nullptr;
};

// Refinement of camera 0's calibration from the map. The sigmas are those of the given calibration,
// 1 sigma each.
struct CalibrationConfig {
  bool refine = true;
  double focal_sigma = 0.003;  // relative
  double centre_sigma_px = 2.0;
  double distortion_sigma = 0.02;   // of the first radial coefficient
  double information_share = 0.05;  // of the residuals' information that counts: they are not independent
  int min_keyframes = 8;            // free poses a window must have
};

// How fast the frame `odom` follows the map's corrections.
struct OdometryConfig {
  double correction_share = 0.1;         // of the way driven
  double correction_rad_per_s = 0.0175;  // turn, while the vehicle moves: one degree a second
};

// Wheel speeds: motion of one point of the body along the body's x axis, and the body's yaw rate.
struct WheelConfig {
  bool use = true;
  double x_m = 0, y_m = 0, z_m = 0;    // where on the body the speed is measured, body axes
  double track_m = 0;                  // between left and right wheel; 0: unknown
  double delay_ms = 0;                 // by which the samples' times are late
  double factor = 1;                   // metres driven in one that the wheels tell
  double scale_sigma = 0.02;           // of the factor, relative
  double speed_sigma_mps = 0.05;       // of the speed between two keyframes; of samples without their own
  double yaw_rate_sigma_radps = 0.01;  // the same of the yaw rate
  double slip_sigma = 0.01;            // share of the way between two keyframes
  double gate_sigmas = 3.5;  // contradiction of the images beyond which an interval is left out; 0: none
  double max_gap_s = 0.25;   // between two samples; motion across a longer gap is unknown
  double blind_s = 5;        // longest time that odometry goes on by wheels alone
};

struct EstimatorConfig {
  PyramidOptions pyramid;
  ExtractorOptions extractor;
  CapacityConfig capacity;
  InitialisationConfig initialisation;
  TrackingConfig tracking;
  KeyframeConfig keyframes;
  LandmarkConfig landmarks;
  MappingConfig mapping;
  CalibrationConfig calibration;
  OdometryConfig odometry;
  WheelConfig wheels;
};

}  // namespace farpoint::slam
