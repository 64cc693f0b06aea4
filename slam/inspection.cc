// SPDX-License-Identifier: Apache-2.0
#include "slam/inspection.h"

#include <algorithm>

#include "slam/back_end.h"

namespace farpoint::slam {

std::vector<MapTrajectory> Inspection::trajectories() const {
  std::vector<MapTrajectory> out;
  for (const KeptFrame& r : back_end_.recorded()) {
    Sim3 S_world_reference;
    if (!back_end_.mapper().map().similarity_of(r.reference_id, &S_world_reference)) continue;
    auto it =
        std::find_if(out.begin(), out.end(), [&](const MapTrajectory& t) { return t.map_id == r.map_id; });
    if (it == out.end()) it = out.insert(out.end(), MapTrajectory{r.map_id, {}});
    SE3 T_map_body = S_world_reference * r.T_reference_body();
    // Where there is a metre, the lever arm to the calibration's body holds.
    if (back_end_.mapper().has_metre(r.map_id)) T_map_body.t += T_map_body.q * back_end_.body_point_m();
    it->frames.push_back({r.utime, T_map_body});
  }
  for (MapTrajectory& t : out)
    std::stable_sort(t.frames.begin(), t.frames.end(),
                     [](const PosedFrame& a, const PosedFrame& b) { return a.utime < b.utime; });
  std::stable_sort(out.begin(), out.end(), [](const MapTrajectory& a, const MapTrajectory& b) {
    return a.frames.size() > b.frames.size();
  });
  return out;
}

std::vector<LandmarkInfo> Inspection::landmarks() const {
  std::vector<LandmarkInfo> out;
  const Map& map = back_end_.mapper().map();
  out.reserve(map.landmarks().size());
  map.landmarks().for_each([&](LandmarkHandle h, const Landmark& l) {
    LandmarkInfo i;
    i.slot = h.index;
    i.generation = h.generation;
    i.id = l.id;
    i.map_id = l.map_id;
    const Eigen::Vector4d p = map.world_point(l);
    i.position_map = p.head<3>() / std::max(p[3], 1e-9);
    i.inverse_depth = l.inverse_depth;
    i.inverse_depth_sigma = l.inverse_depth_sigma;
    i.creation_depth = l.creation_depth;
    i.creation_relative_sigma = l.creation_relative_sigma;
    i.through_vmp = l.through_vmp;
    i.full = l.state != LandmarkState::kBearing;
    i.observations = static_cast<int>(l.observations.size());
    i.anchor_utime = l.anchor_utime;
    i.anchor_camera = l.host_camera;
    i.anchor_pixel = l.host_pixel;
    i.anchor_map = map.T_world_anchor(l).t;
    i.created_utime = l.created_utime;
    out.push_back(i);
  });
  return out;
}

void Inspection::visit_observation_distances(const std::function<void(std::int32_t, double)>& visit) const {
  const Map& map = back_end_.mapper().map();
  map.landmarks().for_each([&](LandmarkHandle, const Landmark& l) {
    if (l.state == LandmarkState::kBearing || l.inverse_depth <= 0.0) return;
    const Eigen::Vector4d p = map.world_point(l);
    for (const Observation& o : l.observations)
      visit(l.map_id,
            (p.head<3>() / p[3] - map.T_world_camera(map.keyframes()[o.keyframe], o.camera).t).norm());
  });
}

std::vector<LandmarkSighting> Inspection::sightings(const LandmarkInfo& landmark) const {
  std::vector<LandmarkSighting> out;
  const Map& map = back_end_.mapper().map();
  if (const Landmark* l = map.landmarks().get({landmark.slot, landmark.generation})) {
    out.reserve(l->observations.size());
    for (const Observation& o : l->observations) out.push_back({map.keyframes()[o.keyframe].utime, o.pixel});
  }
  return out;
}

std::vector<SE3> Inspection::keyframe_poses() const {
  std::vector<SE3> out;
  back_end_.mapper().map().keyframes().for_each(
      [&](KeyframeHandle, const Keyframe& k) { out.push_back(k.T_world_body); });
  return out;
}

CalibrationInfo Inspection::calibration() const {
  const Calibrator& calibrator = back_end_.mapper().calibrator();
  const CalibrationDelta d = calibrator.delta(), sigma = calibrator.sigma();
  CalibrationInfo info;
  info.focal_scale = d[0], info.cx_px = d[1], info.cy_px = d[2], info.k1 = d[3];
  info.focal_scale_sigma = sigma[0], info.cx_sigma_px = sigma[1], info.cy_sigma_px = sigma[2];
  info.k1_sigma = sigma[3];
  info.contradicted = calibrator.contradicts_given();
  info.focal_scale_of_images = calibrator.wanted_by_images()[0];
  return info;
}

}  // namespace farpoint::slam
