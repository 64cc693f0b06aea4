#include "slam/map/map.h"

#include <gtest/gtest.h>

#include <map>
#include <optional>
#include <set>

#include "tests/map/map_fixture.h"

namespace farpoint::slam {
namespace {

constexpr int kFeatures = 40;

CapacityConfig small_capacity() {
  CapacityConfig c;
  c.keyframes = 14;
  c.landmarks = 120;
  c.observations_per_landmark = 6;
  return c;
}

// --- consistency

void check_keyframe_links(const Map& map, KeyframeHandle h, const Keyframe& k) {
  const bool thinned = k.image == nullptr;
  ASSERT_TRUE(thinned || k.landmarks.size() == k.set.features.size());
  for (std::size_t f = 0; f < k.landmarks.size(); ++f) {
    if (k.landmarks[f].is_null()) continue;
    const Landmark* l = map.landmarks().get(k.landmarks[f]);
    ASSERT_NE(l, nullptr) << "keyframe " << k.id << " feature " << f << " names a landmark that is gone";
    const Observation* o = Map::find_observation(*l, h);
    ASSERT_NE(o, nullptr) << "keyframe " << k.id << " feature " << f << ": landmark does not know it";
    ASSERT_EQ(o->feature, static_cast<int>(f));
    ASSERT_TRUE(thinned || o->level == k.set.features[f].level);
  }
}

void check_landmark_links(const Map& map, const CapacityConfig& capacity, LandmarkHandle h,
                          const Landmark& l) {
  ASSERT_GE(l.observations.size(), 1U);
  ASSERT_LE(l.observations.size(), static_cast<std::size_t>(capacity.observations_per_landmark));
  std::uint64_t last_id = 0;
  double largest = 0;
  for (const Observation& o : l.observations) {
    const Keyframe* k = map.keyframes().get(o.keyframe);
    ASSERT_NE(k, nullptr) << "landmark " << l.id << " is seen by a keyframe that is gone";
    ASSERT_GT(k->id, last_id) << "landmark " << l.id << ": observations out of order";
    last_id = k->id;
    ASSERT_EQ(k->landmarks.at(static_cast<std::size_t>(o.feature)), h);
    largest = std::max(largest, map.parallax(l, o));
  }
  ASSERT_NE(Map::find_observation(l, l.host), nullptr) << "landmark " << l.id << " is hosted by no observer";
  ASSERT_GE(l.last_seen_keyframe, last_id);
  // Poses stand still here, so the kept parallax is today's.
  ASSERT_NEAR(l.max_parallax_rad, largest, 1e-6);
  if (!l.parallax_keyframe.is_null()) {
    const Observation* best = Map::find_observation(l, l.parallax_keyframe);
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

void check(const Map& map, const CapacityConfig& capacity) {
  map.keyframes().for_each([&](KeyframeHandle h, const Keyframe& k) {
    check_keyframe_links(map, h, k);
    check_covisibility(map, h, k);
  });
  map.landmarks().for_each(
      [&](LandmarkHandle h, const Landmark& l) { check_landmark_links(map, capacity, h, l); });
}

// Random use of every operation that changes links.
class Shaker {
 public:
  Shaker(Map* map, std::uint64_t seed) : map_(*map), random_(seed) {}

  void step() {
    const auto keyframes = alive(map_.keyframes());
    const auto landmarks = alive(map_.landmarks());
    const std::size_t what = random_.below(100);
    if (keyframes.size() < 2 || what < 6) return add_keyframe();
    const KeyframeHandle k = keyframes[random_.below(keyframes.size())];
    if (what < 10) return remove_keyframe(k);
    if (landmarks.empty() || what < 35) return add_landmark(k);
    const LandmarkHandle l = landmarks[random_.below(landmarks.size())];
    if (what < 75) return add_observation(l, k);
    if (what < 85) return remove_observation(l);
    if (what < 88) return map_.remove_landmark(l);
    if (what < 92) return map_.fuse(l, landmarks[random_.below(landmarks.size())]);
    if (what < 95) return map_.rehost(l, k);
    if (what < 97) return map_.thin_keyframe(k);
    map_.update_covisibility(k);
  }

  int added = 0, refused = 0, gone = 0, full = 0;
  std::vector<LandmarkHandle> handles;  // every one ever given

 private:
  void add_keyframe() {
    const bool was_full = map_.keyframes().full();
    const auto h = map_.add_keyframe(make_keyframe(map_.rig(), static_cast<int>(random_.below(2)),
                                                   random_pose(&random_), kFeatures, &random_));
    EXPECT_EQ(h.is_null(), was_full);
    full += h.is_null() ? 1 : 0;
  }
  void remove_keyframe(KeyframeHandle k) {
    map_.remove_keyframe(k);
    EXPECT_FALSE(map_.keyframes().contains(k));
    ++gone;
  }
  void add_landmark(KeyframeHandle k) {
    const Keyframe& keyframe = map_.keyframes()[k];
    if (keyframe.landmarks.empty()) return;
    const std::size_t feature = random_.below(keyframe.landmarks.size());
    const bool impossible = !keyframe.landmarks[feature].is_null() || !keyframe.image;
    const bool was_full = map_.landmarks().full();
    const LandmarkHandle h = map_.add_landmark(k, feature);
    EXPECT_EQ(h.is_null(), impossible || was_full);
    if (h.is_null()) return;
    handles.push_back(h);
    Landmark& l = map_.landmarks()[h];
    l.state = static_cast<LandmarkState>(random_.below(3));
    l.inverse_depth = random_.uniform(0.0, 0.2);
  }
  void add_observation(LandmarkHandle l, KeyframeHandle k) {
    if (map_.keyframes()[k].landmarks.empty()) return;
    const std::size_t feature = random_.below(map_.keyframes()[k].landmarks.size());
    const bool taken = !map_.keyframes()[k].landmarks[feature].is_null();
    const bool seen = Map::find_observation(map_.landmarks()[l], k) != nullptr;
    const bool ok = map_.add_observation(l, sighting(map_, k, feature));
    EXPECT_EQ(ok, !taken && !seen);
    ++(ok ? added : refused);
  }
  void remove_observation(LandmarkHandle h) {
    const Landmark& l = map_.landmarks()[h];
    const std::size_t before = l.observations.size();
    const bool lives = map_.remove_observation(h, l.observations[random_.below(before)].keyframe);
    EXPECT_EQ(lives, before > 2);
    EXPECT_EQ(map_.landmarks().contains(h), lives);
  }

  Map& map_;
  Random random_;
};

TEST(Map, LinksHoldThroughThousandsOfOperations) {
  const CapacityConfig capacity = small_capacity();
  Map map(capacity, two_camera_rig());
  Shaker shaker(&map, 11);
  for (int i = 0; i < 8000; ++i) {
    shaker.step();
    check(map, capacity);
    if (HasFatalFailure() || HasNonfatalFailure()) FAIL() << "after operation " << i;
  }
  // It did what it was meant to do.
  EXPECT_GT(shaker.added, 1000);
  EXPECT_GT(shaker.refused, 100);
  EXPECT_GT(shaker.gone, 100);
  EXPECT_GT(shaker.full, 5);
}

TEST(Map, TheSameOperationsGiveTheSameHandles) {
  std::vector<LandmarkHandle> first, second;
  for (auto* out : {&first, &second}) {
    Map map(small_capacity(), two_camera_rig());
    Shaker shaker(&map, 12);
    for (int i = 0; i < 3000; ++i) shaker.step();
    *out = shaker.handles;
  }
  EXPECT_GT(first.size(), 300U);
  EXPECT_EQ(first, second);
}

// --- single operations

class MapTest : public testing::Test {
 protected:
  KeyframeHandle keyframe(int camera = 0) {
    return map.add_keyframe(make_keyframe(rig, camera, random_pose(&random), kFeatures, &random));
  }
  // Seen by all of `keyframes` at the feature of that number; the first is the host.
  LandmarkHandle landmark(const std::vector<KeyframeHandle>& keyframes, std::size_t feature,
                          double rho = 0.1) {
    const LandmarkHandle h = map.add_landmark(keyframes[0], feature);
    EXPECT_FALSE(h.is_null());
    map.landmarks()[h].state = LandmarkState::kFull;
    map.landmarks()[h].inverse_depth = rho;
    for (std::size_t i = 1; i < keyframes.size(); ++i)
      EXPECT_TRUE(map.add_observation(h, sighting(map, keyframes[i], feature)));
    return h;
  }
  std::vector<KeyframeHandle> keyframes(int n) {
    std::vector<KeyframeHandle> out(static_cast<std::size_t>(n));
    for (int i = 0; i < n; ++i) out[static_cast<std::size_t>(i)] = keyframe(i % 2);
    return out;
  }
  std::vector<std::uint64_t> observers(LandmarkHandle h) {
    std::vector<std::uint64_t> ids;
    for (const Observation& o : map.landmarks()[h].observations)
      ids.push_back(map.keyframes()[o.keyframe].id);
    return ids;
  }

  Rig rig = two_camera_rig();
  CapacityConfig capacity = small_capacity();
  Map map{capacity, rig};
  Random random{5};
};

TEST_F(MapTest, KeyframesGetAscendingIdsAndFreeFeatures) {
  for (std::uint64_t i = 1; i <= 3; ++i) {
    const KeyframeHandle h = keyframe();
    EXPECT_EQ(map.keyframes()[h].id, i);
    EXPECT_EQ(map.keyframes()[h].landmarks.size(), static_cast<std::size_t>(kFeatures));
  }
  map.remove_keyframe(alive(map.keyframes())[1]);
  EXPECT_EQ(map.keyframes()[keyframe()].id, 4U);
}

TEST_F(MapTest, FullMapsGiveNullHandles) {
  while (!map.keyframes().full()) EXPECT_FALSE(keyframe().is_null());
  EXPECT_TRUE(keyframe().is_null());
  const auto all = alive(map.keyframes());
  int made = 0;
  for (const KeyframeHandle k : all)
    for (std::size_t f = 0; f < kFeatures && !map.landmarks().full(); ++f)
      made += map.add_landmark(k, f).is_null() ? 0 : 1;
  EXPECT_EQ(made, capacity.landmarks);
  EXPECT_TRUE(map.add_landmark(all.back(), kFeatures - 1).is_null());
  // Forgetting makes room again.
  map.remove_keyframe(all[0]);
  EXPECT_FALSE(keyframe().is_null());
  EXPECT_FALSE(map.add_landmark(all.back(), kFeatures - 1).is_null());
}

TEST_F(MapTest, ALandmarkStartsAsItsFeature) {
  const KeyframeHandle k = keyframe(1);
  const LandmarkHandle h = map.add_landmark(k, 3);
  ASSERT_FALSE(h.is_null());
  const Landmark& l = map.landmarks()[h];
  const Feature& f = map.keyframes()[k].set.features[3];
  EXPECT_EQ(l.state, LandmarkState::kBearing);
  EXPECT_EQ(l.host, k);
  EXPECT_EQ(l.descriptor, map.keyframes()[k].set.descriptors[3]);
  EXPECT_EQ(l.patch.pixels[0], 3);
  EXPECT_EQ(l.host_level, f.level);
  EXPECT_EQ(l.observations.size(), 1U);
  EXPECT_EQ(l.inverse_depth, 0.0);
  EXPECT_EQ(l.found, 1U);
  Eigen::Vector3d bearing, right, down;
  const Camera& camera = rig.cameras[1].camera;
  ASSERT_TRUE(camera.unproject({f.u_px, f.v_px}, &bearing));
  ASSERT_TRUE(camera.unproject({f.u_px + 1e-4, f.v_px}, &right));
  ASSERT_TRUE(camera.unproject({f.u_px, f.v_px + 1e-4}, &down));
  EXPECT_LT((l.bearing - bearing).norm(), 1e-6);
  EXPECT_LT((l.d_bearing_d_pixel.col(0) - (right - bearing) / 1e-4).norm(), 1e-6);
  EXPECT_LT((l.d_bearing_d_pixel.col(1) - (down - bearing) / 1e-4).norm(), 1e-6);
}

TEST_F(MapTest, ARecycledLandmarkRemembersNothing) {
  const auto k = keyframes(3);
  const LandmarkHandle old = landmark(k, 0);
  map.landmarks()[old].failures = 3;
  map.landmarks()[old].through_vmp = true;
  map.landmarks()[old].found = 99;
  map.remove_landmark(old);
  const LandmarkHandle h = map.add_landmark(k[1], 5);
  EXPECT_EQ(h.index, old.index);
  const Landmark& l = map.landmarks()[h];
  EXPECT_EQ(l.failures, 0);
  EXPECT_FALSE(l.through_vmp);
  EXPECT_EQ(l.found, 1U);
  EXPECT_EQ(l.state, LandmarkState::kBearing);
  EXPECT_EQ(l.max_parallax_rad, 0.0);
  EXPECT_TRUE(l.parallax_keyframe.is_null());
  EXPECT_EQ(l.observations.size(), 1U);
  EXPECT_EQ(map.landmarks().get(old), nullptr);
}

TEST_F(MapTest, NoPatchNoLandmark) {
  const KeyframeHandle k = keyframe();
  map.keyframes()[k].set.features[2].level = FakeImage::kNoPatch;
  EXPECT_TRUE(map.add_landmark(k, 2).is_null());
  map.keyframes()[k].image.reset();
  EXPECT_TRUE(map.add_landmark(k, 3).is_null());
  EXPECT_EQ(map.landmarks().size(), 0U);
}

TEST_F(MapTest, RefusesSightingsThatCollide) {
  const auto k = keyframes(3);
  const LandmarkHandle a = landmark({k[0], k[1]}, 0), b = landmark({k[0]}, 1);
  EXPECT_FALSE(map.add_observation(a, sighting(map, k[1], 7)));  // sees it already
  EXPECT_FALSE(map.add_observation(b, sighting(map, k[1], 0)));  // the feature is a's
  Observation none = sighting(map, k[2], 0);
  none.feature = -1;
  EXPECT_FALSE(map.add_observation(a, none));
  none.feature = kFeatures;
  EXPECT_FALSE(map.add_observation(a, none));
  EXPECT_EQ(observers(a), (std::vector<std::uint64_t>{1, 2}));
  check(map, capacity);
}

TEST_F(MapTest, UnderTwoObserversALandmarkGoes) {
  const auto k = keyframes(3);
  const LandmarkHandle a = landmark({k[0], k[1], k[2]}, 0), b = landmark({k[0], k[1]}, 1);
  EXPECT_TRUE(map.remove_observation(a, k[2]));
  EXPECT_TRUE(map.remove_observation(a, k[2]));  // not there: nothing happens
  EXPECT_FALSE(map.remove_observation(a, k[1]));
  EXPECT_FALSE(map.landmarks().contains(a));
  EXPECT_TRUE(map.keyframes()[k[0]].landmarks[0].is_null());
  map.remove_keyframe(k[0]);
  EXPECT_FALSE(map.landmarks().contains(b));
  EXPECT_TRUE(map.keyframes()[k[1]].landmarks[1].is_null());
  check(map, capacity);
}

TEST_F(MapTest, TheLargestParallaxFollowsItsObservers) {
  const auto k = keyframes(5);
  const LandmarkHandle h = landmark(k, 0);
  while (map.landmarks()[h].observations.size() > 2) {
    const Landmark& l = map.landmarks()[h];
    const KeyframeHandle best = l.parallax_keyframe;
    const double was = l.max_parallax_rad;
    ASSERT_FALSE(best.is_null());
    ASSERT_TRUE(map.remove_observation(h, best));
    EXPECT_LT(l.max_parallax_rad, was);
    EXPECT_NE(l.parallax_keyframe, best);
    check(map, capacity);
  }
}

TEST_F(MapTest, ThinningKeepsHostBestPairAndNewest) {
  const auto k = keyframes(14);
  const LandmarkHandle h = landmark({k[2]}, 0);
  for (const std::size_t i : {0, 1, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13}) {
    EXPECT_TRUE(map.add_observation(h, sighting(map, k[i], 0)));
    const Landmark& l = map.landmarks()[h];
    EXPECT_LE(l.observations.size(), 6U);
    EXPECT_NE(Map::find_observation(l, k[2]), nullptr) << "host lost";
    EXPECT_NE(Map::find_observation(l, l.parallax_keyframe), nullptr) << "best pair lost";
    EXPECT_NE(Map::find_observation(l, k[i]), nullptr) << "newest lost";
    check(map, capacity);
  }
  EXPECT_EQ(map.landmarks()[h].host, k[2]);
  EXPECT_EQ(map.landmarks()[h].observations.size(), 6U);
}

// --- fuse

TEST_F(MapTest, FuseMovesWhatDoesNotCollide) {
  const auto k = keyframes(5);
  const LandmarkHandle into = landmark({k[0], k[2]}, 0);
  const LandmarkHandle from = landmark({k[1], k[2], k[4]}, 1);
  map.landmarks()[into].found = 5, map.landmarks()[into].visible = 6;
  map.landmarks()[from].found = 3, map.landmarks()[from].visible = 4;
  map.fuse(into, from);
  EXPECT_FALSE(map.landmarks().contains(from));
  EXPECT_EQ(observers(into), (std::vector<std::uint64_t>{1, 2, 3, 5}));
  // Keyframe 3 saw both: `into` keeps its own corner, the other is free.
  EXPECT_EQ(map.keyframes()[k[2]].landmarks[0], into);
  EXPECT_TRUE(map.keyframes()[k[2]].landmarks[1].is_null());
  EXPECT_EQ(map.keyframes()[k[1]].landmarks[1], into);
  // What was a host's exact sighting is a measurement now; the host's own still is none.
  EXPECT_GT(Map::find_observation(map.landmarks()[into], k[1])->sigma_px, 0.0F);
  EXPECT_EQ(Map::find_observation(map.landmarks()[into], k[0])->sigma_px, 0.0F);
  EXPECT_EQ(map.landmarks()[into].found, 8U);
  EXPECT_EQ(map.landmarks()[into].visible, 10U);
  EXPECT_EQ(map.landmarks()[into].last_seen_keyframe, 5U);
  check(map, capacity);
}

TEST_F(MapTest, FuseWithItselfOrTheDeadDoesNothing) {
  const auto k = keyframes(3);
  const LandmarkHandle a = landmark({k[0], k[1]}, 0), b = landmark({k[1], k[2]}, 1);
  map.fuse(a, a);
  EXPECT_EQ(observers(a).size(), 2U);
  map.remove_landmark(b);
  map.fuse(a, b);
  map.fuse(b, a);
  EXPECT_EQ(observers(a).size(), 2U);
  check(map, capacity);
}

TEST_F(MapTest, FuseStopsAtTheObservationLimit) {
  const auto k = keyframes(12);
  const LandmarkHandle a = landmark({k[0], k[2], k[4], k[6], k[8]}, 0);
  const LandmarkHandle b = landmark({k[1], k[3], k[5], k[7], k[9]}, 1);
  map.fuse(a, b);
  EXPECT_EQ(map.landmarks()[a].observations.size(), 6U);
  check(map, capacity);
}

// --- re-hosting

struct Geometry {
  Eigen::Vector4d point;
  SE3 anchor;
};
Geometry geometry(const Map& map, LandmarkHandle h) {
  return {map.world_point(map.landmarks()[h]), map.T_world_anchor(map.landmarks()[h])};
}
void expect_unmoved(const Geometry& a, const Geometry& b) {
  EXPECT_LT((a.point - b.point).norm(), 1e-9);
  EXPECT_LT((a.anchor.t - b.anchor.t).norm(), 1e-9);
  EXPECT_LT((a.anchor.rotation() - b.anchor.rotation()).norm(), 1e-9);
}

TEST_F(MapTest, AThinnedKeyframeKeepsWhatItsLandmarksNeed) {
  const auto k = keyframes(3);
  const LandmarkHandle high = landmark(k, 7), low = landmark({k[1], k[0]}, 2);
  const Keyframe before = map.keyframes()[k[0]];
  map.thin_keyframe(k[0]);
  const Keyframe& after = map.keyframes()[k[0]];
  check(map, capacity);
  ASSERT_EQ(after.landmarks, (std::vector{low, high}));
  EXPECT_EQ(Map::find_observation(map.landmarks()[high], k[0])->level, before.set.features[7].level);
  EXPECT_EQ(after.set.features.capacity() + after.set.descriptors.capacity() + after.bearings.capacity(), 0U);
  const Keyframe next = map.roomy_keyframe();
  EXPECT_GE(next.set.features.capacity(), before.set.features.size());
  EXPECT_GE(next.bearings.capacity(), before.bearings.size());
  EXPECT_EQ(after.image, nullptr);
  // Its slots are those of landmarks: a freed one can take a sighting again.
  map.remove_landmark(low);
  EXPECT_TRUE(map.keyframes()[k[0]].landmarks[0].is_null());
  EXPECT_TRUE(map.add_landmark(k[0], 0).is_null()) << "no pixels to cut a patch from";
  map.thin_keyframe(k[0]);  // once is enough
  EXPECT_EQ(map.keyframes()[k[0]].landmarks.size(), 2U);
}

TEST_F(MapTest, WorldPointLiesOnTheHostsRay) {
  const KeyframeHandle k = keyframe(1);
  const LandmarkHandle h = landmark({k}, 4, 0.25);
  const Eigen::Vector4d p = map.world_point(map.landmarks()[h]);
  const SE3 T_world_camera = map.keyframes()[k].T_world_body * rig.cameras[1].T_body_camera;
  EXPECT_LT((p.head<3>() / p[3] - T_world_camera * (4.0 * map.landmarks()[h].bearing)).norm(), 1e-12);
  // At infinity it is the ray's direction.
  map.landmarks()[h].inverse_depth = 0;
  const Eigen::Vector4d far = map.world_point(map.landmarks()[h]);
  EXPECT_EQ(far[3], 0.0);
  EXPECT_LT((far.head<3>() - T_world_camera.q * map.landmarks()[h].bearing).norm(), 1e-15);
}

TEST_F(MapTest, RehostMovesNothing) {
  const auto k = keyframes(4);
  std::size_t feature = 0;
  for (const double rho : {0.0, 1e-4, 0.2}) {
    const LandmarkHandle h = landmark(k, feature++, rho);
    const Geometry before = geometry(map, h);
    for (const int next : {2, 1, 3, 0, 2}) {
      map.rehost(h, k[static_cast<std::size_t>(next)]);
      EXPECT_EQ(map.landmarks()[h].host, k[static_cast<std::size_t>(next)]);
      expect_unmoved(before, geometry(map, h));
    }
    check(map, capacity);
  }
}

TEST_F(MapTest, RehostToAStrangerIsRefused) {
  const auto k = keyframes(3);
  const LandmarkHandle h = landmark({k[0], k[1]}, 0);
  map.rehost(h, k[2]);
  EXPECT_EQ(map.landmarks()[h].host, k[0]);
}

TEST_F(MapTest, ForgettingHostsMovesNothingAndKeepsTheLandmark) {
  const auto k = keyframes(8);
  const LandmarkHandle h = landmark({k[0], k[1], k[3], k[4], k[6], k[7]}, 0, 0.07);
  const Geometry before = geometry(map, h);
  const Eigen::Vector3d bearing = map.landmarks()[h].bearing;
  for (const std::size_t gone : {0, 1, 3, 4}) {
    EXPECT_EQ(map.landmarks()[h].host, k[gone]);
    map.remove_keyframe(k[gone]);
    ASSERT_TRUE(map.landmarks().contains(h));
    expect_unmoved(before, geometry(map, h));
    check(map, capacity);
  }
  EXPECT_EQ(map.landmarks()[h].bearing, bearing);
  EXPECT_EQ(map.landmarks()[h].inverse_depth, 0.07);
  EXPECT_EQ(map.landmarks()[h].host, k[6]);
  // The new host carries it: it moves with that keyframe, and only with it.
  const SE3 shift{so3_exp({0.1, 0, 0}), {1, 2, 3}};
  map.keyframes()[k[7]].T_world_body = shift * map.keyframes()[k[7]].T_world_body;
  expect_unmoved(before, geometry(map, h));
  map.keyframes()[k[6]].T_world_body = shift * map.keyframes()[k[6]].T_world_body;
  const Geometry after = geometry(map, h);
  EXPECT_LT(
      (after.point.head<3>() / after.point[3] - shift * (before.point.head<3>() / before.point[3])).norm(),
      1e-9);
}

// --- covisibility

TEST(MapCovisibility, CountsWhatBruteForceCounts) {
  const CapacityConfig capacity = small_capacity();
  Map map(capacity, two_camera_rig());
  Shaker shaker(&map, 21);
  int pairs = 0;
  for (int round = 0; round < 40; ++round) {
    for (int i = 0; i < 60; ++i) shaker.step();
    const auto all = alive(map.keyframes());
    for (const KeyframeHandle k : all) map.update_covisibility(k);
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> expected;
    map.landmarks().for_each([&](LandmarkHandle, const Landmark& l) {
      if (l.state == LandmarkState::kBearing) return;
      for (const Observation& a : l.observations)
        for (const Observation& b : l.observations)
          if (a.keyframe != b.keyframe) ++expected[{a.keyframe.index, b.keyframe.index}];
    });
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> counted;
    for (const KeyframeHandle k : all)
      for (const Covisible& c : map.keyframes()[k].covisible) counted[{k.index, c.keyframe.index}] = c.shared;
    ASSERT_EQ(counted, expected) << "round " << round;
    check(map, capacity);
    ASSERT_FALSE(testing::Test::HasFailure());
    pairs += static_cast<int>(counted.size());
  }
  EXPECT_GT(pairs, 500);
}

TEST_F(MapTest, CovisibilityOfOneUpdateReachesTheOthers) {
  const auto k = keyframes(3);
  landmark({k[0], k[1]}, 0);
  landmark({k[0], k[1]}, 1);
  landmark({k[0], k[2]}, 2);
  map.update_covisibility(k[0]);
  const auto& list = map.keyframes()[k[0]].covisible;
  ASSERT_EQ(list.size(), 2U);
  EXPECT_EQ(list[0].keyframe, k[1]);
  EXPECT_EQ(list[0].shared, 2);
  EXPECT_EQ(list[1].keyframe, k[2]);
  ASSERT_EQ(map.keyframes()[k[1]].covisible.size(), 1U);
  EXPECT_EQ(map.keyframes()[k[1]].covisible[0].shared, 2);
  check(map, capacity);
  map.remove_keyframe(k[1]);
  EXPECT_EQ(map.keyframes()[k[0]].covisible.size(), 1U);
  check(map, capacity);
}

// --- the way home

void expect_same_pose(const SE3& a, const SE3& b) {
  EXPECT_LT((a.t - b.t).norm(), 1e-9);
  EXPECT_LT((a.rotation() - b.rotation()).norm(), 1e-9);
}

TEST_F(MapTest, PoseOfChainsThroughRemovedKeyframes) {
  const auto k = keyframes(5);
  // 1 hangs on 2 by sharing most with it, though 3 is as near.
  landmark({k[0], k[1]}, 0);
  landmark({k[0], k[1], k[4]}, 1);
  for (const KeyframeHandle h : k) map.update_covisibility(h);
  const SE3 T_2_1 = map.keyframes()[k[1]].T_world_body.inverse() * map.keyframes()[k[0]].T_world_body;
  map.remove_keyframe(k[0]);
  SE3 T;
  // The parent moves (optimisation), the removed one with it.
  map.keyframes()[k[1]].T_world_body = random_pose(&random);
  ASSERT_TRUE(map.pose_of(1, &T));
  expect_same_pose(T, map.keyframes()[k[1]].T_world_body * T_2_1);
  const SE3 T_5_2 = map.keyframes()[k[4]].T_world_body.inverse() * map.keyframes()[k[1]].T_world_body;
  map.remove_keyframe(k[1]);
  map.keyframes()[k[4]].T_world_body = random_pose(&random);
  ASSERT_TRUE(map.pose_of(1, &T));
  expect_same_pose(T, map.keyframes()[k[4]].T_world_body * T_5_2 * T_2_1);
  ASSERT_TRUE(map.pose_of(2, &T));
  expect_same_pose(T, map.keyframes()[k[4]].T_world_body * T_5_2);
  // Recycling the slots changes nothing.
  keyframe();
  keyframe();
  ASSERT_TRUE(map.pose_of(1, &T));
  expect_same_pose(T, map.keyframes()[k[4]].T_world_body * T_5_2 * T_2_1);
  EXPECT_FALSE(map.pose_of(0, &T));
  EXPECT_FALSE(map.pose_of(99, &T));
}

TEST(MapSkeleton, WholeMapMovesWithItsForgottenKeyframes) {
  Map map(small_capacity(), two_camera_rig());
  Shaker shaker(&map, 31);
  std::map<std::uint64_t, SE3> poses;  // of every keyframe ever
  for (int i = 0; i < 4000; ++i) {
    shaker.step();
    map.keyframes().for_each([&](KeyframeHandle, const Keyframe& k) { poses[k.id] = k.T_world_body; });
  }
  ASSERT_GT(poses.size(), 100U);
  const SE3 shift{so3_exp({0.3, -0.2, 1.0}), {10, -20, 30}};
  for (const bool moved : {false, true}) {
    if (moved)
      map.keyframes().for_each([&](KeyframeHandle, Keyframe& k) { k.T_world_body = shift * k.T_world_body; });
    for (const auto& [id, pose] : poses) {
      SE3 T;
      ASSERT_TRUE(map.pose_of(id, &T)) << id;
      expect_same_pose(T, moved ? shift * pose : pose);
    }
  }
}

TEST_F(MapTest, TheLastKeyframeLeavesNoWayHome) {
  const KeyframeHandle a = keyframe(), b = keyframe();
  map.remove_keyframe(a);
  SE3 T;
  EXPECT_TRUE(map.pose_of(1, &T));
  map.remove_keyframe(b);
  EXPECT_FALSE(map.pose_of(1, &T));
  EXPECT_FALSE(map.pose_of(2, &T));
  map.remove_keyframe(b);  // gone already
  EXPECT_EQ(map.keyframes().size(), 0U);
}

TEST_F(MapTest, DiscardingOneMapLeavesTheOther) {
  std::vector<KeyframeHandle> first, second;
  for (int i = 0; i < 6; ++i) {
    Keyframe k = make_keyframe(rig, 0, random_pose(&random), kFeatures, &random);
    k.map_id = i % 2;
    (i % 2 == 0 ? first : second).push_back(map.add_keyframe(std::move(k)));
  }
  const LandmarkHandle a = landmark(first, 0), b = landmark(second, 0);
  map.discard_map(0);
  EXPECT_FALSE(map.landmarks().contains(a));
  EXPECT_TRUE(map.landmarks().contains(b));
  EXPECT_EQ(alive(map.keyframes()), second);
  SE3 T;
  EXPECT_FALSE(map.pose_of(1, &T));
  EXPECT_TRUE(map.pose_of(2, &T));
  check(map, capacity);
}

}  // namespace
}  // namespace farpoint::slam
