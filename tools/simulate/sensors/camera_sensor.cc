// SPDX-License-Identifier: Apache-2.0
#include "tools/simulate/sensors/camera_sensor.h"

#include <algorithm>
#include <cmath>

namespace farpoint::tools::simulate {
namespace {

constexpr std::size_t kNormals = std::size_t{1} << 14;
constexpr int kToneSteps = 4096;
// A sunny scene's mean radiance is exposed to this share of the full well: middle grey after the tone curve.
constexpr double kTargetShare = 0.26;
constexpr double kUsualRadiance = 0.30;

}  // namespace

CameraSensor::CameraSensor(const SensorDescription& description, const slam::Camera::Parameters& camera,
                           std::uint64_t seed)
    : d_(description), seed_(seed_of(seed, "sensor")) {
  const double cx = 0.5 * (camera.width_px - 1), cy = 0.5 * (camera.height_px - 1),
               corner = std::hypot(cx, cy);
  for (int y = 0; y < camera.height_px; ++y) {
    for (int x = 0; x < camera.width_px; ++x) {
      const double r = std::hypot(x - cx, y - cy) / corner;
      fall_off_.push_back(static_cast<float>(1.0 - d_.vignetting * r * r * (0.6 + 0.4 * r * r)));
    }
  }
  Random random(seed_);
  for (std::size_t i = 0; i < kNormals; ++i) normal_.push_back(static_cast<float>(random.normal()));
  for (int i = 0; i <= kToneSteps; ++i) {
    tone_curve_.push_back(static_cast<std::uint8_t>(
        std::lround(255.0 * std::pow(static_cast<double>(i) / kToneSteps, d_.gamma))));
  }
}

// Exposure jumps, as when a cloud passes or a camera's control overshoots.
double CameraSensor::jump_at(double time_s) const {
  if (d_.jump_every_s <= 0.0) return 1.0;
  const auto i = static_cast<std::int64_t>(std::floor(time_s / d_.jump_every_s));
  Random random(seed_at(seed_, i, 5));
  const double begin = random.uniform(0.1, 0.6), length = random.uniform(0.05, 0.4);
  const double at = time_s / d_.jump_every_s - static_cast<double>(i);
  if (at < begin || at > begin + length) return 1.0;
  return random.chance(0.5) ? d_.jump_factor : 1.0 / d_.jump_factor;
}

Exposure CameraSensor::exposure_at(double time_s) const {
  const double wanted = d_.exposure_s * level_ * jump_at(time_s);
  Exposure exposure;
  exposure.time_s = std::clamp(wanted, 20e-6, d_.max_exposure_s);
  exposure.gain = std::max(1.0, wanted / exposure.time_s);
  return exposure;
}

void CameraSensor::expose(const std::vector<float>& radiance, const Exposure& exposure, double time_s,
                          double frame_interval_s, std::uint8_t* grey) {
  const double per_radiance = kTargetShare / kUsualRadiance * exposure.time_s * exposure.gain / d_.exposure_s;
  // In shares of the full well; gain multiplies the noise of the electrons with their number.
  const auto shot = static_cast<float>(exposure.gain / d_.full_well);
  const auto read = static_cast<float>(std::pow(exposure.gain * d_.read_noise / d_.full_well, 2));
  const auto factor = static_cast<float>(per_radiance);
  Random random(seed_at(seed_, static_cast<std::int64_t>(frames_++), 1));
  // Metered below the upper third: vehicles' cameras leave the sky out, and let it burn out.
  const std::size_t metered_from = fall_off_.size() / 3;
  double sum = 0.0;
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < fall_off_.size(); ++i, bits >>= 14) {
    if ((i & 3) == 0) bits = random.bits();
    const float share = radiance[i] * fall_off_[i] * factor;
    const float noisy = share + std::sqrt(share * shot + read) * normal_[bits & (kNormals - 1)];
    const int step = static_cast<int>(std::clamp(noisy, 0.0F, 1.0F) * kToneSteps + 0.5F);
    grey[i] = tone_curve_[static_cast<std::size_t>(step)];
    if (i >= metered_from) sum += std::min(share, 1.0F);
  }
  const double mean = sum / static_cast<double>(fall_off_.size() - metered_from) / jump_at(time_s);
  const double wanted = level_ * kTargetShare / std::max(mean, 1e-4);
  // The first image is metered at once: cameras are switched on before recordings begin.
  const double share = has_metered_ ? 1.0 - std::exp(-frame_interval_s / d_.adaptation_s) : 1.0;
  level_ *= std::pow(wanted / level_, share);
  has_metered_ = true;
}

}  // namespace farpoint::tools::simulate
