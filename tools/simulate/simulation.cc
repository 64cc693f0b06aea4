// SPDX-License-Identifier: Apache-2.0
#include "tools/simulate/simulation.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "daemon/config/camera_file.h"
#include "tools/common/errors.h"
#include "tools/simulate/world/props.h"
#include "tools/simulate/world/random.h"
#include "tools/simulate/world/world_file.h"

namespace farpoint::tools::simulate {
namespace {

// Oncoming cars come into being so far ahead and vanish so far behind.
constexpr double kTrafficAhead_m = 500.0, kTrafficBehind_m = 150.0;

// The lens stays, the picture is finer or coarser; of another shape, it is cut or extended above and below.
void resize(int width_px, int height_px, slam::Camera::Parameters* p) {
  if (width_px == p->width_px && height_px == p->height_px) return;
  const double s = static_cast<double>(width_px) / p->width_px;
  p->fx_px *= s;
  p->fy_px *= s;
  p->cx_px = (p->cx_px + 0.5) * s - 0.5;
  p->cy_px = 0.5 * (height_px - 1) + (p->cy_px - 0.5 * (p->height_px - 1)) * s;
  p->width_px = width_px;
  p->height_px = height_px;
}

double wrapped(double x, double low, double high) {
  const double span = high - low;
  return x - span * std::floor((x - low) / span);
}

}  // namespace

Simulation::Simulation(const SimulationRequest& request) : request_(request) {
  description_ = parse_world(request.world_text, request.world_file);
  description_.name = request.world_name;
  seed_ = request.seed.value_or(description_.seed);
  duration_s_ = request.duration_s.value_or(description_.duration_s);
  CameraDescription& camera = description_.camera;
  if (!request.camera_text.empty()) {
    const daemon::CameraFile file = daemon::parse_camera_file(request.camera_text, request.camera_file);
    camera.parameters = file.parameters;
    if (file.T_body_camera) camera.T_body_camera = *file.T_body_camera;
    if (file.rate_hz > 0.0) camera.rate_hz = file.rate_hz;
    camera.row_time_s = std::max(file.row_time_s, 0.0);
  }
  if (request.width_px > 0) {
    resize(request.width_px, request.height_px, &camera.parameters);
    const std::string complaint = slam::Camera::check(camera.parameters);
    if (!complaint.empty()) throw InputError("--size: " + complaint);
  }
  world_ = std::make_unique<World>(description_, seed_, duration_s_);
  body_ = std::make_unique<BodyPath>(
      description_.drive
          ? BodyPath::drive(*description_.drive, world_->route(), world_->terrain(), seed_, duration_s_)
          : BodyPath::flight(*description_.flight, world_->terrain(), seed_, duration_s_));
  make_cameras();
  for (int i = 0; i < 4; ++i) {
    car_meshes_.push_back(std::make_unique<Mesh>());
    MeshBuilder builder(car_meshes_.back().get(), Eigen::Vector3d(0.4, 0.3, 0.87), description_.sky.ambient);
    add_car(&builder, Spot{}, 0.3 + 0.4 * i);
  }
}

void Simulation::make_cameras() {
  const CameraDescription& d = description_.camera;
  for (int i = 0; i < (request_.stereo ? 2 : 1); ++i) {
    CameraUnit unit;
    unit.camera = slam::Camera(d.parameters);
    unit.T_body_camera =
        d.T_body_camera * slam::SE3{Eigen::Quaterniond::Identity(), {i * d.stereo_baseline_m, 0, 0}};
    RendererOptions options;
    options.blur_px = description_.sensor.blur_px;
    unit.renderer = std::make_unique<Renderer>(unit.camera, options);
    unit.sensor = std::make_unique<CameraSensor>(description_.sensor, d.parameters, seed_at(seed_, i, 0));
    cameras_.push_back(std::move(unit));
  }
}

namespace {

// A damaged message must not ask for a world of any size.
void check_message(const simulation_t& message) {
  constexpr double kLongest_s = 86'400.0;
  constexpr int kMinSide_px = 32, kMaxSide_px = 4096;
  if (!(message.duration > 0.0 && message.duration <= kLongest_s)) {
    throw InputError("SIMULATION: duration " + std::to_string(message.duration) +
                     " s, expected above 0 and at most 86400");
  }
  const auto is_side = [](int px) { return px >= kMinSide_px && px <= kMaxSide_px; };
  if (!is_side(message.width) || !is_side(message.height)) {
    throw InputError("SIMULATION: images of " + std::to_string(message.width) + " x " +
                     std::to_string(message.height) + ", expected 32 to 4096 pixels each");
  }
}

}  // namespace

SimulationRequest Simulation::request_of(const simulation_t& message) {
  if (message.version != kSimulatorVersion) {
    throw InputError("SIMULATION: made by simulator version " + std::to_string(message.version) +
                     ", expected " + std::to_string(kSimulatorVersion) + ": its world cannot be made again");
  }
  check_message(message);
  SimulationRequest request;
  request.world_name = message.world_name;
  request.world_text = message.world;
  request.world_file = message.world_name + ".yaml";
  request.camera_text = message.camera;
  request.camera_file = "camera.yaml";
  request.seed = static_cast<std::uint64_t>(message.seed);
  request.duration_s = message.duration;
  request.width_px = message.width;
  request.height_px = message.height;
  request.stereo = message.stereo != 0;
  return request;
}

simulation_t Simulation::message() const {
  simulation_t message{};
  message.version = kSimulatorVersion;
  message.world_name = request_.world_name;
  message.world = request_.world_text;
  message.camera = request_.camera_text;
  message.seed = static_cast<std::int64_t>(seed_);
  message.duration = duration_s_;
  message.width = description_.camera.parameters.width_px;
  message.height = description_.camera.parameters.height_px;
  message.stereo = request_.stereo ? 1 : 0;
  return message;
}

std::int64_t Simulation::frames() const {
  return std::max<std::int64_t>(
      1, static_cast<std::int64_t>(std::floor(duration_s_ * description_.camera.rate_hz + 1e-9)));
}

double Simulation::frame_time_s(std::int64_t frame) const {
  return static_cast<double>(frame) / description_.camera.rate_hz;
}

CameraPath Simulation::path_of(int camera) const {
  const slam::SE3 T_body_camera = this->T_body_camera(camera);
  return [this, T_body_camera](double time_s) { return body_->pose_at(time_s) * T_body_camera; };
}

Scene Simulation::scene_at(double, const Eigen::Vector3d& position) {
  Scene scene = world_->scene_around(position);
  const TrafficDescription& traffic = description_.traffic;
  if (description_.drive && traffic.cars_ahead + traffic.cars_oncoming > 0) {
    scene.moving_at = [this](double time_s, std::vector<MovingObject>* objects) {
      place_traffic(time_s, objects);
    };
  }
  return scene;
}

// Cars keep to the vehicle's route: some drive ahead at about its speed, some come the other way.
void Simulation::place_traffic(double time_s, std::vector<MovingObject>* objects) const {
  const TrafficDescription& traffic = description_.traffic;
  const double lane = description_.drive->lane_offset_m, here = body_->route_at(time_s);
  const auto place = [&](double s, double offset, bool oncoming, std::size_t mesh) {
    const Path::Place at = world_->route().at(s);
    const Eigen::Vector2d p = at.position + offset * at.left();
    const Path::Place ahead = world_->route().at(s + 1.5);
    const double rise = world_->terrain().base(ahead.position.x(), ahead.position.y()) -
                        world_->terrain().base(at.position.x(), at.position.y());
    MovingObject object;
    object.mesh = car_meshes_[mesh % car_meshes_.size()].get();
    object.position = {p.x(), p.y(), world_->terrain().base(p.x(), p.y()) + 0.06};
    object.yaw_rad = std::atan2(at.forward.y(), at.forward.x()) + (oncoming ? std::numbers::pi : 0.0);
    object.pitch_rad = (oncoming ? 1.0 : -1.0) * std::atan(rise / 1.5);
    objects->push_back(object);
  };
  Random random(seed_of(seed_, "traffic"));
  for (int i = 0; i < traffic.cars_ahead; ++i) {
    const double gap = 30.0 + 38.0 * i + random.uniform(0.0, 14.0), phase = random.uniform(0.0, 6.28);
    place(here + gap + 6.0 * std::sin(0.15 * time_s + phase), lane + 0.15 * std::sin(0.2 * time_s + phase),
          false, static_cast<std::size_t>(i));
  }
  for (int i = 0; i < traffic.cars_oncoming; ++i) {
    const double start = random.uniform(-kTrafficBehind_m, kTrafficAhead_m),
                 speed = traffic.speed_mps * random.uniform(0.8, 1.15);
    const double ahead = wrapped(start - speed * time_s - here, -kTrafficBehind_m, kTrafficAhead_m);
    place(here + ahead, -lane, true, static_cast<std::size_t>(i) + 2);
  }
}

void Simulation::take_image(std::int64_t frame, int camera, SimulatedImage* image) {
  CameraUnit& unit = cameras_[static_cast<std::size_t>(camera)];
  const double time_s = frame_time_s(frame);
  const CameraPath path = path_of(camera);
  // Both cameras of a pair share the exposure of the first.
  const Exposure exposure = cameras_[0].sensor->exposure_at(time_s);
  if (camera == 0) image->exposure = exposure;
  const Scene scene = scene_at(time_s, path(time_s).t);
  const std::vector<float>& radiance =
      unit.renderer->render(scene, path, {time_s, image->exposure.time_s, row_time_s()});
  image->grey.resize(static_cast<std::size_t>(unit.camera.width_px()) *
                     static_cast<std::size_t>(unit.camera.height_px()));
  unit.sensor->expose(radiance, image->exposure, time_s, 1.0 / description_.camera.rate_hz,
                      image->grey.data());
}

std::vector<SeenPoint> Simulation::look(std::int64_t frame, int camera,
                                        const std::vector<Eigen::Vector2d>& pixels) {
  const double time_s = frame_time_s(frame);
  const CameraPath path = path_of(camera);
  const Scene scene = scene_at(time_s, path(time_s).t);
  return cameras_[static_cast<std::size_t>(camera)].renderer->look(scene, path, {time_s, 0.0, row_time_s()},
                                                                   pixels);
}

}  // namespace farpoint::tools::simulate
