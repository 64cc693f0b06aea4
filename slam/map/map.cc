// SPDX-License-Identifier: Apache-2.0
#include "slam/map/map.h"

#include <algorithm>
#include <cmath>
#include <memory>

namespace farpoint::slam {

namespace {

constexpr std::size_t kObservationStep = 4;
// Observations preallocated, as a share of those that thinned keyframes have lists for: landmarks are removed
// while their keyframes stay.
constexpr double kObservedShare = 0.75;

std::size_t observations_of_full_map(const CapacityConfig& capacity, const MapOptions& options) {
  const std::size_t views =
      static_cast<std::size_t>(capacity.keyframes) * static_cast<std::size_t>(options.views_per_keyframe);
  const std::size_t thinned = options.features / KeyframeMemory::kThinnedShare * views;
  return static_cast<std::size_t>(kObservedShare * static_cast<double>(thinned));
}

KeyframeMemoryOptions keyframe_memory(const CapacityConfig& capacity, const MapOptions& options) {
  const auto views = static_cast<std::size_t>(options.views_per_keyframe);
  return {.features = options.features,
          .with_pixels = views * (static_cast<std::size_t>(capacity.window_images) + 1),
          .thinned = views * static_cast<std::size_t>(capacity.keyframes)};
}

// A removed keyframe's pose is asked for soon or never: tracking refers to it some views long.
std::size_t skeleton_nodes(const CapacityConfig& capacity) {
  return capacity.whole_trajectory ? 0 : 2 * static_cast<std::size_t>(capacity.keyframes);
}

// The slot keeps the capacity of its list of covisible keyframes.
void refill(Keyframe&& with, Keyframe* slot) {
  std::vector<Covisible> list = std::move(slot->covisible);
  list.clear();
  *slot = std::move(with);
  slot->covisible = std::move(list);
}

}  // namespace

Map::Map(const CapacityConfig& capacity, const Rig& rig, const MapOptions& options)
    : capacity_(capacity),
      rig_(rig),
      keyframes_(static_cast<std::size_t>(capacity.keyframes)),
      observation_room_(observations_of_full_map(capacity, options),
                        static_cast<std::size_t>(capacity.observations_per_landmark) + kObservationStep),
      landmarks_(static_cast<std::size_t>(capacity.landmarks)),
      keyframe_memory_(keyframe_memory(capacity, options)),
      covisibility_({.wide_parallax_rad = options.wide_parallax_rad, .longest_list = options.covisible},
                    &keyframes_, landmarks_),
      skeleton_(skeleton_nodes(capacity)),
      chain_(static_cast<std::size_t>(capacity.keyframes)) {
  landmarks_.for_each_slot([this](Landmark& l) {
    std::destroy_at(&l.observations);
    std::construct_at(&l.observations, observation_room_.resource());
  });
  if (options.features == 0) return;
  keyframes_.for_each_slot([&](Keyframe& k) {
    // Touched, not only reserved.
    k.covisible.resize(covisibility_.list_capacity());
    k.covisible.clear();
  });
}

std::size_t Map::keyframe_bytes() const {
  std::size_t bytes = keyframes_.bytes() + keyframe_memory_.bytes();
  keyframes_.for_each([&](KeyframeHandle, const Keyframe& k) {
    for (int c = 0; c < k.views.size(); ++c) bytes += KeyframeMemory::array_bytes(k.views[c]);
  });
  keyframes_.for_each_slot(
      [&bytes](const Keyframe& k) { bytes += k.covisible.capacity() * sizeof(Covisible); });
  return bytes;
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
  slot.views.resize(camera_count());
  for (int c = 0; c < slot.views.size(); ++c)
    slot.views[c].landmarks.assign(slot.views[c].set.features.size(), {});
  slot.optimised = 0;
  skeleton_.add(slot.id, handle);
  add_to_chain(handle);
  return handle;
}

void Map::add_to_chain(KeyframeHandle handle) {
  const Keyframe& added = keyframes_[handle];
  KeyframeHandle last;
  keyframes_.for_each([&](KeyframeHandle h, const Keyframe& k) {
    if (h == handle || k.map_id != added.map_id) return;
    if (last.is_null() || k.id > keyframes_[last].id) last = h;
  });
  if (last.is_null())
    chain_.begin(handle);
  else
    chain_.extend(last, handle, {.from_utime = keyframes_[last].utime, .to_utime = added.utime});
}

void Map::remove_keyframe(KeyframeHandle handle) {
  if (!keyframes_.contains(handle)) return;
  Keyframe& keyframe = keyframes_[handle];
  remove_from_skeleton(handle);
  for (int c = 0; c < keyframe.views.size(); ++c)
    for (const LandmarkHandle& l : keyframe.views[c].landmarks)
      if (landmarks_.contains(l)) remove_observation(l, handle, c);
  covisibility_.leave(handle);
  chain_.remove(handle);
  for (int c = 0; c < keyframe.views.size(); ++c) {
    KeyframeView& view = keyframe.views[c];
    if (view.has_pixels())
      keyframe_memory_.give_back(&view);
    else
      keyframe_memory_.give_back_thinned(std::move(view.landmarks));
  }
  refill({}, &keyframe);
  keyframes_.release(handle);
}

KeyframeHandle Map::skeleton_parent(KeyframeHandle handle) const {
  const Keyframe& keyframe = keyframes_[handle];
  for (const Covisible& c : keyframe.covisible)
    if (keyframes_.contains(c.keyframe)) return c.keyframe;
  // Nothing is shared: the nearest in time.
  KeyframeHandle parent;
  std::uint64_t best = ~std::uint64_t{0};
  keyframes_.for_each([&](KeyframeHandle h, const Keyframe& k) {
    if (h == handle || k.map_id != keyframe.map_id) return;
    const std::uint64_t gap = k.id > keyframe.id ? k.id - keyframe.id : keyframe.id - k.id;
    if (gap < best) best = gap, parent = h;
  });
  return parent;
}

void Map::remove_from_skeleton(KeyframeHandle handle) {
  const Keyframe& keyframe = keyframes_[handle];
  const Keyframe* parent = keyframes_.get(skeleton_parent(handle));
  if (parent == nullptr)
    skeleton_.remove_without_parent(keyframe.id);
  else
    skeleton_.remove(keyframe.id, parent->id, parent->S_world_body().inverse() * keyframe.S_world_body());
}

void Map::thin_keyframe(KeyframeHandle handle) {
  for (int c = 0; c < keyframes_[handle].views.size(); ++c) thin_view(handle, c);
}

void Map::thin_view(KeyframeHandle handle, int camera) {
  KeyframeView& view = keyframes_[handle].views[camera];
  if (!view.has_pixels()) return;  // thinned before, or no image
  view.image.reset();
  const auto used = static_cast<std::size_t>(std::count_if(view.landmarks.begin(), view.landmarks.end(),
                                                           [](LandmarkHandle l) { return !l.is_null(); }));
  std::vector<LandmarkHandle> landmarks = keyframe_memory_.take_thinned(used);
  for (const LandmarkHandle& seen : view.landmarks) {
    Landmark* l = landmarks_.get(seen);
    if (l == nullptr) continue;
    for (Observation& o : l->observations)
      if (o.is_by(handle, camera)) o.feature = static_cast<std::int32_t>(landmarks.size());
    landmarks.push_back(seen);
  }
  keyframe_memory_.give_back(&view);
  view.landmarks = std::move(landmarks);
}

LandmarkHandle Map::add_landmark(KeyframeHandle host, int camera, std::size_t feature) {
  Keyframe& keyframe = keyframes_[host];
  KeyframeView& view = keyframe.views[camera];
  if (!view.landmarks[feature].is_null() || !view.has_pixels()) return {};
  Patch patch;
  if (!view.image->extract_patch(view.set, feature, &patch)) return {};
  const LandmarkHandle handle = landmarks_.allocate();
  if (handle.is_null()) return handle;
  Landmark& l = landmarks_[handle];
  l = Landmark{};

  const Feature& f = view.set.features[feature];
  l.id = next_landmark_id_++;
  l.map_id = keyframe.map_id;
  l.host = host;
  l.T_host_anchor = this->camera(camera).T_body_camera;
  l.host_camera = camera;
  l.host_pixel = {f.u_px, f.v_px};
  l.anchor_utime = keyframe.utime;
  if (!set_bearing(&l)) {
    landmarks_.release(handle);
    return {};
  }
  l.patch = patch;
  l.descriptor = view.set.descriptors[feature];
  l.host_level = f.level;
  l.created_keyframe = l.last_seen_keyframe = keyframe.id;
  l.created_utime = keyframe.utime;
  l.observations.push_back({host,
                            static_cast<std::int32_t>(feature),
                            {f.u_px, f.v_px},
                            0.0F,
                            f.level,
                            static_cast<std::uint8_t>(camera)});
  view.landmarks[feature] = handle;
  return handle;
}

bool Map::set_bearing(Landmark* l) const {
  Eigen::Vector3d bearing;
  Eigen::Matrix<double, 3, 2> derivative;
  if (!camera(l->host_camera).camera.unproject(l->host_pixel, &bearing, &derivative)) return false;
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
    KeyframeView& view = k.views[index];
    if (!view.has_pixels()) return;
    for (std::size_t i = 0; i < view.bearings.size(); ++i) {
      Eigen::Vector3d bearing;
      if (camera.unproject({view.set.features[i].u_px, view.set.features[i].v_px}, &bearing))
        view.bearings[i] = bearing.cast<float>();
    }
  });
}

