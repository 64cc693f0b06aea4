#include "slam/estimator.h"

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "slam/back_end.h"
#include "slam/exchange.h"
#include "slam/front_end.h"

namespace farpoint::slam {

const char* to_string(State state) {
  switch (state) {
    case State::kStarting:
      return "starting";
    case State::kInitialising:
      return "initialising";
    case State::kSettling:
      return "settling";
    case State::kTracking:
      return "tracking";
    case State::kDegraded:
      return "degraded";
    case State::kLost:
      return "lost";
    case State::kRelocalising:
      return "relocalising";
    case State::kNoCamera:
      return "no_camera";
  }
  return "unknown";
}

namespace {

Rig usable_rig(const Rig& rig) {
  if (rig.cameras.empty())
    throw std::invalid_argument("rig: no camera; at least one calibrated camera is needed");
  Rig out = rig;
  for (const RigCamera& c : out.cameras)
    if (const std::string why = Camera::check(c.camera.parameters()); !why.empty())
      throw std::invalid_argument("camera '" + c.name + "': " + why);
  // The lever arm is in metres and the map is not (config.h).
  const Eigen::Vector3d origin = out.cameras.front().T_body_camera.t;
  for (RigCamera& c : out.cameras) c.T_body_camera.t -= origin;
  return out;
}

}  // namespace

struct Estimator::Impl {
  Impl(const EstimatorConfig& config, const Rig& given)
      : rig(usable_rig(given)),
        exchange(config),
        tracking(config, rig, &exchange),
        mapping(config, rig, &exchange) {}

  bool map() {
    if (!mapping.step()) return false;
    const MappingReply& reply = mapping.reply();
    if (reply.view && observer)
      observer({reply.number, reply.utime, reply.view->map_id, reply.stage == MappingStage::kFull});
    replies = reply.number;
    mapping.hand_over();
    return true;
  }

  template <typename Input>
  const FrameResult& lockstep(Input&& input) {
    tracking.track(std::forward<Input>(input), ReplyLimit{});
    while (map()) {
    }
    return tracking.take_replies_at_once();
  }

  const Rig rig;
  Exchange exchange;
  TrackingSide tracking;
  MappingSide mapping;
  std::function<void(const MappingNote&)> observer;
  std::uint64_t replies = 0;  // that mapping has given; mapping's thread
};

Estimator::Estimator(const EstimatorConfig& config, const Rig& rig) {
  // Eigen cuts large products into pieces by the sizes of the caches that it finds, and each cut rounds
  // otherwise: sizes of our own, common ones, or a log would give other bytes on another processor.
  constexpr int kL1_bytes = 32 << 10, kL2_bytes = 512 << 10, kL3_bytes = 4 << 20;
  Eigen::setCpuCacheSizes(kL1_bytes, kL2_bytes, kL3_bytes);
  impl_ = std::make_unique<Impl>(config, rig);
}
Estimator::~Estimator() = default;

const FrameResult& Estimator::process(const FrameInput& input) {
  return impl_->lockstep(input);
}

const FrameResult& Estimator::process(FeatureInput&& input) {
  return impl_->lockstep(std::move(input));
}

const FrameResult& Estimator::track(const FrameInput& input) {
  return impl_->tracking.track(input, {.by_delay = false});
}

bool Estimator::map() {
  return impl_->map();
}

const FrameResult& Estimator::process_recorded(const FrameInput& input, std::uint64_t replies_taken) {
  while (impl_->replies < replies_taken && impl_->map()) {
  }
  return impl_->tracking.track(input, {.by_delay = false, .up_to = replies_taken});
}

void Estimator::on_view(std::function<void(const MappingNote&)> observer) {
  impl_->observer = std::move(observer);
}

void Estimator::listen(StageListener* listener) {
  impl_->tracking.listen(listener);
  impl_->mapping.listen(listener);
}

void Estimator::finish() {
  impl_->tracking.finish();
  while (impl_->map()) {
  }
  impl_->mapping.collect_recorded();
  impl_->tracking.take_counts();
}

void Estimator::release_frames() {
  impl_->tracking.release_frames();
}

const EstimatorCounts& Estimator::counts() const {
  return impl_->tracking.counts();
}

std::vector<MapTrajectory> Estimator::trajectories() const {
  std::vector<MapTrajectory> out;
  for (const KeptFrame& r : impl_->mapping.recorded()) {
    SE3 T_world_reference;
    if (!impl_->mapping.mapper().map().pose_of(r.reference_id, &T_world_reference)) continue;
    auto it =
        std::find_if(out.begin(), out.end(), [&](const MapTrajectory& t) { return t.map_id == r.map_id; });
    if (it == out.end()) it = out.insert(out.end(), MapTrajectory{r.map_id, {}});
    it->frames.push_back({r.utime, T_world_reference * r.T_reference_body()});
  }
  for (MapTrajectory& t : out)
    std::stable_sort(t.frames.begin(), t.frames.end(),
                     [](const PosedFrame& a, const PosedFrame& b) { return a.utime < b.utime; });
  std::stable_sort(out.begin(), out.end(), [](const MapTrajectory& a, const MapTrajectory& b) {
    return a.frames.size() > b.frames.size();
  });
  return out;
}

std::vector<LandmarkInfo> Estimator::landmarks() const {
  std::vector<LandmarkInfo> out;
  const Map& map = impl_->mapping.mapper().map();
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
    std::memcpy(&i.tag, l.patch.pixels.data(), sizeof(i.tag));
    out.push_back(i);
  });
  return out;
}

