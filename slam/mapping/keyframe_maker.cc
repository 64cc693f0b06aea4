#include "slam/mapping/keyframe_maker.h"

#include <utility>

namespace farpoint::slam {

namespace {

void unproject_features(const Camera& camera, const FeatureSet& set, std::vector<Eigen::Vector3f>* bearings) {
  bearings->clear();
  bearings->reserve(set.features.size());
  for (const Feature& f : set.features) {
    Eigen::Vector3d b = Eigen::Vector3d::UnitZ();
    // A corner without a ray (outside the lens circle) gets a bearing that no epipolar search matches.
    if (!camera.unproject({f.u_px, f.v_px}, &b)) b = -Eigen::Vector3d::UnitZ();
    bearings->emplace_back(b.cast<float>());
  }
}

}  // namespace

KeyframeHandle KeyframeMaker::make(const Frame& frame, const SE3& T_world_body, std::int32_t map_id) {
  Keyframe k = map_.preallocated_keyframe();
  k.map_id = map_id;
  k.utime = frame.utime;
  k.frame_number = frame.number;
  k.camera = frame.camera;
  k.T_world_body = T_world_body;
  k.set = frame.set;
  k.grid = frame.grid;
  k.image = frame.image;
  unproject_features(map_.rig().cameras[static_cast<std::size_t>(frame.camera)].camera, k.set, &k.bearings);
  const KeyframeHandle handle = map_.add_keyframe(std::move(k));
  if (handle.is_null()) return handle;
  ++counts_.keyframes_made;
  newest_ = handle;
  newest_id_ = map_.keyframes()[handle].id;
  return handle;
}

}  // namespace farpoint::slam
