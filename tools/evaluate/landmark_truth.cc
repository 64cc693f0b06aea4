// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluate/landmark_truth.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace farpoint::tools {
namespace {

// Surfaces this much further apart, as a factor, are different ones.
constexpr double kOutlineFactor = 1.1;

std::int64_t frame_at(const simulate::Simulation& simulation, std::int64_t utime) {
  return std::llround(seconds_of(utime) * simulation.description().camera.rate_hz);
}

double path_length_m(const simulate::BodyPath& body, double from_s, double to_s) {
  constexpr double kStep_s = 0.1;
  double length = 0.0;
  for (double t = from_s; t < to_s - 1e-9; t += kStep_s)
    length += (body.pose_at(std::min(t + kStep_s, to_s)).t - body.pose_at(t).t).norm();
  return length;
}

LandmarkTarget target_of(const simulate::SeenPoint& seen) {
  if (seen.is_moving) return LandmarkTarget::kMoving;
  if (!std::isfinite(seen.nearest_m)) return LandmarkTarget::kSky;
  return seen.farthest_m > kOutlineFactor * seen.nearest_m ? LandmarkTarget::kOutline
                                                           : LandmarkTarget::kSurface;
}

}  // namespace

double local_scale(const std::vector<PosePair>& pairs, double time_s, double fallback) {
  constexpr double kWindow_s = 3.0, kLeastWay_m = 2.0;
  const auto first = std::lower_bound(pairs.begin(), pairs.end(), time_s - kWindow_s,
                                      [](const PosePair& p, double t) { return p.time_s < t; });
  auto last = first;
  double way_m = 0.0;
  for (; last != pairs.end() && last->time_s <= time_s + kWindow_s; ++last) {
    if (last != first) way_m += (last->T_world_body.t - std::prev(last)->T_world_body.t).norm();
  }
  if (way_m < kLeastWay_m) return fallback;
  const auto aligned = align({first, last}, Alignment::kSim3, false);
  return aligned ? aligned->scale : fallback;
}

SimulatedWorld::SimulatedWorld(const simulation_t& message)
    : simulation_(simulate::Simulation::request_of(message)) {}

bool SimulatedWorld::is_during_recording(std::int64_t utime) const {
  const std::int64_t frame = frame_at(simulation_, utime);
  return utime >= 0 && frame < simulation_.frames();
}

// The messages of a damaged or foreign log hold any number.
bool SimulatedWorld::is_of_recording(const landmark_t& l) const {
  if (l.anchor_camera < 0 || l.anchor_camera >= simulation_.cameras()) return false;
  const slam::Camera& camera = simulation_.camera(l.anchor_camera);
  const auto is_within = [](float pixel, int side_px) {  // NaN: false
    return pixel >= -0.5F && static_cast<double>(pixel) <= side_px - 0.5;
  };
  return is_within(l.anchor_pixel[0], camera.width_px()) &&
         is_within(l.anchor_pixel[1], camera.height_px()) && is_during_recording(l.anchor_utime) &&
         is_during_recording(l.created_utime) && Eigen::Map<const Eigen::Vector3d>(l.position).allFinite() &&
         std::isfinite(l.distance) && std::isfinite(l.relative_sigma);
}

JudgedLandmarks SimulatedWorld::judge(const landmarks_t& landmarks, std::int32_t map_id,
                                      const std::vector<PosePair>& pairs, const MapToWorld& map_to_world) {
  JudgedLandmarks judged;
  // Frame by frame, since drawing a frame costs more than a thousand of its pixels.
  std::map<std::pair<std::int64_t, int>, std::vector<const landmark_t*>> by_frame;
  for (const landmark_t& landmark : landmarks.landmarks) {
    if (landmark.map_id != map_id) continue;
    if (is_of_recording(landmark))
      by_frame[{frame_at(simulation_, landmark.anchor_utime), landmark.anchor_camera}].push_back(&landmark);
    else
      ++judged.refused;
  }
  for (const auto& [frame_and_camera, seen_here] : by_frame) {
    const auto& [frame, camera] = frame_and_camera;
    std::vector<Eigen::Vector2d> pixels;
    for (const landmark_t* l : seen_here) pixels.emplace_back(l->anchor_pixel[0], l->anchor_pixel[1]);
    const std::vector<simulate::SeenPoint> seen = simulation_.look(frame, camera, pixels);
    const double scale = local_scale(pairs, simulation_.frame_time_s(frame), map_to_world.scale);
    for (std::size_t i = 0; i < seen_here.size(); ++i)
      judged.landmarks.push_back(judge_one(*seen_here[i], seen[i], scale, map_to_world));
  }
  return judged;
}

JudgedLandmark SimulatedWorld::judge_one(const landmark_t& landmark, const simulate::SeenPoint& seen,
                                         double scale, const MapToWorld& map_to_world) const {
  JudgedLandmark judged;
  judged.target = target_of(seen);
  judged.through_vmp = landmark.through_vmp != 0;
  judged.true_distance_m = judged.target == LandmarkTarget::kOutline ? seen.nearest_m : seen.distance_m;
  judged.distance_m = scale * landmark.distance;
  judged.relative_sigma = landmark.relative_sigma;
  judged.sigmas = (1.0 - judged.distance_m / judged.true_distance_m) / judged.relative_sigma;
  const double seen_s = seconds_of(landmark.anchor_utime), born_s = seconds_of(landmark.created_utime);
  judged.wait_s = born_s - seen_s;
  judged.wait_m = path_length_m(simulation_.body(), seen_s, born_s);
  if (std::isfinite(judged.true_distance_m)) judge_place(landmark, map_to_world, &judged);
  return judged;
}

// What needs the true point itself.
void SimulatedWorld::judge_place(const landmark_t& landmark, const MapToWorld& map_to_world,
                                 JudgedLandmark* judged) const {
  const slam::Camera& camera = simulation_.camera(landmark.anchor_camera);
  const auto camera_at = [&](double time_s) {
    return simulation_.body().pose_at(time_s) * simulation_.T_body_camera(landmark.anchor_camera);
  };
  const Eigen::Vector2d pixel(landmark.anchor_pixel[0], landmark.anchor_pixel[1]);
  Eigen::Vector3d ray;
  if (!camera.unproject(pixel, &ray)) return;
  const double row_s = simulation_.row_time_s() * (pixel.y() - 0.5 * (camera.height_px() - 1));
  const slam::SE3 anchor = camera_at(seconds_of(landmark.anchor_utime) + row_s);
  const Eigen::Vector3d point = anchor * Eigen::Vector3d(judged->true_distance_m * ray);
  const Eigen::Vector3d from_anchor = point - anchor.t,
                        from_birth = point - camera_at(seconds_of(landmark.created_utime)).t;
  judged->born_at_m = from_birth.norm();
  judged->parallax_rad = std::atan2(from_anchor.cross(from_birth).norm(), from_anchor.dot(from_birth));
  const Eigen::Vector3d estimate(landmark.position[0], landmark.position[1], landmark.position[2]);
  judged->position_error_m = (map_to_world.S_world_map * estimate - point).norm();
}

}  // namespace farpoint::tools