void Estimator::visit_observation_distances(const std::function<void(std::int32_t, double)>& visit) const {
  const Map& map = impl_->mapping.mapper().map();
  map.landmarks().for_each([&](LandmarkHandle, const Landmark& l) {
    if (l.state == LandmarkState::kBearing || l.inverse_depth <= 0.0) return;
    const Eigen::Vector4d p = map.world_point(l);
    for (const Observation& o : l.observations)
      visit(l.map_id, (p.head<3>() / p[3] - map.T_world_camera(map.keyframes()[o.keyframe]).t).norm());
  });
}

std::vector<LandmarkSighting> Estimator::sightings(const LandmarkInfo& landmark) const {
  std::vector<LandmarkSighting> out;
  const Map& map = impl_->mapping.mapper().map();
  if (const Landmark* l = map.landmarks().get({landmark.slot, landmark.generation})) {
    out.reserve(l->observations.size());
    for (const Observation& o : l->observations) out.push_back({map.keyframes()[o.keyframe].utime, o.pixel});
  }
  return out;
}

std::vector<SE3> Estimator::keyframe_poses() const {
  std::vector<SE3> out;
  impl_->mapping.mapper().map().keyframes().for_each(
      [&](KeyframeHandle, const Keyframe& k) { out.push_back(k.T_world_body); });
  return out;
}

CalibrationInfo Estimator::calibration() const {
  const Calibrator& calibrator = impl_->mapping.mapper().calibrator();
  const CalibrationDelta d = calibrator.delta(), sigma = calibrator.sigma();
  CalibrationInfo info;
  info.focal_scale = d[0], info.cx_px = d[1], info.cy_px = d[2], info.k1 = d[3];
  info.focal_scale_sigma = sigma[0], info.cx_sigma_px = sigma[1], info.cy_sigma_px = sigma[2];
  info.k1_sigma = sigma[3];
  info.contradicted = calibrator.contradicts_given();
  info.focal_scale_of_images = calibrator.wanted_by_images()[0];
  return info;
}

std::vector<std::pair<std::string, std::size_t>> Estimator::memory_table() const {
  const Map& map = impl_->mapping.mapper().map();
  auto table = impl_->tracking.memory_table();
  table.emplace_back("local views", impl_->mapping.mapper().view_bytes());
  table.emplace_back("exchange of jobs", impl_->exchange.bytes());
  table.emplace_back("tracker of mapping", impl_->mapping.tracker_bytes());
  table.emplace_back("bundle adjustment", impl_->mapping.mapper().adjustment_bytes());
  table.emplace_back("keyframes", map.keyframe_bytes());
  table.emplace_back("landmarks", map.landmark_bytes());
  return table;
}

}  // namespace farpoint::slam
