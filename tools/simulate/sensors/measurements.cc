// SPDX-License-Identifier: Apache-2.0
#include "tools/simulate/sensors/measurements.h"

#include <algorithm>
#include <cmath>

#include "daemon/config/calibration_message.h"

namespace farpoint::tools::simulate {

std::int64_t to_utime(double time_s) {
  return std::llround(time_s * 1e6);
}

calibration_t calibration_of(const Simulation& simulation) {
  const WorldDescription& world = simulation.description();
  calibration_t message{};
  message.body_name = world.drive ? "vehicle" : "drone";
  for (int i = 0; i < simulation.cameras(); ++i) {
    const char* name = simulation.cameras() == 1 ? "camera" : i == 0 ? "left" : "right";
    message.cameras.push_back(daemon::camera_message(name, simulation.camera(i).parameters(),
                                                     simulation.T_body_camera(i), world.camera.rate_hz,
                                                     simulation.row_time_s()));
  }
  message.ncameras = simulation.cameras();
  message.imu_orientation[0] = 1.0;
  if (!world.imu) return message;
  message.has_imu = 1;
  daemon::set_pose(world.imu->T_body_imu, message.imu_position, message.imu_orientation);
  message.imu_rate_hz = world.imu->rate_hz;
  message.gyro_noise_density = world.imu->gyro_noise_density;
  message.gyro_random_walk = world.imu->gyro_random_walk;
  message.accel_noise_density = world.imu->accel_noise_density;
  message.accel_random_walk = world.imu->accel_random_walk;
  return message;
}

ground_truth_t truth_of(const Simulation& simulation, std::int64_t frame) {
  const double time_s = simulation.frame_time_s(frame);
  ground_truth_t truth{};
  truth.utime = to_utime(time_s);
  truth.has_orientation = 1;
  daemon::set_pose(simulation.body().pose_at(time_s), truth.position, truth.orientation);
  return truth;
}

image_t grey_message(const Simulation& simulation, std::int64_t frame, int camera,
                     const SimulatedImage& image) {
  image_t message{};
  message.utime = to_utime(simulation.frame_time_s(frame));
  message.sequence = frame;
  message.camera = camera;
  message.exposure_us = static_cast<std::int32_t>(std::lround(image.exposure.time_s * 1e6));
  message.gain = static_cast<float>(image.exposure.gain);
  message.width = message.row_stride = simulation.camera(camera).width_px();
  message.height = simulation.camera(camera).height_px();
  message.pixel_format = image_t::PIXEL_FORMAT_GREY;
  message.data = image.grey;
  message.size = static_cast<std::int32_t>(message.data.size());
  return message;
}

double path_length_m(const BodyPath& body, double duration_s) {
  constexpr double kStep_s = 0.1;
  double length = 0.0;
  for (double t = 0.0; t + kStep_s <= duration_s; t += kStep_s)
    length += (body.pose_at(t + kStep_s).t - body.pose_at(t).t).norm();
  return length;
}

MotionMeasurements::MotionMeasurements(const Simulation& simulation) : simulation_(simulation) {
  const WorldDescription& world = simulation.description();
  if (world.imu) imu_ = std::make_unique<ImuSensor>(*world.imu, simulation.seed());
  if (world.wheels) wheels_ = std::make_unique<WheelSensor>(*world.wheels, simulation.seed());
}

std::optional<MotionSample> MotionMeasurements::next(double until_s) {
  constexpr double kNever_s = 1e18;
  const WorldDescription& world = simulation_.description();
  const double imu_s = imu_ ? static_cast<double>(imu_samples_) / world.imu->rate_hz : kNever_s;
  const double wheels_s = wheels_ ? static_cast<double>(wheel_samples_) / world.wheels->rate_hz : kNever_s;
  const double time_s = std::min(imu_s, wheels_s);
  if (time_s > until_s + 1e-9) return std::nullopt;
  std::optional<MotionSample> sample(std::in_place);
  sample->time_s = time_s;
  if (imu_s <= wheels_s) {
    ++imu_samples_;
    sample->message = imu_->sample(simulation_.body(), time_s);
  } else {
    ++wheel_samples_;
    sample->message = wheels_->sample(simulation_.body(), time_s);
  }
  return sample;
}

}  // namespace farpoint::tools::simulate