void Map::detach_feature(const Observation& o) {
  if (Keyframe* k = keyframes_.get(o.keyframe))
    k->views[o.camera].landmarks[static_cast<std::size_t>(o.feature)] = {};
}

void Map::remove_landmark(LandmarkHandle handle) {
  Landmark* l = landmarks_.get(handle);
  if (l == nullptr) return;
  for (const Observation& o : l->observations) detach_feature(o);
  // "= {}" would keep the capacity, and every slot would grow to its best-seen landmark in time.
  l->observations.clear();
  l->observations.shrink_to_fit();
  landmarks_.release(handle);
}

const Observation* Map::find_observation(const Landmark& landmark, KeyframeHandle keyframe) {
  for (const Observation& o : landmark.observations)
    if (o.keyframe == keyframe) return &o;
  return nullptr;
}

const Observation* Map::find_observation(const Landmark& landmark, KeyframeHandle keyframe, int camera) {
  for (const Observation& o : landmark.observations)
    if (o.is_by(keyframe, camera)) return &o;
  return nullptr;
}

bool Map::add_observation(LandmarkHandle handle, const Observation& observation) {
  Landmark& l = landmarks_[handle];
  Keyframe& k = keyframes_[observation.keyframe];
  std::vector<LandmarkHandle>& seen = k.views[observation.camera].landmarks;
  const auto feature = static_cast<std::size_t>(observation.feature);
  if (observation.feature < 0 || feature >= seen.size() || !seen[feature].is_null()) return false;
  if (find_observation(l, observation.keyframe, observation.camera) != nullptr) return false;
  seen[feature] = handle;
  insert_sorted(observation, &l);
  l.last_seen_keyframe = std::max(l.last_seen_keyframe, k.id);
  note_parallax(observation, &l);
  if (l.observations.size() > static_cast<std::size_t>(capacity_.observations_per_landmark))
    thin_observations(l, handle);
  return true;
}

