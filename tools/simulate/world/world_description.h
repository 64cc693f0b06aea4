// SPDX-License-Identifier: Apache-2.0
// Content of a world file (config/worlds/*.yaml): plain values with units. README.md in that folder explains
// each key.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "slam/geometry/camera.h"
#include "slam/geometry/se3.h"

namespace farpoint::tools::simulate {

enum class GroundCover { kMeadow, kFields, kGravel };
enum class RoadSurface { kTwoLanes, kMotorway, kTrack };

struct TerrainDescription {
  double relief_m = 4.0, relief_wavelength_m = 500.0;                      // gentle, roads follow it
  double hills_m = 0.0, hills_from_m = 300.0, hills_wavelength_m = 900.0;  // away from the roads
  double mountains_m = 0.0, mountains_from_m = 600.0, mountains_wavelength_m = 2500.0;
  GroundCover cover = GroundCover::kMeadow;
  double forest_share = 0.3;     // of the hills
  double trees_per_hectare = 0;  // strewn within 150 m of the roads
  double rocks_per_hectare = 0;
};

// A grid of streets with blocks of houses between them.
struct TownDescription {
  std::vector<double> columns_m, rows_m;  // where streets run, ascending; x of columns, y of rows
  double pavement_m = 2.5;
  int min_floors = 2, max_floors = 6;
  double parked_cars_share = 0.5;  // of the places along the kerb
  double tree_every_m = 14.0, lamp_every_m = 28.0, sign_every_m = 45.0;
  double park_share = 0.12;  // of the blocks
};

struct RoadDescription {
  std::vector<Eigen::Vector2d> waypoints_m;  // empty: it wanders
  bool closed = false;
  double corner_radius_m = 60.0;
  double wander_straight_m = 250.0, wander_turn_rad = 0.6;
  RoadSurface surface = RoadSurface::kTwoLanes;
  bool guard_rails = false;
  double post_every_m = 0, tree_every_m = 0, sign_every_m = 0, gantry_every_m = 0, house_every_m = 0;
};

// A walled square with boxes, for slow vehicles.
struct YardDescription {
  double length_m = 40.0, width_m = 30.0;
  int containers = 8, crates = 30;
};

struct TowersDescription {
  int count = 0;
  double from_m = 500.0, to_m = 3000.0;  // from the middle of the world
  double min_height_m = 40.0, max_height_m = 160.0;
};

struct TrafficDescription {
  int cars_ahead = 0, cars_oncoming = 0;
  double speed_mps = 12.0;
};

struct SkyDescription {
  double cloud_share = 0.5, cloud_height_m = 1500.0;
  double wind_mps = 12.0, wind_direction_rad = 0.6;
  double sun_azimuth_rad = 2.2, sun_elevation_rad = 0.7;
  double visibility_m = 20000.0;
  double ambient = 0.30;  // brightness of what the sun does not reach, of full light
};

struct DriveDescription {
  // Corners of the way through the town's grid as column and row; empty: along the road, or round the yard.
  std::vector<Eigen::Vector2i> street_corners;
  double corner_radius_m = 9.0;
  double speed_mps = 10.0, acceleration_mps2 = 1.5, lateral_acceleration_mps2 = 2.5;
  double rest_s = 1.0;          // standing at the start
  double lane_offset_m = -2.0;  // left positive
  double roughness_m = 0.004;   // of the road: what shakes the body
  double height_m = 0.0;        // of the body's origin above the road
};

struct FlightPoint {
  double time_s = 0.0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // z above the ground
  double yaw_rad = 0.0;
};

struct FlightDescription {
  std::vector<FlightPoint> points;
  double shake_m = 0.02, shake_rad = 0.006;
};

struct CameraDescription {
  slam::Camera::Parameters parameters;
  slam::SE3 T_body_camera;
  double rate_hz = 10.0;
  double row_time_s = 0.0;
  double stereo_baseline_m = 0.5;  // of CAMERA_1, to the right
};

struct SensorDescription {
  double exposure_s = 0.003;      // where the scene is as bright as a sunny day's mean
  double max_exposure_s = 0.012;  // beyond it gain helps
  double adaptation_s = 0.4;      // time constant of the automatic exposure
  double full_well = 12000.0;     // electrons at 255
  double read_noise = 9.0;        // electrons
  double gamma = 0.6;             // grey value = (light)^gamma
  double vignetting = 0.35;       // loss in the corner
  double blur_px = 1.2;
  double jump_every_s = 0.0, jump_factor = 2.5;  // exposure jumps; 0: none
};

struct ImuDescription {
  std::string part;
  double rate_hz = 200.0;
  double gyro_noise_density = 0.0, gyro_random_walk = 0.0;    // rad/s/sqrt(Hz), rad/s^2/sqrt(Hz)
  double accel_noise_density = 0.0, accel_random_walk = 0.0;  // m/s^2/sqrt(Hz), m/s^3/sqrt(Hz)
  double gyro_bias_sigma = 0.0, accel_bias_sigma = 0.0;       // at the start: rad/s, m/s^2
  slam::SE3 T_body_imu;
};

struct WheelsDescription {
  double rate_hz = 50.0;
  double track_m = 1.55, wheelbase_m = 2.7;
  double scale_error = 0.01;  // one sigma, of the circumference, a run
  double slip = 0.01;         // of the speed under 1 m/s^2 of acceleration
  double noise_mps = 0.02;
};

struct WorldDescription {
  std::string name;
  std::uint64_t seed = 1;
  double duration_s = 60.0;
  TerrainDescription terrain;
  std::optional<TownDescription> town;
  std::optional<RoadDescription> road;
  std::optional<YardDescription> yard;
  TowersDescription towers;
  TrafficDescription traffic;
  SkyDescription sky;
  std::optional<DriveDescription> drive;
  std::optional<FlightDescription> flight;
  CameraDescription camera;
  SensorDescription sensor;
  std::optional<ImuDescription> imu;
  std::optional<WheelsDescription> wheels;
};

}  // namespace farpoint::tools::simulate
