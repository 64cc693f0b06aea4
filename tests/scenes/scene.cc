// SPDX-License-Identifier: Apache-2.0
#include "tests/scenes/scene.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace farpoint::sim {

namespace {

using slam::SE3;

constexpr double kPi = 3.14159265358979323846;
constexpr double kCameraHeight_m = 1.65;

slam::Camera::Parameters vehicle_camera() {
  slam::Camera::Parameters p;
  p.width_px = 1241, p.height_px = 376;
  p.fx_px = p.fy_px = 718.0, p.cx_px = 607.0, p.cy_px = 185.0;
  return p;
}

slam::Camera::Parameters drone_camera() {
  slam::Camera::Parameters p;
  p.width_px = 752, p.height_px = 480;
  p.fx_px = 458.0, p.fy_px = 457.0, p.cx_px = 367.0, p.cy_px = 248.0;
  p.distortion = {-0.283, 0.074, 0.0002, 0.00002, 0.0};
  return p;
}

// Camera axes (x right, y down, z forward) on body axes (x forward, y left, z up), pitched down.
SE3 forward_camera(double pitch_down_rad) {
  SE3 T;
  T.q = (slam::so3_exp({0.0, pitch_down_rad, 0.0}) * slam::q_body_forward_camera()).normalized();
  return T;
}

Layer roadside(int points, double near_m, double far_m, double height_m, double typical_m) {
  Layer l;
  l.shape = Layer::Shape::kRoadside;
  l.points = points;
  l.near_m = near_m, l.far_m = far_m, l.height_m = height_m, l.typical_m = typical_m;
  l.behind_m = 20, l.ahead_m = 4.5 * typical_m;
  return l;
}

Layer road(int points, double half_width_m) {
  Layer l;
  l.shape = Layer::Shape::kRoad;
  l.points = points;
  l.far_m = half_width_m, l.typical_m = 14;
  l.behind_m = 10, l.ahead_m = 60;
  return l;
}

Layer landscape(int points, double near_m, double far_m, double rise) {
  Layer l;
  l.shape = Layer::Shape::kLandscape;
  l.points = points;
  l.near_m = near_m, l.far_m = far_m, l.rise = rise;
  l.behind_m = far_m, l.ahead_m = far_m;
  l.stretch_m = far_m > 500 ? 100 : 20;
  l.limit_low = 0.25, l.limit_high = 0.7;
  return l;
}

// Straight, a quarter turn with its clothoids, and so on.
std::vector<Path::Segment> turns() {
  std::vector<Path::Segment> path;
  constexpr double kCurvature = 1.0 / 14.0;
  constexpr double kEase_m = 8.0;
  const double arc_m = 0.5 * kPi / kCurvature - kEase_m;  // the two eases turn half as much a metre
  double side = 1.0;
  for (int i = 0; i < 4; ++i) {
    path.push_back({i == 0 ? 60.0 : 45.0, 0.0, 0.0});
    path.push_back({kEase_m, 0.0, side * kCurvature});
    path.push_back({arc_m, side * kCurvature, side * kCurvature});
    path.push_back({kEase_m, side * kCurvature, 0.0});
    if (i % 2 == 0) side = -side;
  }
  return path;
}

Scene vehicle(const std::string& name) {
  Scene s;
  s.name = name;
  s.camera = vehicle_camera();
  s.T_body_camera = forward_camera(0.0);
  return s;
}

Scene drone(const std::string& name) {
  Scene s;
  s.name = name;
  s.camera = drone_camera();
  s.T_body_camera = forward_camera(0.45);
  s.rate_hz = 20;
  s.motion = Motion::kDrone;
  s.speed_m_s = 8;
  // The ground from under the start to the horizon; twice, since one landscape has no room for enough points.
  for (int i = 0; i < 2; ++i) {
    Layer ground = landscape(9000, i == 0 ? 20.0 : 60.0, i == 0 ? 400.0 : 3000.0, i == 0 ? 0.02 : 0.05);
    ground.stretch_m = 0;
    ground.limit_low = 0.35, ground.limit_high = 1.0;
    s.layers.push_back(ground);
  }
  return s;
}

}  // namespace

slam::Rig Scene::rig() const {
  slam::Rig out;
  out.cameras.push_back({"camera", slam::Camera(camera), T_body_camera});
  return out;
}

slam::Rig Scene::believed_rig() const {
  Scene believed = *this;
  believed.camera.fx_px *= 1.0 + focal_error;
  believed.camera.fy_px *= 1.0 + focal_error;
  return believed.rig();
}

slam::EstimatorConfig Scene::estimator(slam::LandmarkMode mode) const {
  slam::EstimatorConfig config;
  config.extractor.features = features;
  config.landmarks.mode = mode;
  return config;
}

std::vector<std::string> scene_names() {
  return {"straight", "highway", "turning", "hovering", "rotating", "endless", "hover_start"};
}

