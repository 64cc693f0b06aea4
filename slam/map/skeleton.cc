// SPDX-License-Identifier: Apache-2.0
#include "slam/map/skeleton.h"

namespace farpoint::slam {

void Skeleton::add(std::uint64_t id, KeyframeHandle keyframe) {
  if (nodes_.empty()) first_id_ = id;
  Node& node = nodes_.emplace_back();
  node.alive = keyframe;
  if (nodes_kept_ == 0 || nodes_.size() <= nodes_kept_) return;
  nodes_.pop_front();
  ++first_id_;
}

void Skeleton::remove(std::uint64_t id, std::uint64_t parent_id, const SE3& T_parent_this) {
  Node* node = find(id);
  if (node == nullptr) return;
  node->alive = {};
  node->parent_id = parent_id;
  node->q_parent_this = T_parent_this.q;
  node->t_parent_this = T_parent_this.t;
}

void Skeleton::remove_without_parent(std::uint64_t id) {
  if (Node* node = find(id)) node->alive = {};
}

bool Skeleton::pose_of(std::uint64_t id, const Pool<Keyframe>& keyframes, SE3* T_world_body) const {
  SE3 tail;
  while (const Node* node = find(id)) {
    if (const Keyframe* k = keyframes.get(node->alive)) {
      *T_world_body = k->T_world_body * tail;
      return true;
    }
    if (node->parent_id == 0) return false;
    tail = SE3{Eigen::Quaterniond(node->q_parent_this), node->t_parent_this} * tail;
    id = node->parent_id;
  }
  // A living keyframe may be older than the oldest node.
  bool found = false;
  keyframes.for_each([&](KeyframeHandle, const Keyframe& k) {
    if (k.id != id) return;
    *T_world_body = k.T_world_body * tail;
    found = true;
  });
  return found;
}

}  // namespace farpoint::slam
