// SPDX-License-Identifier: Apache-2.0
#include "slam/fusion/wheel_motion_model.h"

#include <cmath>

namespace farpoint::slam {

namespace {

// Sigma of an unknown yaw rate: the turn of any vehicle.
constexpr double kUnknownYawRate_rad_per_s = 1.0;
// A yaw rate known no better than this tells no turn.
constexpr double kUsefulYawRate_rad_per_s = 0.1;

}  // namespace

WheelOptions track_options(const WheelConfig& config) {
  WheelOptions options;
  options.max_gap_s = config.max_gap_s;
  options.sigma_speed_m_per_s = config.speed_sigma_mps;
  options.sigma_yaw_rate_rad_per_s = config.yaw_rate_sigma_radps;
  return options;
}

std::optional<WheelSample> usable_sample(WheelSample sample, const WheelConfig& config) {
  if (!std::isfinite(sample.sigma_speed_m_per_s)) return std::nullopt;
  if (!std::isfinite(sample.sigma_yaw_rate_rad_per_s))
    sample.sigma_yaw_rate_rad_per_s = kUnknownYawRate_rad_per_s;
  sample.utime -= static_cast<std::int64_t>(std::llround(1000.0 * config.delay_ms));
  return sample;
}

WheelMotionModel::WheelMotionModel(const WheelConfig& config, const Eigen::Vector3d& point_m)
    : config_(config), point_m_(point_m), track_(track_options(config)), factor_(config.factor) {}

void WheelMotionModel::add(WheelSample sample) {
  if (const std::optional<WheelSample> usable = usable_sample(sample, config_)) (void)track_.add(*usable);
}

void WheelMotionModel::trust(WheelTrust trust, double factor) {
  trust_ = trust;
  factor_ = config_.factor * factor;
}

std::optional<SE3> WheelMotionModel::motion(std::int64_t from_utime, std::int64_t to_utime) const {
  if (trust_ == WheelTrust::kContradicted) return std::nullopt;
  const std::optional<WheelMotion> wheels = track_.up_to(from_utime, to_utime);
  if (!wheels) return std::nullopt;
  const double most_rad = kUsefulYawRate_rad_per_s * wheels->duration_s();
  if (wheels->covariance(2, 2) > most_rad * most_rad) return std::nullopt;
  SE3 T_from_to;
  T_from_to.q = so3_exp({0.0, 0.0, wheels->yaw_rad});
  T_from_to.t.head<2>() = factor_ * wheels->displacement_m;
  T_from_to.t += point_m_ - T_from_to.q * point_m_;
  return T_from_to;
}

bool WheelMotionModel::stands(std::int64_t utime) const {
  if (trust_ == WheelTrust::kContradicted) return false;
  const auto since = utime - static_cast<std::int64_t>(std::llround(1e6 * kStanding_s));
  const std::optional<WheelMotion> wheels = track_.up_to(since, utime);
  return wheels && wheels->displacement_m.norm() < kStanding_mps * kStanding_s &&
         std::fabs(wheels->yaw_rad) < kStanding_radps * kStanding_s;
}

}  // namespace farpoint::slam
