// SPDX-License-Identifier: Apache-2.0
// Search of a whole image for the feature whose descriptor fits best: what relocalisation does a thousand
// times a frame. Tracking's thread; makes no heap call after reserve().
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "slam/image/feature.h"

namespace farpoint::slam {

// Compares one word of 64 bits of every feature, and all four words only where that word is near: where it
// differs in at most a third of `max_hamming` bits. With 48 of 256, that misses 2 % of the matches that
// differ in 44 bits, 5 % of those in 48, and fewer than 1 in 500 of those in 36 or less. Of unrelated random
// words, 1 in 26,000 is that near; words of images are more often.
class DescriptorScan {
 public:
  void reserve(std::size_t features);
  // The image that is searched from now on; it must stay as it is.
  void set(const FeatureSet& features);

  // As find_descriptor() with a window over the whole image and all levels: index of the nearest descriptor,
  // or -1 where it differs in more than `max_hamming` bits, or in more than `ratio` of the second best's.
  [[nodiscard]] int find(const Descriptor& descriptor, int max_hamming, float ratio);

  [[nodiscard]] std::size_t bytes() const;

 private:
  // Bits in which the descriptor differs from each of these features, in distances_.
  void measure(const Descriptor& descriptor, std::span<const std::uint32_t> indices);
  bool stands_out(const Descriptor& descriptor, int best, float least_distance);

  const FeatureSet* features_ = nullptr;
  std::vector<std::uint64_t> first_words_;  // one a feature, and room behind the last
  std::vector<std::uint32_t> near_, all_;   // indices of features
  std::vector<std::uint16_t> distances_;    // bits
};

}  // namespace farpoint::slam