void Map::insert_sorted(const Observation& observation, Landmark* l) {
  const Keyframe& k = keyframes_[observation.keyframe];
  const auto later = std::find_if(l->observations.begin(), l->observations.end(), [&](const Observation& o) {
    return o.keyframe == observation.keyframe ? o.camera > observation.camera
                                              : keyframes_[o.keyframe].id > k.id;
  });
  const auto at = later - l->observations.begin();
  // Doubling would leave a third of the memory unused.
  if (l->observations.size() == l->observations.capacity())
    l->observations.reserve(l->observations.size() + kObservationStep);
  const auto added = l->observations.insert(l->observations.begin() + at, observation);
  // A thinned view has no features: its observations keep the level.
  const std::vector<Feature>& features = k.views[observation.camera].set.features;
  const auto feature = static_cast<std::size_t>(observation.feature);
  if (feature < features.size()) added->level = features[feature].level;
}

void Map::note_parallax(const Observation& o, Landmark* l) const {
  const double angle = parallax(*l, o);
  if (angle <= l->max_parallax_rad) return;
  l->max_parallax_rad = angle;
  l->parallax_keyframe = o.keyframe;
  l->parallax_camera = o.camera;
}

void Map::thin_observations(Landmark& l, LandmarkHandle handle) {
  // The host defines the bearing, the best pair the depth, the newest ones link to tracking. Of the rest the
  // middle one differs least from its neighbours.
  const auto is_needed = [&l](const Observation& o) {
    return o.keyframe == l.host || o.is_by(l.parallax_keyframe, l.parallax_camera);
  };
  std::size_t middle = l.observations.size() / 2;
  while (middle + 1 < l.observations.size() && is_needed(l.observations[middle])) ++middle;
  const Observation& thinned = l.observations[middle];
  remove_observation(handle, thinned.keyframe, thinned.camera);
}

