// SPDX-License-Identifier: Apache-2.0
// Search for the feature near a pixel whose descriptor fits best. Tracking's thread and mapping's; makes no
// heap call.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "slam/image/feature.h"
#include "slam/image/feature_grid.h"
#include "slam/image/kernels.h"

namespace farpoint::slam {

// Whether two corners lie so close that they show the same point.
[[nodiscard]] inline bool same_place(const Feature& a, const Feature& b) {
  constexpr float kSamePlacePx = 3.0F;
  return std::abs(a.u_px - b.u_px) < kSamePlacePx && std::abs(a.v_px - b.v_px) < kSamePlacePx;
}

// What is searched for, and where: a square window of level-0 pixels, and a range of pyramid levels.
struct DescriptorQuery {
  Descriptor descriptor;
  float u_px = 0, v_px = 0, radius_px = 0;
  int min_level = 0, max_level = 0;
  int max_hamming = 64;  // largest accepted distance, bits
  float ratio = 0.9F;    // largest accepted distance as a share of the second best's; 1: no such test
};

// Returns the index of the nearest descriptor among the features for which usable(index) holds, or -1. The
// ratio test leaves out corners at the best one's place: the extractor often finds one corner on two levels.
template <typename Usable>
[[nodiscard]] int find_descriptor(const FeatureSet& set, const FeatureGrid& grid, const DescriptorQuery& q,
                                  Usable&& usable, int* distance = nullptr) {
  constexpr int kNone = 257;
  int best = -1, best_distance = kNone, second_distance = kNone;
  bool uncertain = false;  // second_distance was taken around another best one
  const auto visit = [&](auto&& consider) {
    std::array<std::uint32_t, 64> indices;
    std::array<std::uint16_t, 64> distances;
    std::size_t count = 0;
    const auto flush = [&] {
      active_kernels().hamming(q.descriptor.words.data(), set.descriptors.front().words.data(),
                               indices.data(), static_cast<int>(count), distances.data());
      for (std::size_t k = 0; k < count; ++k) consider(std::size_t{indices[k]}, int{distances[k]});
      count = 0;
    };
    grid.visit_near(set.features, q.u_px, q.v_px, q.radius_px, q.min_level, q.max_level, [&](std::size_t i) {
      if (!usable(i)) return;
      indices[count++] = static_cast<std::uint32_t>(i);
      if (count == indices.size()) flush();
    });
    if (count > 0) flush();
  };
  const auto at_best = [&](std::size_t i) {
    return best >= 0 && same_place(set.features[static_cast<std::size_t>(best)], set.features[i]);
  };
  visit([&](std::size_t i, int d) {
    if (d < best_distance) {
      uncertain = at_best(i);
      if (!uncertain) second_distance = best_distance;
      best_distance = d;
      best = static_cast<int>(i);
    } else if (d < second_distance && !at_best(i)) {
      second_distance = d;
    }
  });
  if (best < 0 || best_distance > q.max_hamming) return -1;
  if (uncertain) {
    second_distance = kNone;
    visit([&](std::size_t i, int d) {
      if (d < second_distance && !at_best(i)) second_distance = d;
    });
  }
  if (static_cast<float>(best_distance) > q.ratio * static_cast<float>(second_distance)) return -1;
  if (distance != nullptr) *distance = best_distance;
  return best;
}

}  // namespace farpoint::slam
