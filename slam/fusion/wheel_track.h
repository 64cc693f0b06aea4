// SPDX-License-Identifier: Apache-2.0
// The wheels' last seconds: a ring of samples, and the body's planar motion between two times.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "slam/map/wheel_motion.h"
#include "slam/measurement.h"

namespace farpoint::slam {

struct WheelOptions {
  std::size_t capacity = 1024;  // samples; at 100 Hz the last ten seconds
  double max_gap_s = 0.25;      // between two samples; motion across a longer gap is unknown
  // 1 sigma of one reading, for samples that bring none of their own.
  double sigma_speed_m_per_s = 0.05;
  double sigma_yaw_rate_rad_per_s = 0.01;
  // Motion across the rolling direction, as an error of each reading.
  double sigma_slip_m_per_s = 0.05;
};

struct WheelCounts {
  std::uint64_t taken = 0;
  std::uint64_t late = 0;     // not after the newest sample
  std::uint64_t invalid = 0;  // not finite, or a negative sigma
};

// One thread. No heap call after the constructor.
class WheelTrack {
 public:
  explicit WheelTrack(const WheelOptions& options = {});

  // Takes a sample; the oldest one leaves a full ring. False where the sample is late or invalid.
  bool add(const WheelSample& given);
  void clear() { size_ = 0; }

  // The motion from one time to a later one. Samples are interpolated linearly in time. Empty where the ring
  // does not reach from `from_utime` to `to_utime` without a gap.
  [[nodiscard]] std::optional<WheelMotion> between(std::int64_t from_utime, std::int64_t to_utime) const;
  // The same for the present: the newest reading holds until `to_utime`, for max_gap_s at most.
  [[nodiscard]] std::optional<WheelMotion> up_to(std::int64_t from_utime, std::int64_t to_utime) const;

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] const WheelCounts& counts() const { return counts_; }

 private:
  // Ascending in time; 0 is the oldest.
  [[nodiscard]] const WheelSample& sample(std::size_t i) const { return ring_[(first_ + i) % ring_.size()]; }
  [[nodiscard]] bool is_gap(std::int64_t from_utime, std::int64_t to_utime) const;
  [[nodiscard]] std::size_t first_after(std::int64_t utime) const;
  [[nodiscard]] WheelSample with_sigmas(WheelSample sample) const;

  WheelOptions options_;
  std::vector<WheelSample> ring_;
  std::size_t first_ = 0, size_ = 0;
  WheelCounts counts_;
};

}  // namespace farpoint::slam
