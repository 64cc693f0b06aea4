// SPDX-License-Identifier: Apache-2.0
// A simulated recording: a world, the vehicle's motion through it, and its sensors' measurements at any time.
//
// Made again from a log's SIMULATION message, the same object gives the true distance along any pixel of any
// frame.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "farpoint/simulation_t.hpp"
#include "tools/simulate/render/renderer.h"
#include "tools/simulate/sensors/camera_sensor.h"
#include "tools/simulate/sensors/vehicle_motion.h"
#include "tools/simulate/world/world.h"

namespace farpoint::tools::simulate {

// Raised whenever the bytes of the same request change.
constexpr int kSimulatorVersion = 1;

struct SimulationRequest {
  std::string world_name;
  std::string world_text, world_file;    // content of the world file, and its name for complaints
  std::string camera_text, camera_file;  // of --camera; empty: the world's own camera
  std::optional<std::uint64_t> seed;     // nothing: the world's
  std::optional<double> duration_s;
  int width_px = 0, height_px = 0;  // 0: the camera's own; the lens stays the same
  bool stereo = false;
};

struct SimulatedImage {
  Exposure exposure;
  std::vector<std::uint8_t> grey;
};

class Simulation {
 public:
  // Throws InputError for an invalid request.
  explicit Simulation(const SimulationRequest& request);
  // Returns the simulation of a log. Throws InputError for a log of another version.
  [[nodiscard]] static SimulationRequest request_of(const simulation_t& message);
  [[nodiscard]] simulation_t message() const;

  [[nodiscard]] const WorldDescription& description() const { return description_; }
  [[nodiscard]] std::uint64_t seed() const { return seed_; }
  [[nodiscard]] double duration_s() const { return duration_s_; }
  [[nodiscard]] const BodyPath& body() const { return *body_; }
  [[nodiscard]] int cameras() const { return static_cast<int>(cameras_.size()); }
  [[nodiscard]] const slam::Camera& camera(int index) const {
    return cameras_[static_cast<std::size_t>(index)].camera;
  }
  [[nodiscard]] const slam::SE3& T_body_camera(int index) const {
    return cameras_[static_cast<std::size_t>(index)].T_body_camera;
  }
  [[nodiscard]] std::int64_t frames() const;
  [[nodiscard]] double frame_time_s(std::int64_t frame) const;
  [[nodiscard]] double row_time_s() const { return description_.camera.row_time_s; }

  // Images must be taken in order, camera 0 first, since exposure and noise depend on earlier ones.
  void take_image(std::int64_t frame, int camera, SimulatedImage* image);

  // Truth: the surfaces along pixels of a frame. In any order.
  [[nodiscard]] std::vector<SeenPoint> look(std::int64_t frame, int camera,
                                            const std::vector<Eigen::Vector2d>& pixels);

 private:
  struct CameraUnit {
    slam::Camera camera;
    slam::SE3 T_body_camera;
    std::unique_ptr<Renderer> renderer;
    std::unique_ptr<CameraSensor> sensor;
  };

  void make_cameras();
  [[nodiscard]] Scene scene_at(double time_s, const Eigen::Vector3d& position);
  [[nodiscard]] CameraPath path_of(int camera) const;
  void place_traffic(double time_s, std::vector<MovingObject>* objects) const;

  SimulationRequest request_;
  WorldDescription description_;
  std::uint64_t seed_ = 0;
  double duration_s_ = 0.0;
  std::unique_ptr<World> world_;
  std::unique_ptr<BodyPath> body_;
  std::vector<CameraUnit> cameras_;
  std::vector<std::unique_ptr<Mesh>> car_meshes_;
};

}  // namespace farpoint::tools::simulate
