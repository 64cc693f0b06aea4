// SPDX-License-Identifier: Apache-2.0
#include "tools/simulate/sensors/vehicle_motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tools/simulate/world/noise.h"
#include "tools/simulate/world/random.h"

namespace farpoint::tools::simulate {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kWheelbase_m = 2.7;

Eigen::Quaterniond rotation_of(double yaw, double pitch, double roll) {
  return Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX());
}

// Metres driven in the lane a metre of the route: more than one on the outside of a bend.
double lane_stretch(const DriveDescription& drive, const Path::Place& place) {
  return std::max(1.0 - drive.lane_offset_m * place.curvature, 0.2);
}

// Highest speed at each metre of the route from which every bend ahead can be taken, braking as allowed.
std::vector<double> speed_limits(const DriveDescription& drive, const Path& route) {
  const auto n = static_cast<std::ptrdiff_t>(route.length_m());
  std::vector<double> limit(static_cast<std::size_t>(n));
  for (std::ptrdiff_t i = 0; i < n; ++i) {
    const Path::Place place = route.at(static_cast<double>(i));
    const double curvature = std::abs(place.curvature) / lane_stretch(drive, place);
    limit[static_cast<std::size_t>(i)] =
        std::min(drive.speed_mps, std::sqrt(drive.lateral_acceleration_mps2 / std::max(curvature, 1e-6)));
  }
  const std::ptrdiff_t rounds = route.closed() ? 2 : 1;
  for (std::ptrdiff_t k = rounds * n - 2; k >= 0; --k) {
    double& here = limit[static_cast<std::size_t>(k % n)];
    const double ahead = limit[static_cast<std::size_t>((k + 1) % n)];
    here = std::min(here, std::sqrt(ahead * ahead + 2.0 * drive.acceleration_mps2));
  }
  return limit;
}

double unwrapped(double angle, double near) {
  return angle + 2.0 * kPi * std::round((near - angle) / (2.0 * kPi));
}

}  // namespace

BodyPath BodyPath::drive(const DriveDescription& drive, const Path& route, const Terrain& terrain,
                         std::uint64_t seed, double duration_s) {
  const std::vector<double> limits = speed_limits(drive, route);
  const auto limit_at = [&](double s) {
    const double rest = std::fmod(s, static_cast<double>(limits.size()));
    const double u = std::clamp(rest, 0.0, static_cast<double>(limits.size()) - 1.0);
    const auto i = static_cast<std::size_t>(u);
    const double share = u - static_cast<double>(i);
    return (1.0 - share) * limits[i] + share * limits[(i + 1) % limits.size()];
  };
  const std::uint64_t noise = seed_of(seed, "drive");
  BodyPath path;
  const auto count = static_cast<std::size_t>((duration_s + 2.0 * kLead_s) / kKnot_s) + 4;
  // An open road is entered some way from its end, so that there is road behind too.
  double s = route.closed() ? 5.0 : std::min(400.0, 0.1 * route.length_m()), v = 0.0, yaw = 0.0;
  const double start = s, end = route.length_m() - 30.0;
  for (std::size_t k = 0; k < count; ++k) {
    const double time = static_cast<double>(k) * kKnot_s - kLead_s;
    double wanted = time < drive.rest_s ? 0.0 : limit_at(s + 0.3 * v);
    if (!route.closed() && s > end - 0.5 * v * v / drive.acceleration_mps2) wanted = 0.0;  // the road ends
    const double gain =
        std::clamp(1.2 * (wanted - v), -1.2 * drive.acceleration_mps2, drive.acceleration_mps2);
    const double a = v <= 0.0 && wanted <= 0.0 ? 0.0 : gain;
    const Path::Place place = route.at(s);
    const Eigen::Vector2d p = place.position + drive.lane_offset_m * place.left() +
                              0.12 * plane_noise(noise, s / 40.0, 0.5) * place.left();
    yaw = unwrapped(std::atan2(place.forward.y(), place.forward.x()), yaw);
    const Eigen::Vector2d ahead = p + 0.5 * kWheelbase_m * place.forward,
                          behind = p - 0.5 * kWheelbase_m * place.forward;
    const double slope =
        (terrain.base(ahead.x(), ahead.y()) - terrain.base(behind.x(), behind.y())) / kWheelbase_m;
    const double way = s - start;
    const double bounce = drive.roughness_m * (plane_noise(noise + 1, way / 1.7, 0.5) +
                                               2.0 * plane_noise(noise + 1, way / 9.0, 7.5));
    Knot knot;
    knot << p.x(), p.y(), terrain.base(p.x(), p.y()) + drive.height_m + bounce, yaw,
        // A positive pitch looks down (about y, to the left): braking dips the nose.
        -std::atan(slope) - 0.004 * a + 0.4 * drive.roughness_m * plane_noise(noise + 2, way / 2.6, 0.5),
        // A left bend leans the body to the right.
        0.006 * v * v * place.curvature + 0.5 * drive.roughness_m * plane_noise(noise + 3, way / 3.1, 0.5);
    path.knots_.push_back(knot);
    path.route_.push_back(s);
    v = std::max(0.0, v + a * kKnot_s);
    s += v * kKnot_s / lane_stretch(drive, place);
  }
  return path;
}

