// SPDX-License-Identifier: Apache-2.0
// The vehicle's true motion: cubic B-splines of position and of yaw, pitch and roll, so that velocity,
// acceleration and turn rate follow exactly, at any time.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "slam/geometry/se3.h"
#include "tools/simulate/world/path.h"
#include "tools/simulate/world/terrain.h"
#include "tools/simulate/world/world_description.h"

namespace farpoint::tools::simulate {

struct Motion {
  slam::SE3 T_world_body;
  Eigen::Vector3d velocity_w = Eigen::Vector3d::Zero();          // m/s, world axes
  Eigen::Vector3d acceleration_w = Eigen::Vector3d::Zero();      // m/s^2, world axes, gravity not in it
  Eigen::Vector3d angular_velocity_b = Eigen::Vector3d::Zero();  // rad/s, body axes
  double steering_rad = 0.0;                                     // of the front wheels, of a drive
};

class BodyPath {
 public:
  // A drive along a route. The body's origin stands height_m above the road, at the rear axle of a car.
  static BodyPath drive(const DriveDescription& drive, const Path& route, const Terrain& terrain,
                        std::uint64_t seed, double duration_s);
  static BodyPath flight(const FlightDescription& flight, const Terrain& terrain, std::uint64_t seed,
                         double duration_s);

  [[nodiscard]] Motion at(double time_s) const;
  [[nodiscard]] slam::SE3 pose_at(double time_s) const;
  // Way along the route, of a drive.
  [[nodiscard]] double route_at(double time_s) const;

 private:
  static constexpr double kKnot_s = 0.05;
  // Time before 0 at which the splines begin, since exposures and interpolation reach back.
  static constexpr double kLead_s = 1.0;
  using Knot = Eigen::Matrix<double, 6, 1>;  // x y z yaw pitch roll

  // Four weights, and with them the sum over the knots, its first and second derivative.
  void evaluate(double time_s, Knot* value, Knot* rate, Knot* second) const;

  std::vector<Knot> knots_;
  std::vector<double> route_;  // way along the route at each knot
};

}  // namespace farpoint::tools::simulate