Scene make_scene(const std::string& name) {
  if (name == "straight" || name == "endless") {
    Scene s = vehicle(name);
    s.layers = {roadside(220, 3.0, 18.0, 7.0, 25.0), road(50, 4.0), landscape(60, 25.0, 300.0, 0.15),
                landscape(40, 200.0, 3000.0, 0.09)};
    if (name == "endless") s.frames = 600, s.beyond = Path::Beyond::kWinding;
    return s;
  }
  if (name == "highway") {
    Scene s = vehicle(name);
    s.speed_m_s = 25;
    s.layers = {roadside(45, 5.0, 25.0, 2.0, 30.0), road(40, 6.0), landscape(50, 50.0, 500.0, 0.10),
                landscape(90, 300.0, 3000.0, 0.07)};
    return s;
  }
  if (name == "turning") {
    Scene s = vehicle(name);
    s.speed_m_s = 7;
    s.path = turns();
    s.frames = 400;
    s.layers = {roadside(150, 4.0, 18.0, 6.0, 22.0), road(40, 4.0), landscape(40, 30.0, 250.0, 0.12),
                landscape(60, 200.0, 3000.0, 0.09)};
    return s;
  }
  if (name == "hovering") {
    Scene s = drone(name);
    s.frames = 600;
    return s;
  }
  if (name == "hover_start") {
    Scene s = drone(name);
    s.motion = Motion::kHoverThenFly;
    s.frames = 300;
    s.still_frames = 120;
    return s;
  }
  if (name == "rotating") {
    Scene s = vehicle(name);
    s.camera = drone_camera();
    s.rate_hz = 20;
    s.motion = Motion::kRotation;
    s.far = false;
    Layer all = landscape(16000, 1.0, 3000.0, 0.0);
    all.shape = Layer::Shape::kBall;
    all.stretch_m = 0;
    all.centre_height_m = kCameraHeight_m;
    s.layers = {all};
    return s;
  }
  throw std::invalid_argument("scene '" + name +
                              "': unknown; expected straight, highway, turning, hovering, rotating, "
                              "endless or hover_start");
}

MotionModel::MotionModel(const Scene& scene, std::uint64_t seed)
    : motion_(scene.motion), speed_m_s_(scene.speed_m_s) {
  WorldDraw draw(combine({seed, 0x6d6f74696f6eULL}));
  for (double& p : phase_) p = draw.uniform(0.0, 2.0 * kPi);
}

double MotionModel::travelled_m(double t_s) const {
  if (motion_ != Motion::kVehicle) return 0.0;
  // The speed varies by a tenth over 9 s.
  constexpr double kRate = 2.0 * kPi / 9.0;
  return speed_m_s_ * (t_s - 0.1 / kRate * (std::cos(kRate * t_s + phase_[0]) - std::cos(phase_[0])));
}

SE3 MotionModel::T_world_body(double t_s, Path* path) const {
  const auto wave = [&](double hz, int i) { return std::sin(2.0 * kPi * hz * t_s + phase_[i]); };
  SE3 T;
  if (motion_ == Motion::kVehicle) {
    const Path::Place place = path->at(travelled_m(t_s));
    const double roll = 0.006 * wave(1.1, 1), pitch = 0.005 * wave(1.6, 2), yaw = 0.004 * wave(0.3, 3);
    T.q = slam::so3_exp({0.0, 0.0, place.heading_rad + yaw}) * slam::so3_exp({0.0, pitch, 0.0}) *
          slam::so3_exp({roll, 0.0, 0.0});
    T.t << place.position, kCameraHeight_m + 0.02 * wave(1.6, 4);
    return T;
  }
  if (motion_ == Motion::kRotation) {
    const double yaw = 1.2 * (wave(0.06, 0) - std::sin(phase_[0])), pitch = 0.15 * wave(0.11, 1),
                 roll = 0.1 * wave(0.09, 2);
    T.q = slam::so3_exp({0.0, 0.0, yaw}) * slam::so3_exp({0.0, pitch, 0.0}) * slam::so3_exp({roll, 0.0, 0.0});
    T.t << 0.0, 0.0, kCameraHeight_m;
    return T;
  }
  // A drone: smooth ramps between where it is at certain times.
  struct Knot {
    double t_s, x_m, y_m, z_m, yaw_rad;
  };
  static const std::vector<Knot> kFlight{{0, 0, 0, 50, 0},
                                         {5, 6, 0, 80, 0},
                                         {13, 70, 10, 85, 0.15},
                                         {19, 70, 10, 85, 1.4},
                                         {30, 80, 90, 70, 1.5}};
  static const std::vector<Knot> kHover{{0, 0, 0, 70, 0}, {6, 0, 0, 70, 0}, {15, 70, 10, 75, 0.2}};
  const std::vector<Knot>& knots = motion_ == Motion::kDrone ? kFlight : kHover;
  std::size_t i = 1;
  while (i + 1 < knots.size() && t_s > knots[i].t_s) ++i;
  const Knot &a = knots[i - 1], &b = knots[i];
  const double x = std::clamp((t_s - a.t_s) / (b.t_s - a.t_s), 0.0, 1.0);
  const double share = x * x * (3.0 - 2.0 * x);
  const auto between = [share](double from, double to) { return from + share * (to - from); };
  const double roll = 0.02 * wave(0.4, 1), pitch = 0.02 * wave(0.3, 2),
               yaw = between(a.yaw_rad, b.yaw_rad) + 0.01 * wave(0.2, 3);
  T.q = slam::so3_exp({0.0, 0.0, yaw}) * slam::so3_exp({0.0, pitch, 0.0}) * slam::so3_exp({roll, 0.0, 0.0});
  // Wind moves it by 0.15 m.
  T.t << between(a.x_m, b.x_m) + 0.15 * wave(0.25, 4), between(a.y_m, b.y_m) + 0.15 * wave(0.2, 5),
      between(a.z_m, b.z_m) + 0.1 * wave(0.3, 0);
  return T;
}

}  // namespace farpoint::sim
