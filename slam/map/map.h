// SPDX-License-Identifier: Apache-2.0
// The map: pools of keyframes and landmarks and the links between them. Mapping is its only writer; tracking
// reads LocalView copies. Keeps both sides of every link consistent:
//     keyframe.views[o.camera].landmarks[o.feature] == landmark
//         <=>   an observation o of the landmark names keyframe, camera and feature.
#pragma once

#include <cstdint>

#include "slam/config.h"
#include "slam/map/chain.h"
#include "slam/map/covisibility.h"
#include "slam/map/keyframe.h"
#include "slam/map/keyframe_memory.h"
#include "slam/map/landmark.h"
#include "slam/map/observation_room.h"
#include "slam/map/skeleton.h"

namespace farpoint::slam {

struct MapOptions {
  double wide_parallax_rad = 0.0;  // a landmark with at least this parallax shows translation
  std::size_t features = 0;        // most of one view, preallocated; 0: allocated when needed
  int views_per_keyframe = 1;      // preallocated: cameras that give images
  std::size_t covisible = 0;       // longest list of covisible keyframes; 0: no limit
};

class Map {
 public:
  Map(const CapacityConfig& capacity, const Rig& rig, const MapOptions& options = {});

  // Observations and parts refer to this very object.
  Map(const Map&) = delete;
  Map& operator=(const Map&) = delete;

  // Memory of keyframes and of landmarks, their arrays included.
  [[nodiscard]] std::size_t keyframe_bytes() const;
  [[nodiscard]] std::size_t landmark_bytes() const;

  // --- keyframes

  // A keyframe with an empty view a camera, to be filled and added.
  [[nodiscard]] Keyframe new_keyframe() const {
    Keyframe keyframe;
    keyframe.views = PerCamera<KeyframeView>(camera_count());
    return keyframe;
  }
  // A view for it, with preallocated arrays of arbitrary contents (KeyframeMemory).
  [[nodiscard]] KeyframeView preallocated_view() { return keyframe_memory_.take(); }
  // Adds the keyframe to the end of its map's chain. Null where the pool is full: call remove_keyframe()
  // first.
  [[nodiscard]] KeyframeHandle add_keyframe(Keyframe&& keyframe);
  // Re-hosts its landmarks, removes its observations, attaches it in the skeleton to its strongest covisible
  // keyframe, joins the chain, and releases the slot. Removes landmarks left with fewer than two observers.
  void remove_keyframe(KeyframeHandle handle);
  // Frees the pixels and all that serves only the search for new landmarks: descriptors, bearings, grid,
  // corners. Keeps the landmarks that it sees and renumbers the features of their observations. Nothing new
  // can be matched with the keyframe afterwards.
  void thin_keyframe(KeyframeHandle handle);

  // --- landmarks

  // A new landmark of state bearing hosted by (keyframe, camera, feature), with that one observation. Null
  // where the pool is full or no patch can be cut around the feature.
  [[nodiscard]] LandmarkHandle add_landmark(KeyframeHandle host, int camera, std::size_t feature);
  void remove_landmark(LandmarkHandle handle);
  // False where that camera of the keyframe sees the landmark already, has no such feature, or the feature
  // belongs to another landmark.
  bool add_observation(LandmarkHandle handle, const Observation& observation);
  // Removes the observation by that camera of `keyframe`. Re-hosts the landmark where the keyframe was the
  // host and observes it no more. Removes the landmark where fewer than two observations are left. True while
  // the landmark lives.
  bool remove_observation(LandmarkHandle handle, KeyframeHandle keyframe, int camera);
  // Attaches the anchor to another observing keyframe; bearing, depth and patch stay. Does nothing where
  // new_host does not observe the landmark: removal of a keyframe reaches only the landmarks it observes.
  void rehost(LandmarkHandle handle, KeyframeHandle new_host);

  // The first observation by the keyframe, by whichever camera; null where there is none.
  [[nodiscard]] static const Observation* find_observation(const Landmark& landmark, KeyframeHandle keyframe);
  [[nodiscard]] static const Observation* find_observation(const Landmark& landmark, KeyframeHandle keyframe,
                                                           int camera);
  // Homogeneous world point (x, y, z, rho): the point is xyz / rho, also where rho is 0.
  [[nodiscard]] Eigen::Vector4d world_point(const Landmark& landmark) const;
  [[nodiscard]] SE3 T_world_anchor(const Landmark& landmark) const;
  [[nodiscard]] SE3 T_world_camera(const Keyframe& keyframe, int index) const;
  // Angle between the anchor's ray and the observation's, by their bearings and poses, rad.
  [[nodiscard]] double parallax(const Landmark& landmark, const Observation& observation) const;

