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

void Skeleton::remove(std::uint64_t id, std::uint64_t parent_id, const Sim3& S_parent_this) {
  Node* node = find(id);
  if (node == nullptr) return;
  node->alive = {};
  node->parent_id = parent_id;
  node->q_parent_this = S_parent_this.q;
  node->t_parent_this = S_parent_this.t;
  node->scale_parent_this = S_parent_this.scale;
}

void Skeleton::remove_without_parent(std::uint64_t id) {
  if (Node* node = find(id)) node->alive = {};
}

bool Skeleton::pose_of(std::uint64_t id, const Pool<Keyframe>& keyframes, SE3* T_world_body) const {
  Sim3 S;
  if (!similarity_of(id, keyframes, &S)) return false;
  *T_world_body = {S.q, S.t};
  return true;
}

bool Skeleton::similarity_of(std::uint64_t id, const Pool<Keyframe>& keyframes, Sim3* S_world_body) const {
  Sim3 tail;
  while (const Node* node = find(id)) {
    if (const Keyframe* k = keyframes.get(node->alive)) {
      *S_world_body = k->S_world_body() * tail;
      return true;
    }
    if (node->parent_id == 0) return false;
    tail = Sim3{node->scale_parent_this, Eigen::Quaterniond(node->q_parent_this), node->t_parent_this} * tail;
    id = node->parent_id;
  }
  // A living keyframe may be older than the oldest node.
  bool found = false;
  keyframes.for_each([&](KeyframeHandle, const Keyframe& k) {
    if (k.id != id) return;
    *S_world_body = k.S_world_body() * tail;
    found = true;
  });
  return found;
}

}  // namespace farpoint::slam
