// SPDX-License-Identifier: Apache-2.0
// Measurements of a simulation's sensors as messages. Times begin at 0 with the simulation.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <variant>

#include "farpoint/calibration_t.hpp"
#include "farpoint/ground_truth_t.hpp"
#include "farpoint/image_t.hpp"
#include "tools/simulate/sensors/motion_sensors.h"
#include "tools/simulate/simulation.h"

namespace farpoint::tools::simulate {

[[nodiscard]] std::int64_t to_utime(double time_s);

[[nodiscard]] calibration_t calibration_of(const Simulation& simulation);
[[nodiscard]] ground_truth_t truth_of(const Simulation& simulation, std::int64_t frame);
// The grey image of take_image().
[[nodiscard]] image_t grey_message(const Simulation& simulation, std::int64_t frame, int camera,
                                   const SimulatedImage& image);
// Length of the way up to that time.
[[nodiscard]] double path_length_m(const BodyPath& body, double duration_s);

struct MotionSample {
  double time_s = 0.0;
  std::variant<imu_t, wheels_t> message;
};

// IMU and wheels in order of time. Independent of the state that taking images changes.
class MotionMeasurements {
 public:
  explicit MotionMeasurements(const Simulation& simulation);
  // Returns the next sample up to `until_s`.
  [[nodiscard]] std::optional<MotionSample> next(double until_s);

 private:
  const Simulation& simulation_;
  std::unique_ptr<ImuSensor> imu_;
  std::unique_ptr<WheelSensor> wheels_;
  std::int64_t imu_samples_ = 0, wheel_samples_ = 0;
};

}  // namespace farpoint::tools::simulate
