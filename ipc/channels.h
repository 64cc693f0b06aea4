// SPDX-License-Identifier: Apache-2.0
// Names of the LCM channels (DESIGN.md, "What goes out").
#pragma once

namespace farpoint::ipc {

// Published.
inline constexpr char kOdometryChannel[] = "FARPOINT_ODOMETRY";          // odometry_t
inline constexpr char kPoseChannel[] = "FARPOINT_POSE";                  // pose_t
inline constexpr char kMapFromOdomChannel[] = "FARPOINT_MAP_FROM_ODOM";  // map_from_odom_t
inline constexpr char kStatusChannel[] = "FARPOINT_STATUS";              // status_t
inline constexpr char kTimingChannel[] = "FARPOINT_TIMING";              // timing_t
inline constexpr char kScheduleChannel[] = "FARPOINT_SCHEDULE";          // schedule_t, threaded runs
inline constexpr char kMapChannel[] = "FARPOINT_MAP";                    // map_t
inline constexpr char kBotCorePoseChannel[] = "POSE";  // bot_core::pose_t, for MIT's viewers

// In logs only.
inline constexpr char kCameraChannelPrefix[] = "CAMERA_";            // image_t; CAMERA_0, CAMERA_1, ...
inline constexpr char kImuChannel[] = "IMU";                         // imu_t
inline constexpr char kWheelsChannel[] = "WHEELS";                   // wheels_t
inline constexpr char kCalibrationChannel[] = "CALIBRATION";         // calibration_t
inline constexpr char kGroundTruthChannel[] = "GROUND_TRUTH";        // ground_truth_t
inline constexpr char kSimulationChannel[] = "SIMULATION";           // simulation_t, of a simulated recording
inline constexpr char kTrajectoryChannel[] = "FARPOINT_TRAJECTORY";  // trajectory_t, once, at the end
inline constexpr char kLandmarksChannel[] = "FARPOINT_LANDMARKS";    // landmarks_t, at the end
inline constexpr char kSummaryChannel[] = "FARPOINT_SUMMARY";        // summary_t, once, at the end

// What goes to UDP by default: one host.
inline constexpr char kDefaultLcmUrl[] = "udpm://239.255.76.67:7667?ttl=0";

}  // namespace farpoint::ipc
