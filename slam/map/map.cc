#include "slam/map/map.h"

#include <algorithm>
#include <cmath>
#include <memory>

namespace farpoint::slam {

namespace {

// Thinned keyframes keep a sixth to a third of their features: the corners of landmarks.
constexpr std::size_t kThinnedShare = 3;
// An array for more than that comes in multiples of this, so that what one leaves fits another.
constexpr std::size_t kThinStep = 128;
constexpr std::size_t kObservationStep = 4;
// Observations for which room is taken at the start, of those for which thinned keyframes have room (whose
// landmarks go while they stay).
constexpr double kObservedShare = 0.75;

std::size_t observations_of_full_map(const CapacityConfig& capacity, std::size_t features) {
  const std::size_t thinned = features / kThinnedShare * static_cast<std::size_t>(capacity.keyframes);
  return static_cast<std::size_t>(kObservedShare * static_cast<double>(thinned));
}

// Touched, not only reserved: a page that is first used on the road is a page fault on the road.
template <typename T>
void make_room(std::size_t size, std::vector<T>* array) {
  array->resize(size);
  array->clear();
}

Keyframe room_for(std::size_t features) {
  Keyframe room;
  make_room(features, &room.set.features);
  make_room(features, &room.set.descriptors);
  make_room(features, &room.landmarks);
  make_room(features, &room.bearings);
  return room;
}

// The slot's list of covisible keyframes is emptied, and keeps its room.
void refill(Keyframe&& with, Keyframe* slot) {
  std::vector<Covisible> room = std::move(slot->covisible);
  room.clear();
  *slot = std::move(with);
  slot->covisible = std::move(room);
}

std::size_t array_bytes(const Keyframe& k) {
  return k.set.features.capacity() * sizeof(Feature) + k.set.descriptors.capacity() * sizeof(Descriptor) +
         k.landmarks.capacity() * sizeof(LandmarkHandle) + k.bearings.capacity() * sizeof(Eigen::Vector3f) +
         k.grid.bytes();
}

}  // namespace

Map::Map(const CapacityConfig& capacity, const Rig& rig, const MapOptions& options)
    : capacity_(capacity),
      rig_(rig),
      options_(options),
      keyframes_(static_cast<std::size_t>(capacity.keyframes)),
      observation_room_(observations_of_full_map(capacity, options.features),
                        static_cast<std::size_t>(capacity.observations_per_landmark) + kObservationStep),
      landmarks_(static_cast<std::size_t>(capacity.landmarks)),
      thinned_room_(options.features / kThinnedShare),
      shared_(static_cast<std::size_t>(capacity.keyframes)) {
  landmarks_.for_each_slot([this](Landmark& l) {
    std::destroy_at(&l.observations);
    std::construct_at(&l.observations, observation_room_.resource());
  });
  if (options.features == 0) return;
  for (int i = 0; i <= capacity.window_images; ++i) rooms_.push_back(room_for(options.features));
  thinned_rooms_.resize(keyframes_.capacity());
  for (auto& room : thinned_rooms_) make_room(thinned_room_, &room);
  keyframes_.for_each_slot([&](Keyframe& k) { make_room(covisible_room(), &k.covisible); });
}

std::size_t Map::keyframe_bytes() const {
  std::size_t bytes = keyframes_.bytes();
  const auto add = [&bytes](const Keyframe& k) { bytes += array_bytes(k); };
  std::for_each(rooms_.begin(), rooms_.end(), add);
  keyframes_.for_each([&](KeyframeHandle, const Keyframe& k) { add(k); });
  keyframes_.for_each_slot(
      [&bytes](const Keyframe& k) { bytes += k.covisible.capacity() * sizeof(Covisible); });
  return bytes + thinned_rooms_.size() * thinned_room_ * sizeof(LandmarkHandle);
}

std::size_t Map::landmark_bytes() const {
  return landmarks_.bytes() + observation_room_.bytes();
}

KeyframeHandle Map::add_keyframe(Keyframe&& keyframe) {
  const KeyframeHandle handle = keyframes_.allocate();
  if (handle.is_null()) return handle;
  Keyframe& slot = keyframes_[handle];
  refill(std::move(keyframe), &slot);
  slot.id = next_keyframe_id_++;
  slot.landmarks.assign(slot.set.features.size(), {});
  slot.optimised = 0;
  add_to_skeleton(handle);
  return handle;
}

void Map::remove_keyframe(KeyframeHandle handle) {
  if (!keyframes_.contains(handle)) return;
  Keyframe& keyframe = keyframes_[handle];
  // The keyframe that shares most keeps the pose of this one; the nearest id stands in where nothing is
  // shared.
  KeyframeHandle parent;
  for (const Covisible& c : keyframe.covisible)
    if (keyframes_.contains(c.keyframe)) {
      parent = c.keyframe;
      break;
    }
  if (parent.is_null()) {
    std::uint64_t best = ~std::uint64_t{0};
    keyframes_.for_each([&](KeyframeHandle h, const Keyframe& k) {
      if (h == handle || k.map_id != keyframe.map_id) return;
      const std::uint64_t gap = k.id > keyframe.id ? k.id - keyframe.id : keyframe.id - k.id;
      if (gap < best) best = gap, parent = h;
    });
  }
  if (keyframe.id >= first_in_skeleton_) {
    SkeletonNode& node = skeleton_[keyframe.id - first_in_skeleton_];
    node.alive = {};
    if (!parent.is_null()) {
      const SE3 T_parent_this = keyframes_[parent].T_world_body.inverse() * keyframe.T_world_body;
      node.parent_id = keyframes_[parent].id;
      node.q_parent_this = T_parent_this.q;
      node.t_parent_this = T_parent_this.t;
    }
  }
  for (const LandmarkHandle& l : keyframe.landmarks)
    if (landmarks_.contains(l)) remove_observation(l, handle);
  leave_covisible(handle);
  if (keyframe.image)
    keep_room_of(&keyframe);
  else
    keep_thinned_room(std::move(keyframe.landmarks));
  refill({}, &keyframe);
  keyframes_.release(handle);
}

Keyframe Map::roomy_keyframe() {
  if (rooms_.empty()) return {};
  Keyframe keyframe = std::move(rooms_.back());
  rooms_.pop_back();
  return keyframe;
}

void Map::keep_room_of(Keyframe* keyframe) {
  Keyframe& room = rooms_.emplace_back();
  room.set = std::move(keyframe->set);
  room.landmarks = std::move(keyframe->landmarks);
  room.bearings = std::move(keyframe->bearings);
  room.grid = std::move(keyframe->grid);
}

void Map::thin_keyframe(KeyframeHandle handle) {
  Keyframe& k = keyframes_[handle];
  if (!k.image) return;  // it has been thinned before
  k.image.reset();
  const auto used = static_cast<std::size_t>(
      std::count_if(k.landmarks.begin(), k.landmarks.end(), [](LandmarkHandle l) { return !l.is_null(); }));
  std::vector<LandmarkHandle> landmarks = thinned_room(used);
  for (const LandmarkHandle& seen : k.landmarks) {
    Landmark* l = landmarks_.get(seen);
    if (l == nullptr) continue;
    for (Observation& o : l->observations)
      if (o.keyframe == handle) o.feature = static_cast<std::int32_t>(landmarks.size());
    landmarks.push_back(seen);
  }
  keep_room_of(&k);
  k.landmarks = std::move(landmarks);
}

std::vector<LandmarkHandle> Map::thinned_room(std::size_t landmarks) {
  std::vector<LandmarkHandle> room;
  if (landmarks <= thinned_room_ && !thinned_rooms_.empty()) {
    room = std::move(thinned_rooms_.back());
    thinned_rooms_.pop_back();
    room.clear();
  } else {
    room.reserve((landmarks + kThinStep - 1) / kThinStep * kThinStep);
  }
  return room;
}

void Map::keep_thinned_room(std::vector<LandmarkHandle>&& room) {
  // A larger one is rare and goes back to the heap, or all would grow to the largest in time.
  if (thinned_room_ > 0 && room.capacity() == thinned_room_) thinned_rooms_.push_back(std::move(room));
}

LandmarkHandle Map::add_landmark(KeyframeHandle host, std::size_t feature) {
  Keyframe& keyframe = keyframes_[host];
  if (!keyframe.landmarks[feature].is_null() || !keyframe.image) return {};
  Patch patch;
  if (!keyframe.image->extract_patch(keyframe.set, feature, &patch)) return {};
  const LandmarkHandle handle = landmarks_.allocate();
  if (handle.is_null()) return handle;
  Landmark& l = landmarks_[handle];
  l = Landmark{};

  const Feature& f = keyframe.set.features[feature];
  const RigCamera& camera = rig_.cameras[static_cast<std::size_t>(keyframe.camera)];
  l.id = next_landmark_id_++;
  l.map_id = keyframe.map_id;
  l.host = host;
  l.T_host_anchor = camera.T_body_camera;
  l.host_camera = keyframe.camera;
  l.host_pixel = {f.u_px, f.v_px};
  l.anchor_utime = keyframe.utime;
  if (!set_bearing(&l)) {
    landmarks_.release(handle);
    return {};
  }
  l.patch = patch;
  l.descriptor = keyframe.set.descriptors[feature];
  l.host_level = f.level;
  l.created_keyframe = l.last_seen_keyframe = keyframe.id;
  l.created_utime = keyframe.utime;
  l.observations.push_back({host, static_cast<std::int32_t>(feature), {f.u_px, f.v_px}, 0.0F, f.level});
  keyframe.landmarks[feature] = handle;
  return handle;
}

bool Map::set_bearing(Landmark* l) const {
  const Camera& camera = rig_.cameras[static_cast<std::size_t>(l->host_camera)].camera;
  Eigen::Vector3d bearing;
  Eigen::Matrix<double, 3, 2> derivative;
  if (!camera.unproject(l->host_pixel, &bearing, &derivative)) return false;
  l->bearing = bearing;
  l->d_bearing_d_pixel = derivative;
  return true;
}

void Map::set_camera(int index, const Camera& camera) {
  rig_.cameras[static_cast<std::size_t>(index)].camera = camera;
  landmarks_.for_each([&](LandmarkHandle, Landmark& l) {
    // A ray lost at the very edge of the image keeps its old value.
    if (l.host_camera == index) (void)set_bearing(&l);
  });
  keyframes_.for_each([&](KeyframeHandle, Keyframe& k) {
    if (k.camera != index || !k.image) return;
    for (std::size_t i = 0; i < k.bearings.size(); ++i) {
      Eigen::Vector3d bearing;
      if (camera.unproject({k.set.features[i].u_px, k.set.features[i].v_px}, &bearing))
        k.bearings[i] = bearing.cast<float>();
    }
  });
}

void Map::detach_feature(const Observation& o) {
  if (Keyframe* k = keyframes_.get(o.keyframe)) k->landmarks[static_cast<std::size_t>(o.feature)] = {};
}

void Map::remove_landmark(LandmarkHandle handle) {
  Landmark* l = landmarks_.get(handle);
  if (l == nullptr) return;
  for (const Observation& o : l->observations) detach_feature(o);
  // A slot must not keep what its best-seen landmark once needed, as with "= {}" it would.
  l->observations.clear();
  l->observations.shrink_to_fit();
  landmarks_.release(handle);
}

const Observation* Map::find_observation(const Landmark& landmark, KeyframeHandle keyframe) {
  for (const Observation& o : landmark.observations)
    if (o.keyframe == keyframe) return &o;
  return nullptr;
}

bool Map::add_observation(LandmarkHandle handle, const Observation& observation) {
  Landmark& l = landmarks_[handle];
  Keyframe& k = keyframes_[observation.keyframe];
  const auto feature = static_cast<std::size_t>(observation.feature);
  if (observation.feature < 0 || feature >= k.landmarks.size() || !k.landmarks[feature].is_null())
    return false;
  if (find_observation(l, observation.keyframe) != nullptr) return false;
  k.landmarks[feature] = handle;
  const auto later = std::find_if(l.observations.begin(), l.observations.end(),
                                  [&](const Observation& o) { return keyframes_[o.keyframe].id > k.id; });
  const auto at = later - l.observations.begin();
  // Doubling would leave a third of the room empty.
  if (l.observations.size() == l.observations.capacity())
    l.observations.reserve(l.observations.size() + kObservationStep);
  const auto added = l.observations.insert(l.observations.begin() + at, observation);
  // A thinned keyframe knows its corners no longer: the sighting has to.
  if (feature < k.set.features.size()) added->level = k.set.features[feature].level;
  l.last_seen_keyframe = std::max(l.last_seen_keyframe, k.id);
  note_parallax(observation, &l);
  if (l.observations.size() > static_cast<std::size_t>(capacity_.observations_per_landmark))
    thin_observations(l, handle);
  return true;
}

void Map::note_parallax(const Observation& o, Landmark* l) const {
  const double angle = parallax(*l, o);
  if (angle <= l->max_parallax_rad) return;
  l->max_parallax_rad = angle;
  l->parallax_keyframe = o.keyframe;
}

void Map::thin_observations(Landmark& l, LandmarkHandle handle) {
  // The host defines the bearing, the best pair the depth, the newest ones the link to tracking: of the rest
  // the one in the middle tells least that its neighbours do not.
  std::size_t middle = l.observations.size() / 2;
  while (middle + 1 < l.observations.size() && (l.observations[middle].keyframe == l.host ||
                                                l.observations[middle].keyframe == l.parallax_keyframe))
    ++middle;
  remove_observation(handle, l.observations[middle].keyframe);
}

bool Map::remove_observation(LandmarkHandle handle, KeyframeHandle keyframe) {
  Landmark& l = landmarks_[handle];
  const auto it = std::find_if(l.observations.begin(), l.observations.end(),
                               [&](const Observation& o) { return o.keyframe == keyframe; });
  if (it == l.observations.end()) return true;
  detach_feature(*it);
  l.observations.erase(it);
  if (l.observations.size() < 2) {
    remove_landmark(handle);
    return false;
  }
  if (l.parallax_keyframe == keyframe) {
    // The best pair is gone: the best of those that are left.
    l.max_parallax_rad = 0.0;
    l.parallax_keyframe = {};
    for (const Observation& o : l.observations) note_parallax(o, &l);
  }
  if (l.host == keyframe) rehost(handle, l.observations.front().keyframe);
  return true;
}

void Map::rehost(LandmarkHandle handle, KeyframeHandle new_host) {
  Landmark& l = landmarks_[handle];
  if (l.host == new_host || find_observation(l, new_host) == nullptr) return;
  const SE3 T_world_anchor = keyframes_[l.host].T_world_body * l.T_host_anchor;
  l.T_host_anchor = keyframes_[new_host].T_world_body.inverse() * T_world_anchor;
  l.host = new_host;
  // The new host's own sighting stays a measurement: the anchor is no longer its camera.
}

void Map::fuse(LandmarkHandle into, LandmarkHandle from) {
  if (into == from || !landmarks_.contains(into) || !landmarks_.contains(from)) return;
  const auto moved = landmarks_[from].observations;
  const std::uint32_t found = landmarks_[from].found, visible = landmarks_[from].visible;
  remove_landmark(from);
  for (const Observation& o : moved) {
    Observation copy = o;
    // A host's sighting had no error of its own; in the other landmark it is one corner among others.
    if (copy.sigma_px <= 0.0F) copy.sigma_px = 1.0F;
    add_observation(into, copy);
  }
  landmarks_[into].found += found;
  landmarks_[into].visible += visible;
}

SE3 Map::T_world_anchor(const Landmark& l) const {
  return keyframes_[l.host].T_world_body * l.T_host_anchor;
}

SE3 Map::T_world_camera(const Keyframe& k) const {
  return k.T_world_body * rig_.cameras[static_cast<std::size_t>(k.camera)].T_body_camera;
}

Eigen::Vector4d Map::world_point(const Landmark& l) const {
  const SE3 T = T_world_anchor(l);
  Eigen::Vector4d p;
  p.head<3>() = T.q * l.bearing + l.inverse_depth * T.t;
  p[3] = l.inverse_depth;
  return p;
}

double Map::parallax(const Landmark& l, const Observation& o) const {
  const Keyframe& k = keyframes_[o.keyframe];
  Eigen::Vector3d bearing;
  const Camera& camera = rig_.cameras[static_cast<std::size_t>(k.camera)].camera;
  if (!camera.unproject(o.pixel.cast<double>(), &bearing)) return 0.0;
  const Eigen::Vector3d a = T_world_anchor(l).q * l.bearing;
  const Eigen::Vector3d b = T_world_camera(k).q * bearing;
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

void Map::update_covisibility(KeyframeHandle handle) {
  Keyframe& keyframe = keyframes_[handle];
  const std::size_t most = options_.covisible > 0 ? options_.covisible : keyframes_.capacity();
  std::fill(shared_.begin(), shared_.end(), Shared{});
  for (const LandmarkHandle& lh : keyframe.landmarks) {
    const Landmark* l = landmarks_.get(lh);
    if (l == nullptr || l->state == LandmarkState::kBearing) continue;
    const int wide = is_wide(*l) ? 1 : 0;
    for (const Observation& o : l->observations) {
      ++shared_[o.keyframe.index].all;
      shared_[o.keyframe.index].wide += wide;
    }
  }
  leave_covisible(handle);
  const auto stronger = [this](const Covisible& a, const Covisible& b) {
    if (a.wide != b.wide) return a.wide > b.wide;
    if (a.shared != b.shared) return a.shared > b.shared;
    return keyframes_[a.keyframe].id > keyframes_[b.keyframe].id;
  };
  // Counted in a list of its own: the keyframe's would keep the room of all that share anything.
  counted_.clear();
  keyframes_.for_each([&](KeyframeHandle h, Keyframe& other) {
    const Shared& shared = shared_[h.index];
    if (h == handle || shared.all == 0) return;
    counted_.push_back({h, shared.all, shared.wide});
    const Covisible back{handle, shared.all, shared.wide};
    other.covisible.insert(std::lower_bound(other.covisible.begin(), other.covisible.end(), back, stronger),
                           back);
    if (other.covisible.size() > most) other.covisible.pop_back();
  });
  std::sort(counted_.begin(), counted_.end(), stronger);
  const auto noted = static_cast<std::ptrdiff_t>(std::min(most, counted_.size()));
  keyframe.covisible.assign(counted_.begin(), counted_.begin() + noted);
}

// A list may hold a keyframe whose own list, full of stronger ones, does not hold its owner.
void Map::leave_covisible(KeyframeHandle handle) {
  keyframes_.for_each([&](KeyframeHandle, Keyframe& other) {
    std::erase_if(other.covisible, [&](const Covisible& o) { return o.keyframe == handle; });
  });
}

void Map::add_to_skeleton(KeyframeHandle keyframe) {
  SkeletonNode& node = skeleton_.emplace_back();
  node.alive = keyframe;
  // Whoever asks for a removed keyframe's pose has seen it lately: tracking, some views ago.
  if (capacity_.whole_trajectory || skeleton_.size() <= 2 * keyframes_.capacity()) return;
  skeleton_.pop_front();
  ++first_in_skeleton_;
}

const Map::SkeletonNode* Map::skeleton_node(std::uint64_t id) const {
  const std::uint64_t at = id - first_in_skeleton_;  // huge where it lies before
  return at < skeleton_.size() ? &skeleton_[at] : nullptr;
}

bool Map::pose_of(std::uint64_t id, SE3* T_world_body) const {
  SE3 tail;
  while (const SkeletonNode* node = skeleton_node(id)) {
    if (const Keyframe* k = keyframes_.get(node->alive)) {
      *T_world_body = k->T_world_body * tail;
      return true;
    }
    if (node->parent_id == 0) return false;
    tail = SE3{Eigen::Quaterniond(node->q_parent_this), node->t_parent_this} * tail;
    id = node->parent_id;
  }
  // A keyframe may outlive its place in the skeleton.
  bool found = false;
  keyframes_.for_each([&](KeyframeHandle, const Keyframe& k) {
    if (k.id != id) return;
    *T_world_body = k.T_world_body * tail;
    found = true;
  });
  return found;
}

void Map::discard_map(std::int32_t map_id) {
  landmarks_.for_each([&](LandmarkHandle h, const Landmark& l) {
    if (l.map_id == map_id) remove_landmark(h);
  });
  keyframes_.for_each([&](KeyframeHandle h, const Keyframe& k) {
    if (k.map_id == map_id) remove_keyframe(h);
  });
}

}  // namespace farpoint::slam