  // --- all of it

  // Sets a refined calibration. Computes the bearings of landmarks, and of keyframes that keep their pixels,
  // anew; poses and inverse depths stay.
  void set_camera(int index, const Camera& camera);
  // Sets a refined place of a camera on the body. Precondition: the camera is no landmark's anchor.
  void place_camera(int index, const SE3& T_body_camera) {
    rig_.cameras[static_cast<std::size_t>(index)].T_body_camera = T_body_camera;
  }
  // Removes everything of one map.
  void discard_map(std::int32_t map_id);
  // Moves a keyframe by a similarity of world coordinates, with the landmarks that it hosts: pose, anchors,
  // depths. Removed keyframes follow those that they are attached to. The rig's lever arms stay: a change of
  // scale is exact where they are zero, as with one camera and an unknown scale.
  void correct_keyframe(KeyframeHandle handle, const Sim3& S_new_old);
  // The same of a whole map: another origin, other axes, another unit.
  void transform(std::int32_t map_id, const Sim3& S_new_old);

  // --- parts

  void update_covisibility(KeyframeHandle handle) { covisibility_.update(handle); }
  [[nodiscard]] bool is_wide(const Landmark& landmark) const { return covisibility_.is_wide(landmark); }
  // Pose of a keyframe by its id, also of a removed one. Without capacity.whole_trajectory the skeleton keeps
  // recent ones only. False where the pose is unknown.
  [[nodiscard]] bool pose_of(std::uint64_t keyframe_id, SE3* T_world_body) const {
    return skeleton_.pose_of(keyframe_id, keyframes_, T_world_body);
  }
  // The same with the keyframe's unit: for poses relative to it (Keyframe::S_world_body).
  [[nodiscard]] bool similarity_of(std::uint64_t keyframe_id, Sim3* S_world_body) const {
    return skeleton_.similarity_of(keyframe_id, keyframes_, S_world_body);
  }
  [[nodiscard]] const Chain& chain() const { return chain_; }
  // Where measurements between the keyframe before and this one go. Null for the first of its map.
  [[nodiscard]] ChainLink* link_to(KeyframeHandle handle) { return chain_.link_to(handle); }

  [[nodiscard]] Pool<Keyframe>& keyframes() { return keyframes_; }
  [[nodiscard]] const Pool<Keyframe>& keyframes() const { return keyframes_; }
  [[nodiscard]] Pool<Landmark>& landmarks() { return landmarks_; }
  [[nodiscard]] const Pool<Landmark>& landmarks() const { return landmarks_; }
  [[nodiscard]] const Rig& rig() const { return rig_; }
  [[nodiscard]] const RigCamera& camera(int index) const {
    return rig_.cameras[static_cast<std::size_t>(index)];
  }
  [[nodiscard]] int camera_count() const { return static_cast<int>(rig_.cameras.size()); }

 private:
  void add_to_chain(KeyframeHandle handle);
  // The keyframe that a removed one is attached to; null where its map has no other.
  [[nodiscard]] KeyframeHandle skeleton_parent(KeyframeHandle handle) const;
  void remove_from_skeleton(KeyframeHandle handle);
  void thin_view(KeyframeHandle handle, int camera);
  [[nodiscard]] bool set_bearing(Landmark* landmark) const;
  void detach_feature(const Observation& observation);
  void insert_sorted(const Observation& observation, Landmark* landmark);
  // Keeps the largest parallax and its observer.
  void note_parallax(const Observation& observation, Landmark* landmark) const;
  void thin_observations(Landmark& landmark, LandmarkHandle handle);

  CapacityConfig capacity_;
  Rig rig_;
  Pool<Keyframe> keyframes_;
  ObservationRoom observation_room_;
  Pool<Landmark> landmarks_;
  KeyframeMemory keyframe_memory_;
  Covisibility covisibility_;
  Skeleton skeleton_;
  Chain chain_;
  std::uint64_t next_keyframe_id_ = 1;
  std::uint64_t next_landmark_id_ = 1;
};

}  // namespace farpoint::slam
