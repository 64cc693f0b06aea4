// The map: pools of keyframes and landmarks and the links between them. Mapping is its only writer; tracking
// reads LocalView copies. Keeps both sides of every link consistent:
//     keyframe.landmarks[o.feature] == landmark   <=>   an observation o of the landmark names keyframe and
//     feature.
#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "slam/config.h"
#include "slam/map/growing_memory.h"
#include "slam/map/keyframe.h"
#include "slam/map/landmark.h"
#include "slam/map/observation_room.h"

namespace farpoint::slam {

struct MapOptions {
  double wide_parallax_rad = 0.0;  // from where a landmark shows translation
  // Most of a keyframe: room for them is taken at once. 0: it is taken as it is needed.
  std::size_t features = 0;
  // Most covisible keyframes that one remembers. One that goes is not replaced before the next count. 0: all.
  std::size_t covisible = 0;
};

class Map {
 public:
  Map(const CapacityConfig& capacity, const Rig& rig, const MapOptions& options = {});

  // Landmarks keep their observations in memory of this very map.
  Map(const Map&) = delete;
  Map& operator=(const Map&) = delete;

  // What keyframes and landmarks take, their arrays included.
  [[nodiscard]] std::size_t keyframe_bytes() const;
  [[nodiscard]] std::size_t landmark_bytes() const;

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
  // grid, corners. Of landmarks only those are left that it sees, and observations are renumbered with them.
  // Nothing new can be matched with the keyframe afterwards.
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

  // Shows translation: two of its sightings are far enough apart (MapOptions::wide_parallax_rad).
  [[nodiscard]] bool is_wide(const Landmark& landmark) const {
    return landmark.max_parallax_rad >= options_.wide_parallax_rad;
  }

  // Uses a refined calibration from now on: the bearings of landmarks, and of keyframes that still have
  // pixels, are made anew; poses and inverse depths stay.
  void set_camera(int index, const Camera& camera);

  // Counts again which keyframes share landmarks with this one, and notes it with both where it is among the
  // strongest.
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
  // A long run has hundreds of thousands: without the padding that an SE3's alignment asks for.
  struct SkeletonNode {
    KeyframeHandle alive;
    std::uint64_t parent_id = 0;  // 0: none, its place is not known
    Eigen::Quaternion<double, Eigen::DontAlign> q_parent_this;
    Eigen::Vector3d t_parent_this;
  };

  void add_to_skeleton(KeyframeHandle keyframe);
  [[nodiscard]] std::size_t covisible_room() const {
    return options_.covisible > 0 ? options_.covisible + 1 : 0;  // one more comes before the weakest goes
  }
  void leave_covisible(KeyframeHandle handle);
  void keep_room_of(Keyframe* keyframe);
  [[nodiscard]] std::vector<LandmarkHandle> thinned_room(std::size_t landmarks);
  void keep_thinned_room(std::vector<LandmarkHandle>&& room);
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
  MapOptions options_;
  Pool<Keyframe> keyframes_;
  ObservationRoom observation_room_;
  Pool<Landmark> landmarks_;
  GrowingMemory skeleton_memory_;
  // By keyframe id, from first_in_skeleton_ on.
  std::pmr::deque<SkeletonNode> skeleton_{skeleton_memory_.resource()};
  std::uint64_t first_in_skeleton_ = 1;
  std::uint64_t next_keyframe_id_ = 1;
  std::uint64_t next_landmark_id_ = 1;
  std::vector<Keyframe> rooms_;  // for roomy_keyframe: no more than had pixels at once
  std::size_t thinned_room_;     // landmarks of a thinned keyframe that one of these holds:
  std::vector<std::vector<LandmarkHandle>> thinned_rooms_;
  // Scratch of update_covisibility: one a keyframe slot, and those of them that share anything.
  std::vector<Shared> shared_;
  std::vector<Covisible> counted_;
};

}  // namespace farpoint::slam
