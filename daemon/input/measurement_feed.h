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
  explicit MeasurementFeed(slam::Estimator* estimator) : estimator_(*estimator) {}

  // One thread a sensor; makes no heap call. The estimator counts late samples and those that find its queue
  // full. Values are finite (drivers::LogSource) except unknown ones of WHEELS, which get an infinite sigma.
  void add(const imu_t& message);
  void add(const wheels_t& message);

  // WHEELS messages with neither speed nor yaw rate: not added.
  [[nodiscard]] std::int64_t wheels_without_value() const { return wheels_without_value_; }

 private:
  slam::Estimator& estimator_;
  std::int64_t wheels_without_value_ = 0;
};

// Axes and units are the message's.
[[nodiscard]] slam::ImuSample make_sample(const imu_t& message);
// An unknown value (NaN) becomes zero with an infinite sigma; an unknown sigma (negative) becomes zero, the
// receiver's own.
[[nodiscard]] slam::WheelSample make_sample(const wheels_t& message);

}  // namespace farpoint::daemon
