// SPDX-License-Identifier: Apache-2.0
#include "slam/estimator.h"

#include <stdexcept>
#include <utility>

#include "slam/back_end.h"
#include "slam/front_end.h"
#include "slam/mapping_rings.h"

namespace farpoint::slam {

namespace {

void check_rig(const Rig& rig) {
  if (rig.cameras.empty())
    throw std::invalid_argument("rig: no camera; at least one calibrated camera is needed");
  for (const RigCamera& c : rig.cameras)
    if (const std::string why = Camera::check(c.camera.parameters()); !why.empty())
      throw std::invalid_argument("camera '" + c.name + "': " + why);
  for (const RigCamera& c : rig.cameras)
    if (c.mask != nullptr &&
        (c.mask->width_px() != c.camera.width_px() || c.mask->height_px() != c.camera.height_px()))
      throw std::invalid_argument("camera '" + c.name + "': mask of another size than the camera's images");
}

// One camera's map has no metric scale; that of two has.
Rig usable_rig(const Rig& rig) {
  check_rig(rig);
  return rig.cameras.size() > 1 ? rig : with_body_at_camera(rig, 0);
}

// From the body of usable_rig().
VehiclePoints vehicle_points(const WheelConfig& wheels, const Rig& given, const Rig& usable) {
  VehiclePoints points;
  points.body_m = usable.cameras.front().T_body_camera.t - given.cameras.front().T_body_camera.t;
  points.wheels_m = points.body_m + Eigen::Vector3d(wheels.x_m, wheels.y_m, wheels.z_m);
  return points;
}

}  // namespace

struct Estimator::Impl {
  Impl(const EstimatorConfig& config, const Rig& given)
      : rig(usable_rig(given)),
        rings(config),
        front_end(config, rig, &rings, vehicle_points(config.wheels, given, rig)),
        back_end(config, rig, &rings, vehicle_points(config.wheels, given, rig)) {}

  bool map() {
    if (!back_end.step()) return false;
    const MappingReply& reply = back_end.reply();
    if (reply.view && observer)
      observer({reply.number, reply.utime, reply.view->map_id, reply.stage == MappingStage::kFull});
    replies = reply.number;
    back_end.hand_over();
    return true;
  }

  template <typename Input>
  const FrameResult& lockstep(Input&& input) {
    front_end.track(std::forward<Input>(input), TakeLimit{});
    while (map()) {
    }
    return front_end.take_replies_at_once();
  }

  const Rig rig;
  MappingRings rings;
  FrontEnd front_end;
  BackEnd back_end;
  std::function<void(const MappingNote&)> observer;
  std::uint64_t replies = 0;  // that mapping has made; mapping's thread
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

bool Estimator::add(const ImuSample& sample) {
  return impl_->front_end.add(sample);
}

bool Estimator::add(const WheelSample& sample) {
  return impl_->front_end.add(sample);
}

const FrameResult& Estimator::track(const FrameInput& input) {
  return impl_->front_end.track(input, {.replies_by_delay = false});
}

bool Estimator::map() {
  return impl_->map();
}

const FrameResult& Estimator::process_recorded(const FrameInput& input, const FrameTaken& taken) {
  while (impl_->replies < taken.replies && impl_->map()) {
  }
  return impl_->front_end.track(input, {.replies_by_delay = false, .up_to = taken});
}

void Estimator::on_view(std::function<void(const MappingNote&)> observer) {
  impl_->observer = std::move(observer);
}

void Estimator::listen(StageListener* listener) {
  impl_->front_end.listen(listener);
  impl_->back_end.listen(listener);
}

void Estimator::finish() {
  impl_->front_end.finish();
  while (impl_->map()) {
  }
  impl_->back_end.collect_recorded();
  impl_->front_end.take_counts();
}

void Estimator::release_frames() {
  impl_->front_end.release_frames();
}

const EstimatorCounts& Estimator::counts() const {
  return impl_->front_end.counts();
}

Inspection Estimator::inspect() const {
  return Inspection(impl_->back_end);
}

std::vector<std::pair<std::string, std::size_t>> Estimator::memory_table() const {
  const Map& map = impl_->back_end.mapper().map();
  auto table = impl_->front_end.memory_table();
  table.emplace_back("local views", impl_->back_end.mapper().view_bytes());
  table.emplace_back("rings to mapping", impl_->rings.bytes());
  table.emplace_back("tracker of mapping", impl_->back_end.tracker_bytes());
  table.emplace_back("bundle adjustment", impl_->back_end.mapper().adjustment_bytes());
  table.emplace_back("keyframes", map.keyframe_bytes());
  table.emplace_back("landmarks", map.landmark_bytes());
  return table;
}

}  // namespace farpoint::slam
