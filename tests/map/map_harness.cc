// SPDX-License-Identifier: Apache-2.0
#include "tests/map/map_harness.h"

#include <set>
#include <utility>

namespace farpoint::slam {

CapacityConfig small_capacity() {
  CapacityConfig c;
  c.keyframes = 14;
  c.landmarks = 120;
  c.observations_per_landmark = 6;
  return c;
}

void expect_same_pose(const SE3& a, const SE3& b) {
  EXPECT_LT((a.t - b.t).norm(), 1e-9);
  EXPECT_LT((a.rotation() - b.rotation()).norm(), 1e-9);
}

namespace {

void check_view_links(const Map& map, KeyframeHandle h, int camera) {
  const Keyframe& k = map.keyframes()[h];
  const KeyframeView& view = k.views[camera];
  const bool thinned = view.image == nullptr;
  ASSERT_TRUE(thinned || view.landmarks.size() == view.set.features.size());
  for (std::size_t f = 0; f < view.landmarks.size(); ++f) {
    if (view.landmarks[f].is_null()) continue;
    const Landmark* l = map.landmarks().get(view.landmarks[f]);
    ASSERT_NE(l, nullptr) << "keyframe " << k.id << " feature " << f << " names a landmark that is gone";
    const Observation* o = Map::find_observation(*l, h, camera);
    ASSERT_NE(o, nullptr) << "keyframe " << k.id << " feature " << f << ": landmark does not name it";
    ASSERT_EQ(o->feature, static_cast<int>(f));
    ASSERT_TRUE(thinned || o->level == view.set.features[f].level);
  }
}

void check_landmark_links(const Map& map, const CapacityConfig& capacity, LandmarkHandle h,
                          const Landmark& l) {
  ASSERT_GE(l.observations.size(), 1U);
  ASSERT_LE(l.observations.size(), static_cast<std::size_t>(capacity.observations_per_landmark));
  std::pair<std::uint64_t, int> last{0, 0};
  double largest = 0;
  for (const Observation& o : l.observations) {
    const Keyframe* k = map.keyframes().get(o.keyframe);
    ASSERT_NE(k, nullptr) << "landmark " << l.id << " is seen by a keyframe that is gone";
    const std::pair<std::uint64_t, int> place{k->id, o.camera};
    ASSERT_GT(place, last) << "landmark " << l.id << ": observations out of order";
    last = place;
    ASSERT_EQ(k->views[o.camera].landmarks.at(static_cast<std::size_t>(o.feature)), h);
    largest = std::max(largest, map.parallax(l, o));
  }
  ASSERT_NE(Map::find_observation(l, l.host), nullptr) << "landmark " << l.id << " is hosted by no observer";
  ASSERT_GE(l.last_seen_keyframe, last.first);
  // Poses stand still here, so the kept parallax is today's.
  ASSERT_NEAR(l.max_parallax_rad, largest, 1e-6);
  if (!l.parallax_keyframe.is_null()) {
    const Observation* best = Map::find_observation(l, l.parallax_keyframe, l.parallax_camera);
    ASSERT_NE(best, nullptr) << "landmark " << l.id << ": its best pair is gone";
    ASSERT_NEAR(map.parallax(l, *best), largest, 1e-6);
  }
}

void check_covisibility(const Map& map, KeyframeHandle h, const Keyframe& k) {
  std::set<std::uint32_t> seen;
  for (std::size_t i = 0; i < k.covisible.size(); ++i) {
    const Covisible& c = k.covisible[i];
    ASSERT_NE(c.keyframe, h);
    ASSERT_TRUE(map.keyframes().contains(c.keyframe));
    ASSERT_TRUE(seen.insert(c.keyframe.index).second) << "twice in the list";
    const auto& back = map.keyframes()[c.keyframe].covisible;
    const auto it =
        std::find_if(back.begin(), back.end(), [&](const Covisible& o) { return o.keyframe == h; });
    ASSERT_NE(it, back.end()) << "covisibility one way only";
    ASSERT_EQ(it->shared, c.shared);
    if (i == 0) continue;
    const Covisible& before = k.covisible[i - 1];
    ASSERT_TRUE(
        before.shared > c.shared ||
        (before.shared == c.shared && map.keyframes()[before.keyframe].id > map.keyframes()[c.keyframe].id));
  }
}

void check_chain(const Map& map, KeyframeHandle h, const Keyframe& k) {
  KeyframeHandle before, after;
  map.keyframes().for_each([&](KeyframeHandle other, const Keyframe& o) {
    if (o.map_id != k.map_id) return;
    if (o.id < k.id && (before.is_null() || o.id > map.keyframes()[before].id)) before = other;
    if (o.id > k.id && (after.is_null() || o.id < map.keyframes()[after].id)) after = other;
  });
  ASSERT_EQ(map.chain().before(h), before);
  ASSERT_EQ(map.chain().after(h), after);
  const ChainLink* link = map.chain().link_to(h);
  ASSERT_EQ(link == nullptr, before.is_null());
  if (link == nullptr) return;
  const Keyframe& previous = map.keyframes()[before];
  ASSERT_EQ(link->from_utime, previous.utime);
  ASSERT_EQ(link->to_utime, k.utime);
  ASSERT_LE(link->removed_keyframes, k.id - previous.id - 1);
}

}  // namespace

void check(const Map& map, const CapacityConfig& capacity) {
  map.keyframes().for_each([&](KeyframeHandle h, const Keyframe& k) {
    for (int c = 0; c < k.views.size(); ++c) check_view_links(map, h, c);
    check_covisibility(map, h, k);
    check_chain(map, h, k);
  });
  map.landmarks().for_each(
      [&](LandmarkHandle h, const Landmark& l) { check_landmark_links(map, capacity, h, l); });
}

void Shaker::step() {
  const auto keyframes = alive(map_.keyframes());
  const auto landmarks = alive(map_.landmarks());
  const std::size_t what = random_.below(100);
  if (keyframes.size() < 2 || what < 6) return add_keyframe();
  const KeyframeHandle k = keyframes[random_.below(keyframes.size())];
  if (what < 10) return remove_keyframe(k);
  const Observer by{k, static_cast<int>(random_.below(2))};
  if (landmarks.empty() || what < 35) return add_landmark(by);
  const LandmarkHandle l = landmarks[random_.below(landmarks.size())];
  if (what < 75) return add_observation(l, by);
  if (what < 85) return remove_observation(l);
  if (what < 88) return map_.remove_landmark(l);
  if (what < 95) return map_.rehost(l, k);
  if (what < 97) return map_.thin_keyframe(k);
  map_.update_covisibility(k);
}

void Shaker::add_keyframe() {
  const bool was_full = map_.keyframes().full();
  Keyframe keyframe = make_keyframe(map_.rig(), static_cast<int>(random_.below(2)), random_pose(&random_),
                                    kFeatures, &random_);
  keyframe.utime = utime_ += 1000;
  if (random_.below(2) == 0)
    for (const int c : {0, 1}) keyframe.views[c] = make_view(map_.camera(c).camera, kFeatures, &random_);
  const auto h = map_.add_keyframe(std::move(keyframe));
  EXPECT_EQ(h.is_null(), was_full);
  full += h.is_null() ? 1 : 0;
}

void Shaker::remove_keyframe(KeyframeHandle k) {
  map_.remove_keyframe(k);
  EXPECT_FALSE(map_.keyframes().contains(k));
  ++gone;
}

void Shaker::add_landmark(Observer by) {
  const KeyframeView& view = map_.keyframes()[by.keyframe].views[by.camera];
  if (view.landmarks.empty()) return;
  const std::size_t feature = random_.below(view.landmarks.size());
  const bool impossible = !view.landmarks[feature].is_null() || !view.has_pixels();
  const bool was_full = map_.landmarks().full();
  const LandmarkHandle h = map_.add_landmark(by.keyframe, by.camera, feature);
  EXPECT_EQ(h.is_null(), impossible || was_full);
  if (h.is_null()) return;
  handles.push_back(h);
  Landmark& l = map_.landmarks()[h];
  l.state = static_cast<LandmarkState>(random_.below(3));
  l.inverse_depth = random_.uniform(0.0, 0.2);
}

void Shaker::add_observation(LandmarkHandle l, Observer by) {
  const std::vector<LandmarkHandle>& there = map_.keyframes()[by.keyframe].views[by.camera].landmarks;
  if (there.empty()) return;
  const std::size_t feature = random_.below(there.size());
  const bool taken = !there[feature].is_null();
  const bool seen = Map::find_observation(map_.landmarks()[l], by.keyframe, by.camera) != nullptr;
  const bool ok = map_.add_observation(l, sighting(map_, by.keyframe, feature, by.camera));
  EXPECT_EQ(ok, !taken && !seen);
  ++(ok ? added : refused);
}

void Shaker::remove_observation(LandmarkHandle h) {
  const Landmark& l = map_.landmarks()[h];
  const std::size_t before = l.observations.size();
  const Observation& o = l.observations[random_.below(before)];
  const bool lives = map_.remove_observation(h, o.keyframe, o.camera);
  EXPECT_EQ(lives, before > 2);
  EXPECT_EQ(map_.landmarks().contains(h), lives);
}

}  // namespace farpoint::slam
