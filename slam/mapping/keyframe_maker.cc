// SPDX-License-Identifier: Apache-2.0
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

KeyframeView KeyframeMaker::copy(const FrameView& view, const Camera& camera) {
  KeyframeView out = map_.preallocated_view();
  out.set = view.set;
  out.grid = view.grid;
  out.image = view.image;
  unproject_features(camera, out.set, &out.bearings);
  return out;
}

KeyframeView KeyframeMaker::room_beside(const FrameView& first, const FrameView& further) {
  KeyframeView out = map_.preallocated_view();
  out.set.features = first.set.features;
  out.set.descriptors.clear();
  out.bearings.clear();
  out.image = further.image;
  return out;
}

KeyframeHandle KeyframeMaker::make(const Frame& frame, const SE3& T_world_body, std::int32_t map_id) {
  if (map_.keyframes().full()) return {};
  Keyframe k = map_.new_keyframe();
  k.map_id = map_id;
  k.utime = frame.utime;
  k.frame_number = frame.number;
  k.T_world_body = T_world_body;
  for (int c = 0; c < frame.views.size(); ++c) {
    const FrameView& view = frame.views[c];
    if (!view.set.features.empty())
      k.views[c] = copy(view, map_.camera(c).camera);
    else if (c > 0 && view.image)
      k.views[c] = room_beside(frame.views[0], view);
  }
  const KeyframeHandle handle = map_.add_keyframe(std::move(k));
  ++counts_.keyframes_made;
  newest_ = handle;
  newest_id_ = map_.keyframes()[handle].id;
  return handle;
}

}  // namespace farpoint::slam
