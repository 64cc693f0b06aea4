// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/rig_depth.h"

#include <algorithm>
#include <cmath>

namespace farpoint::slam {

namespace {

// The nearest depth searched, in baselines: a nearer point looks too different in the two images.
constexpr double kNearest_baselines = 4.0;
// A landmark's depth is searched within as many of its sigmas.
constexpr double kDepthSigmas = 3.0;

}  // namespace

void RigDepth::measure(KeyframeHandle keyframe) {
  const Keyframe& k = map_.keyframes()[keyframe];
  for (int c = 1; c < k.views.size(); ++c)
    if (k.views[c].has_pixels() && !k.views[c].has_corners()) measure_by(keyframe, c);
}

double RigDepth::nearest_inverse_depth(int camera) const {
  const double baseline = (map_.camera(camera).T_body_camera.t - map_.camera(0).T_body_camera.t).norm();
  return 1.0 / (kNearest_baselines * std::max(baseline, 1e-9));
}

void RigDepth::measure_by(KeyframeHandle keyframe, int camera) {
  const std::size_t features = map_.keyframes()[keyframe].views[0].set.features.size();
  for (std::size_t i = 0; i < features; ++i) {
    const Keyframe& k = map_.keyframes()[keyframe];
    if (!k.views[camera].landmarks[i].is_null()) continue;
    LandmarkHandle handle = k.views[0].landmarks[i];
    const bool is_new = handle.is_null();
    if (is_new) handle = map_.add_landmark(keyframe, 0, i);
    if (!map_.landmarks().contains(handle)) continue;
    if (!is_new && Map::find_observation(map_.landmarks()[handle], keyframe, camera) != nullptr) continue;
    if (add_sighting(handle, keyframe, camera, i)) {
      if (is_new) ++counts_.vmp_made;
      maker_.reconsider(handle);
    } else if (is_new) {
      map_.remove_landmark(handle);
    }
  }
}

bool RigDepth::add_sighting(LandmarkHandle handle, KeyframeHandle keyframe, int camera, std::size_t feature) {
  const Landmark& l = map_.landmarks()[handle];
  Keyframe& k = map_.keyframes()[keyframe];
  KeyframeView& view = k.views[camera];
  const SE3 T_camera_anchor = map_.T_world_camera(k, camera).inverse() * map_.T_world_anchor(l);
  const CurveSearch search(map_.camera(camera).camera, T_camera_anchor, *view.image);
  CurveQuery query;
  query.patch = &l.patch;
  query.bearing = l.bearing;
  query.d_bearing_d_pixel = l.d_bearing_d_pixel;
  query.level_scale = static_cast<float>(std::pow(config_.pyramid.scale_factor, l.host_level));
  query.max_inverse_depth = nearest_inverse_depth(camera);
  if (l.inverse_depth_sigma > 0.0) {
    const double reach = kDepthSigmas * l.inverse_depth_sigma;
    query.min_inverse_depth = std::max(0.0, l.inverse_depth - reach);
    query.max_inverse_depth = std::min(query.max_inverse_depth, l.inverse_depth + reach);
  }
  const CurveMatch match = search.find(query);
  if (!match.ok) return false;
  view.set.features[feature].u_px = match.pixel.x();
  view.set.features[feature].v_px = match.pixel.y();
  const float sigma_px = std::hypot(match.sigma_px, static_cast<float>(config_.tracking.pixel_sigma_px));
  return map_.add_observation(handle, {keyframe, static_cast<std::int32_t>(feature), match.pixel, sigma_px, 0,
                                       static_cast<std::uint8_t>(camera)});
}

}  // namespace farpoint::slam