BodyPath BodyPath::flight(const FlightDescription& flight, const Terrain& terrain, std::uint64_t seed,
                          double duration_s) {
  const std::uint64_t noise = seed_of(seed, "flight");
  BodyPath path;
  const auto count = static_cast<std::size_t>((duration_s + 2.0 * kLead_s) / kKnot_s) + 4;
  std::vector<Knot> raw(count);
  std::size_t leg = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const double time = static_cast<double>(k) * kKnot_s - kLead_s;
    while (leg + 2 < flight.points.size() && flight.points[leg + 1].time_s < time) ++leg;
    const FlightPoint &a = flight.points[leg],
                      &b = flight.points[std::min(leg + 1, flight.points.size() - 1)];
    const double share =
        b.time_s > a.time_s ? std::clamp((time - a.time_s) / (b.time_s - a.time_s), 0.0, 1.0) : 0.0;
    const Eigen::Vector3d p = a.position + share * (b.position - a.position);
    raw[k] << p.x(), p.y(), terrain.base(p.x(), p.y()) + p.z(), a.yaw_rad + share * (b.yaw_rad - a.yaw_rad),
        0.0, 0.0;
  }
  // Nothing that flies starts and stops at once: means over 0.9 s, three times.
  constexpr std::ptrdiff_t kHalf = 9;
  for (int round = 0; round < 3; ++round) {
    std::vector<Knot> smoothed(count);
    for (std::ptrdiff_t k = 0; k < static_cast<std::ptrdiff_t>(count); ++k) {
      Knot sum = Knot::Zero();
      for (std::ptrdiff_t i = k - kHalf; i <= k + kHalf; ++i)
        sum += raw[static_cast<std::size_t>(
            std::clamp<std::ptrdiff_t>(i, 0, static_cast<std::ptrdiff_t>(count) - 1))];
      smoothed[static_cast<std::size_t>(k)] = sum / (2.0 * kHalf + 1.0);
    }
    raw = std::move(smoothed);
  }
  for (std::size_t k = 0; k < count; ++k) {
    // A multicopter leans into its acceleration; wind shakes it.
    const Knot &before = raw[k == 0 ? 0 : k - 1], &after = raw[std::min(k + 1, count - 1)];
    const Eigen::Vector3d acceleration = (after - 2.0 * raw[k] + before).head<3>() / (kKnot_s * kKnot_s);
    const double time = static_cast<double>(k) * kKnot_s, c = std::cos(raw[k][3]), s = std::sin(raw[k][3]);
    const double forward = c * acceleration.x() + s * acceleration.y(),
                 left = c * acceleration.y() - s * acceleration.x();
    const auto shake = [&](std::uint64_t i, double period_s) {
      return plane_fractal(noise + i, time / period_s, 0.5, 2);
    };
    Knot knot = raw[k];
    for (int i = 0; i < 3; ++i) knot[i] += flight.shake_m * 4.0 * shake(static_cast<std::uint64_t>(i), 1.6);
    knot[3] += flight.shake_rad * shake(3, 0.9);
    knot[4] = std::atan(forward / 9.81) + flight.shake_rad * shake(4, 0.5);
    knot[5] = -std::atan(left / 9.81) + flight.shake_rad * shake(5, 0.5);
    path.knots_.push_back(knot);
    path.route_.push_back(0.0);
  }
  return path;
}

void BodyPath::evaluate(double time_s, Knot* value, Knot* rate, Knot* second) const {
  const double u = std::clamp((time_s + kLead_s) / kKnot_s, 1.0, static_cast<double>(knots_.size()) - 3.001);
  const auto i = static_cast<std::size_t>(u);
  const double t = u - static_cast<double>(i), t2 = t * t, t3 = t2 * t, r = 1.0 - t;
  const Knot &a = knots_[i - 1], &b = knots_[i], &c = knots_[i + 1], &d = knots_[i + 2];
  *value = (r * r * r * a + (3 * t3 - 6 * t2 + 4) * b + (-3 * t3 + 3 * t2 + 3 * t + 1) * c + t3 * d) / 6.0;
  *rate = (-r * r * a + (3 * t2 - 4 * t) * b + (-3 * t2 + 2 * t + 1) * c + t2 * d) / (2.0 * kKnot_s);
  *second = (r * a + (3 * t - 2) * b + (1 - 3 * t) * c + t * d) / (kKnot_s * kKnot_s);
}

slam::SE3 BodyPath::pose_at(double time_s) const {
  Knot value, rate, second;
  evaluate(time_s, &value, &rate, &second);
  return {rotation_of(value[3], value[4], value[5]), value.head<3>()};
}

Motion BodyPath::at(double time_s) const {
  Knot value, rate, second;
  evaluate(time_s, &value, &rate, &second);
  Motion motion;
  motion.T_world_body = {rotation_of(value[3], value[4], value[5]), value.head<3>()};
  motion.velocity_w = rate.head<3>();
  motion.acceleration_w = second.head<3>();
  // R = Rz(yaw) Ry(pitch) Rx(roll): each rate turns about its own axis, seen from the body.
  const double sp = std::sin(value[4]), cp = std::cos(value[4]), sr = std::sin(value[5]),
               cr = std::cos(value[5]);
  motion.angular_velocity_b = {rate[5] - sp * rate[3], cr * rate[4] + sr * cp * rate[3],
                               cr * cp * rate[3] - sr * rate[4]};
  const double speed = motion.velocity_w.norm();
  motion.steering_rad = speed > 0.1 ? std::atan(kWheelbase_m * rate[3] / speed) : 0.0;
  return motion;
}

double BodyPath::route_at(double time_s) const {
  const double u = std::clamp((time_s + kLead_s) / kKnot_s, 0.0, static_cast<double>(route_.size()) - 1.001);
  const auto i = static_cast<std::size_t>(u);
  return route_[i] + (u - static_cast<double>(i)) * (route_[i + 1] - route_[i]);
}

}  // namespace farpoint::tools::simulate
