// SPDX-License-Identifier: Apache-2.0
// Where every keyframe of the run stands, also after the map removed it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory_resource>

#include "slam/map/growing_memory.h"
#include "slam/map/keyframe.h"

namespace farpoint::slam {

// A removed keyframe is attached to a parent and follows it through every later optimisation and change of
// unit. The parent may be removed in turn.
class Skeleton {
 public:
  // Keeps the newest `nodes` keyframes; 0 keeps all, and memory grows with the run.
  explicit Skeleton(std::size_t nodes) : nodes_kept_(nodes) {}

  // Preconditions: ids start at 1 and ascend by 1.
  void add(std::uint64_t id, KeyframeHandle keyframe);
  // Call before the keyframe's slot is released. Does nothing where the node was dropped.
  void remove(std::uint64_t id, std::uint64_t parent_id, const Sim3& S_parent_this);
  // The same of a keyframe without a parent: its pose is lost, and the poses of all attached to it.
  void remove_without_parent(std::uint64_t id);

  // Keyframe::S_world_body of keyframe `id`, alive or removed. False where the chain of parents ends at a
  // lost or dropped node.
  [[nodiscard]] bool similarity_of(std::uint64_t id, const Pool<Keyframe>& keyframes,
                                   Sim3* S_world_body) const;
  // Its rigid part.
  [[nodiscard]] bool pose_of(std::uint64_t id, const Pool<Keyframe>& keyframes, SE3* T_world_body) const;
  [[nodiscard]] std::size_t size() const { return nodes_.size(); }

 private:
  // A long run has hundreds of thousands of nodes: Sim3's alignment would add 8 bytes of padding to each.
  struct Node {
    KeyframeHandle alive;         // null once removed
    std::uint64_t parent_id = 0;  // 0: none
    Eigen::Quaternion<double, Eigen::DontAlign> q_parent_this;
    Eigen::Vector3d t_parent_this;
    double scale_parent_this = 1.0;
  };
  // Null where the node was dropped or never added.
  [[nodiscard]] const Node* find(std::uint64_t id) const {
    return contains(id) ? &nodes_[id - first_id_] : nullptr;
  }
  [[nodiscard]] Node* find(std::uint64_t id) { return contains(id) ? &nodes_[id - first_id_] : nullptr; }
  // False where the node was dropped or never added.
  [[nodiscard]] bool contains(std::uint64_t id) const {
    return id - first_id_ < nodes_.size();  // wraps to a huge number for a dropped node
  }

  std::size_t nodes_kept_;
  GrowingMemory memory_;
  std::pmr::deque<Node> nodes_{memory_.resource()};  // by keyframe id
  std::uint64_t first_id_ = 1;                       // of nodes_.front()
};

}  // namespace farpoint::slam