bool Map::remove_observation(LandmarkHandle handle, KeyframeHandle keyframe, int camera) {
  Landmark& l = landmarks_[handle];
  const auto it = std::find_if(l.observations.begin(), l.observations.end(),
                               [&](const Observation& o) { return o.is_by(keyframe, camera); });
  if (it == l.observations.end()) return true;
  detach_feature(*it);
  l.observations.erase(it);
  if (l.observations.size() < 2) {
    remove_landmark(handle);
    return false;
  }
  if (l.parallax_keyframe == keyframe && l.parallax_camera == camera) {
    // The best pair is gone: search the best of those left.
    l.max_parallax_rad = 0.0;
    l.parallax_keyframe = {};
    for (const Observation& o : l.observations) note_parallax(o, &l);
  }
  if (l.host == keyframe && find_observation(l, keyframe) == nullptr)
    rehost(handle, l.observations.front().keyframe);
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

SE3 Map::T_world_anchor(const Landmark& l) const {
  return keyframes_[l.host].T_world_body * l.T_host_anchor;
}

SE3 Map::T_world_camera(const Keyframe& keyframe, int index) const {
  return keyframe.T_world_body * camera(index).T_body_camera;
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
  if (!camera(o.camera).camera.unproject(o.pixel.cast<double>(), &bearing)) return 0.0;
  const Eigen::Vector3d a = T_world_anchor(l).q * l.bearing;
  const Eigen::Vector3d b = T_world_camera(k, o.camera).q * bearing;
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

void Map::correct_keyframe(KeyframeHandle handle, const Sim3& S_new_old) {
  Keyframe& keyframe = keyframes_[handle];
  keyframe.T_world_body = S_new_old * keyframe.T_world_body;
  keyframe.scale *= S_new_old.scale;
  for (int c = 0; c < keyframe.views.size(); ++c)
    for (const LandmarkHandle& h : keyframe.views[c].landmarks) {
      Landmark* l = landmarks_.get(h);
      // Once a landmark, also where two cameras of its host see it.
      if (l == nullptr || l->host != handle || find_observation(*l, handle)->camera != c) continue;
      l->T_host_anchor.t *= S_new_old.scale;
      l->inverse_depth /= S_new_old.scale;
      l->inverse_depth_sigma /= S_new_old.scale;
      l->creation_depth *= S_new_old.scale;
    }
}

void Map::transform(std::int32_t map_id, const Sim3& S_new_old) {
  keyframes_.for_each([&](KeyframeHandle h, const Keyframe& k) {
    if (k.map_id == map_id) correct_keyframe(h, S_new_old);
  });
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
