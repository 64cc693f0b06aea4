// The map: pools of keyframes and landmarks and the links between them. Mapping is its only writer; tracking
// reads LocalView copies. Keeps both sides of every link consistent:
//     keyframe.landmarks[o.feature] == landmark   <=>   an observation o of the landmark names keyframe and
//     feature.
#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "slam/config.h"
#include "slam/map/keyframe.h"
#include "slam/map/landmark.h"

namespace farpoint::slam {

class Map {
 public:
  // wide_parallax_rad: from this angle between two sightings on, a landmark shows translation.
  Map(const CapacityConfig& capacity, const Rig& rig, double wide_parallax_rad = 0.0);

  // Keyframes.

  // Null when full: the caller makes room first (remove_keyframe).
  [[nodiscard]] KeyframeHandle add_keyframe(Keyframe&& keyframe);
  // To be filled and added: its arrays, whose contents mean nothing, have the room of one that let go of its
  // pixels. Without it they would leave holes in the heap, which a long run fills ever worse.
  [[nodiscard]] Keyframe roomy_keyframe();
  // Re-hosts what it hosts, detaches its observations, remembers its pose in the skeleton relative to its
  // most covisible keyframe, and frees the slot. Landmarks left with fewer than two observers go.
  void remove_keyframe(KeyframeHandle handle);
  // Lets go of the pixels and of all that serves only the search for new landmarks: descriptors, bearings,
  // grid, and the features that belong to no landmark. Observations keep naming the right feature. Nothing
  // new can be matched with the keyframe afterwards.
  void thin_keyframe(KeyframeHandle handle);

  // Landmarks.

  // A new landmark of state bearing hosted by (keyframe, feature), with that one observation. Null when full
  // or when no patch can be cut around the feature.
  [[nodiscard]] LandmarkHandle add_landmark(KeyframeHandle host, std::size_t feature);
  void remove_landmark(LandmarkHandle handle);
  // False where the keyframe already sees the landmark, has no such feature, or the feature belongs to
  // another one.
  bool add_observation(LandmarkHandle handle, const Observation& observation);
  // Removes the sighting by `keyframe`; re-hosts where it was the host's. The landmark goes when fewer than
  // two are left. True while the landmark lives.
  bool remove_observation(LandmarkHandle handle, KeyframeHandle keyframe);
  // Moves the observations of `from` to `into` where they do not collide, then removes `from`.
  void fuse(LandmarkHandle into, LandmarkHandle from);
  // Attaches the anchor to another observing keyframe; bearing, depth and patch stay as they are. Does
  // nothing where new_host does not see the landmark: a host must be an observer, or the landmark would not
  // hear of its removal.
  void rehost(LandmarkHandle handle, KeyframeHandle new_host);

  [[nodiscard]] static const Observation* find_observation(const Landmark& landmark, KeyframeHandle keyframe);
  // Homogeneous world point (x, y, z, rho): the point is xyz / rho, also when rho is 0.
  [[nodiscard]] Eigen::Vector4d world_point(const Landmark& landmark) const;
  [[nodiscard]] SE3 T_world_anchor(const Landmark& landmark) const;
  [[nodiscard]] SE3 T_world_camera(const Keyframe& keyframe) const;
  // Angle between the host's ray and the observer's, by their bearings and poses, rad.
  [[nodiscard]] double parallax(const Landmark& landmark, const Observation& observation) const;

  // Uses a refined calibration from now on: the bearings of landmarks, and of keyframes that still have
  // pixels, are made anew; poses and inverse depths stay.
  void set_camera(int index, const Camera& camera);

  // Counts again which keyframes share landmarks with this one, both ways.
  void update_covisibility(KeyframeHandle handle);

  // Pose of any keyframe ever made in a living map by its id, also of removed ones (without
  // capacity.whole_trajectory only those of late); false where it is unknown.
  [[nodiscard]] bool pose_of(std::uint64_t keyframe_id, SE3* T_world_body) const;

  // Everything of one map goes (a map that never came to life).
  void discard_map(std::int32_t map_id);

  [[nodiscard]] Pool<Keyframe>& keyframes() { return keyframes_; }
  [[nodiscard]] const Pool<Keyframe>& keyframes() const { return keyframes_; }
  [[nodiscard]] Pool<Landmark>& landmarks() { return landmarks_; }
  [[nodiscard]] const Pool<Landmark>& landmarks() const { return landmarks_; }
  [[nodiscard]] const Rig& rig() const { return rig_; }

 private:
  // Where a keyframe id is now: alive in a slot, or rigidly attached to another keyframe.
  struct SkeletonNode {
    KeyframeHandle alive;
    std::uint64_t parent_id = 0;
    SE3 T_parent_this;
    bool known = false;
  };

  void add_to_skeleton(KeyframeHandle keyframe);
  void keep_room_of(Keyframe* keyframe);
  // Null where the skeleton no longer reaches back so far.
  [[nodiscard]] const SkeletonNode* skeleton_node(std::uint64_t keyframe_id) const;
  bool set_bearing(Landmark* landmark) const;
  void detach_feature(const Observation& observation);
  // Keeps the largest parallax and who gives it.
  void note_parallax(const Observation& observation, Landmark* landmark) const;
  void thin_observations(Landmark& landmark, LandmarkHandle handle);

  struct Shared {
    int all = 0, wide = 0;
  };

  CapacityConfig capacity_;
  Rig rig_;
  double wide_parallax_rad_;
  Pool<Keyframe> keyframes_;
  Pool<Landmark> landmarks_;
  std::deque<SkeletonNode> skeleton_;  // by keyframe id, from first_in_skeleton_ on
  std::uint64_t first_in_skeleton_ = 1;
  std::uint64_t next_keyframe_id_ = 1;
  std::uint64_t next_landmark_id_ = 1;
  std::vector<Keyframe> rooms_;  // for roomy_keyframe: no more than had pixels at once
  std::vector<Shared> shared_;   // scratch of update_covisibility, one a keyframe slot
};

}  // namespace farpoint::slam
