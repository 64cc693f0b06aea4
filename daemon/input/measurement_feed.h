// SPDX-License-Identifier: Apache-2.0
// IMU and WHEELS messages as the estimator's samples.
#pragma once

#include <cstdint>

#include "ipc/message.h"
#include "slam/estimator.h"

namespace farpoint::daemon {

class MeasurementFeed {
 public:
  // The estimator outlives this.
  MeasurementFeed(slam::Estimator* estimator, const slam::WheelConfig& wheels)
      : estimator_(*estimator), wheels_(wheels) {}

  // One thread a sensor; makes no heap call. The estimator counts late samples and those that find its queue
  // full. Values are finite (drivers::LogSource) except unknown ones of WHEELS, which get an infinite sigma.
  void add(const imu_t& message);
  void add(const wheels_t& message);

  // WHEELS messages with neither speed nor yaw rate: not added.
  [[nodiscard]] std::int64_t wheels_without_value() const { return wheels_without_value_; }

 private:
  slam::Estimator& estimator_;
  const slam::WheelConfig wheels_;
  std::int64_t wheels_without_value_ = 0;
};

// Axes and units are the message's.
[[nodiscard]] slam::ImuSample make_sample(const imu_t& message);
// An unknown value (NaN) becomes zero with an infinite sigma; an unknown sigma (negative) becomes zero, the
// receiver's own. Without a yaw rate the wheels of one axle give it where `config` has their track.
[[nodiscard]] slam::WheelSample make_sample(const wheels_t& message, const slam::WheelConfig& config);

}  // namespace farpoint::daemon
