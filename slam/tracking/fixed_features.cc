// SPDX-License-Identifier: Apache-2.0
#include "slam/tracking/fixed_features.h"

#include <algorithm>

#include "slam/image/descriptor_search.h"
#include "slam/tracking/work_space.h"

namespace farpoint::slam {

namespace {

// A corner is found to about one pixel: within kSame_px it kept its place, and beyond kTold_px a turn has
// moved it.
constexpr float kSame_px = 1.5F;
constexpr double kTold_px = 5.0;
// Bits, of 256: noise changes fewer.
constexpr int kSameDescriptor = 64;
// Fewest features that a turn moved, for a share of them.
constexpr int kLeastMoved = 60;
// Least time from turn to turn, which bounds the work, and longest: light and shadow change a bonnet too.
constexpr double kLeast_s = 0.15, kLongest_s = 1.0;

}  // namespace

FixedFeatures::FixedFeatures(std::size_t features) {
  reserve_touched(&reference_.features, features);
  reserve_touched(&reference_.descriptors, features);
}

std::size_t FixedFeatures::bytes() const {
  return capacity_bytes(reference_.features) + capacity_bytes(reference_.descriptors);
}

double FixedFeatures::share() const {
  return 0.5 * (last_share_ + share_before_);
}

void FixedFeatures::add(const FeatureSet& set, const FeatureGrid& grid, const Camera& camera,
                        const Eigen::Quaterniond& q_map_camera, std::int64_t utime) {
  if (reference_.features.empty()) {
    set_reference(set, q_map_camera, utime);
    return;
  }
  const double age_s = 1e-6 * static_cast<double>(utime - reference_utime_);
  const double turn_rad = q_map_reference_.angularDistance(q_map_camera);
  const bool turned = turn_rad * camera.focal_px() > kTold_px && age_s > kLeast_s && !set.features.empty();
  if (turned) compare(set, grid, camera, q_map_camera.conjugate() * q_map_reference_);
  if (turned || age_s > kLongest_s) set_reference(set, q_map_camera, utime);
}

void FixedFeatures::compare(const FeatureSet& set, const FeatureGrid& grid, const Camera& camera,
                            const Eigen::Quaterniond& q_now_reference) {
  int moved = 0, fixed = 0;
  for (std::size_t i = 0; i < reference_.features.size(); ++i) {
    const Feature& f = reference_.features[i];
    const Eigen::Vector2d before(f.u_px, f.v_px);
    Eigen::Vector3d bearing;
    Eigen::Vector2d after;
    if (!camera.unproject(before, &bearing) || !camera.project(q_now_reference * bearing, &after)) continue;
    if ((after - before).norm() < kTold_px) continue;
    ++moved;
    const DescriptorQuery query{.descriptor = reference_.descriptors[i],
                                .u_px = f.u_px,
                                .v_px = f.v_px,
                                .radius_px = kSame_px,
                                .min_level = f.level,
                                .max_level = f.level,
                                .max_hamming = kSameDescriptor,
                                .ratio = 1.0F};
    fixed += find_descriptor(set, grid, query, [](std::size_t) { return true; }) >= 0 ? 1 : 0;
  }
  if (moved < kLeastMoved) return;
  share_before_ = last_share_;
  last_share_ = static_cast<double>(fixed) / moved;
}

void FixedFeatures::set_reference(const FeatureSet& set, const Eigen::Quaterniond& q_map_camera,
                                  std::int64_t utime) {
  const std::size_t count = std::min(set.features.size(), reference_.features.capacity());
  const auto end = static_cast<std::ptrdiff_t>(count);
  reference_.features.assign(set.features.begin(), set.features.begin() + end);
  reference_.descriptors.assign(set.descriptors.begin(), set.descriptors.begin() + end);
  q_map_reference_ = q_map_camera;
  reference_utime_ = utime;
}

}  // namespace farpoint::slam
