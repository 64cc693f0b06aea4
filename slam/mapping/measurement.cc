// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/measurement.h"

#include <cmath>

namespace farpoint::slam {

namespace {
// A corner is found to about a pixel of its level; the patch is not looked for further away than twice that.
constexpr float kSearchLevelPixels = 2.0F;

PredictionInput input_from(const SE3& T_world_anchor, const Eigen::Matrix3d& R_world_anchor,
                           const Landmark& landmark) {
  PredictionInput in;
  in.point_w.head<3>() = R_world_anchor * landmark.bearing + landmark.inverse_depth * T_world_anchor.t;
  in.point_w[3] = landmark.inverse_depth;
  in.anchor_w = T_world_anchor.t;
  in.d_point_d_pixel = R_world_anchor * landmark.d_bearing_d_pixel;
  return in;
}

bool same(const SE3& a, const SE3& b) {
  return a.q.coeffs() == b.q.coeffs() && a.t == b.t;
}
}  // namespace

PredictionInput prediction_input(const Map& map, const Landmark& landmark) {
  const SE3 T_world_anchor = map.T_world_anchor(landmark);
  return input_from(T_world_anchor, T_world_anchor.rotation(), landmark);
}

PredictionInput AnchorMemory::prediction_input(const Map& map, const Landmark& landmark) {
  Anchor& a = last_[landmark.host.index];
  if (a.round != round_ || !same(a.T_host_anchor, landmark.T_host_anchor)) {
    const SE3 T_world_anchor = map.T_world_anchor(landmark);
    a = {round_, landmark.T_host_anchor, T_world_anchor, T_world_anchor.rotation()};
  }
  return input_from(a.T_world_anchor, a.R_world_anchor, landmark);
}

bool measure_observation(const EstimatorConfig& config, const Map& map, const Landmark& landmark,
                         KeyframeHandle handle, int camera, std::size_t feature, Observation* out) {
  const Keyframe& keyframe = map.keyframes()[handle];
  const KeyframeView& view = keyframe.views[camera];
  if (!view.has_pixels()) return false;
  const Feature& f = view.set.features[feature];
  const auto scale = static_cast<float>(std::pow(config.pyramid.scale_factor, f.level));
  *out = {handle,  static_cast<std::int32_t>(feature), {f.u_px, f.v_px}, scale,
          f.level, static_cast<std::uint8_t>(camera)};
  Prediction p;
  if (!predict(prediction_input(map, landmark), map.camera(camera).camera,
               map.T_world_camera(keyframe, camera).inverse(), 0.0, &p))
    return false;
  const Alignment a =
      view.image->align(landmark.patch, p.A_target_host, out->pixel, kSearchLevelPixels * scale);
  if (!a.ok) return false;
  out->pixel = a.pixel;
  out->sigma_px = std::hypot(a.sigma_px, static_cast<float>(config.tracking.pixel_sigma_px));
  return true;
}

}  // namespace farpoint::slam
