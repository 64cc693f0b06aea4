// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/epipolar_index.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "slam/image/descriptor_search.h"

namespace farpoint::slam {
namespace {

constexpr int kWidth = 640, kHeight = 200;

struct Scene {
  FeatureSet set;
  std::vector<std::uint8_t> wanted;
};

Scene made_scene(std::mt19937_64& rng, std::size_t features) {
  std::uniform_real_distribution<float> u(0, kWidth - 1), v(0, kHeight - 1), angle(-3.1415F, 3.1415F);
  Scene scene;
  for (std::size_t i = 0; i < features; ++i) {
    Feature f;
    f.u_px = u(rng);
    f.v_px = v(rng);
    f.angle_rad = angle(rng);
    f.level = static_cast<std::uint8_t>(rng() % 8);
    scene.set.features.push_back(f);
    Descriptor d;
    // Few different bits, so that distances collide and ties occur.
    for (std::uint64_t& word : d.words) word = rng() & rng() & rng();
    scene.set.descriptors.push_back(d);
    scene.wanted.push_back(rng() % 4 != 0 ? 1 : 0);
  }
  return scene;
}

// Every feature looked at, one after the other.
EpipolarMatch by_hand(const Scene& scene, const EpipolarQuery& q) {
  const Eigen::Vector2d segment = q.to_px - q.from_px;
  const double length = segment.norm();
  const Eigen::Vector2d along = length > 1e-6 ? Eigen::Vector2d(segment / length) : Eigen::Vector2d(1, 0);
  std::vector<int> near;
  for (std::size_t i = 0; i < scene.set.features.size(); ++i) {
    const Feature& f = scene.set.features[i];
    const Eigen::Vector2d d = Eigen::Vector2d(f.u_px, f.v_px) - q.from_px;
    const double t = d.dot(along), n = std::abs(d.x() * along.y() - d.y() * along.x());
    const double turn = std::abs(std::remainder(double{f.angle_rad} - double{q.angle_rad}, 6.283185307));
    if (scene.wanted[i] == 0 || f.level < q.min_level || f.level > q.max_level) continue;
    if (t < -q.half_width_px || t > length + q.half_width_px || n > q.half_width_px) continue;
    if (turn <= q.max_turn_rad) near.push_back(static_cast<int>(i));
  }
  const auto distance = [&](int i) {
    return hamming_distance(*q.descriptor, scene.set.descriptors[static_cast<std::size_t>(i)]);
  };
  EpipolarMatch best{-1, q.max_hamming + 1};
  for (const int i : near)
    if (distance(i) < best.distance) best = {i, distance(i)};
  if (best.feature < 0) return {};
  for (const int i : near) {
    const bool other_place = !same_place(scene.set.features[static_cast<std::size_t>(i)],
                                         scene.set.features[static_cast<std::size_t>(best.feature)]);
    if (other_place && static_cast<float>(best.distance) > q.ratio * static_cast<float>(distance(i)))
      return {};
  }
  return best;
}

TEST(EpipolarIndex, FindsWhatLookingAtEveryFeatureFinds) {
  std::mt19937_64 rng(5);
  EpipolarIndex index;
  int found = 0, none = 0;
  for (int round = 0; round < 10; ++round) {
    const Scene scene = made_scene(rng, round == 9 ? 0 : 1500);
    index.build(scene.set, scene.wanted, kWidth, kHeight);
    std::uniform_real_distribution<double> u(-300, kWidth + 300), v(-300, kHeight + 300);
    for (int trial = 0; trial < 400; ++trial) {
      Descriptor descriptor;
      for (std::uint64_t& word : descriptor.words) word = rng() & rng() & rng();
      EpipolarQuery q;
      q.from_px = {u(rng), v(rng)};
      q.to_px = {u(rng), v(rng)};
      if (trial % 10 == 1) q.to_px.y() = q.from_px.y();  // along a row
      if (trial % 10 == 2) q.to_px.x() = q.from_px.x();
      if (trial % 10 == 3) q.to_px = q.from_px;
      q.half_width_px = 3.0F + static_cast<float>(rng() % 10);
      q.min_level = static_cast<int>(rng() % 8) - 3;
      q.max_level = q.min_level + 6;
      q.max_turn_rad = 1.5F;
      q.descriptor = &descriptor;
      q.max_hamming = 60;
      q.ratio = trial % 2 == 0 ? 0.95F : 1.0F;
      const EpipolarMatch expected = by_hand(scene, q), actual = index.find(scene.set, q);
      ASSERT_EQ(actual.feature, expected.feature) << round << " " << trial;
      if (expected.feature >= 0) {
        EXPECT_EQ(actual.distance, expected.distance);
      }
      ++(expected.feature >= 0 ? found : none);
    }
  }
  EXPECT_GT(found, 300);
  EXPECT_GT(none, 300);
}

TEST(EpipolarIndex, EndlessLinesAreHarmless) {
  std::mt19937_64 rng(6);
  const Scene scene = made_scene(rng, 200);
  EpipolarIndex index;
  index.build(scene.set, scene.wanted, kWidth, kHeight);
  EpipolarQuery q;
  q.descriptor = &scene.set.descriptors[0];
  q.half_width_px = 5;
  q.max_level = 8;
  q.max_turn_rad = 4;
  for (const double far : {1e9, 1e30, 1e300, std::numeric_limits<double>::quiet_NaN()}) {
    q.from_px = {-far, -far};
    q.to_px = {far, far};
    (void)index.find(scene.set, q);  // ends, and the sanitizers have nothing to say
  }
}

}  // namespace
}  // namespace farpoint::slam
