// SPDX-License-Identifier: Apache-2.0
#include "slam/image/descriptor_scan.h"

#include <algorithm>
#include <numeric>

#include "slam/image/descriptor_search.h"
#include "slam/image/kernels.h"

namespace farpoint::slam {

namespace {

constexpr std::size_t kReadBehind = 16;  // words, see Kernels::near_words

}  // namespace

void DescriptorScan::reserve(std::size_t features) {
  first_words_.resize(features + kReadBehind);
  near_.resize(features);
  distances_.resize(features);
  all_.resize(features);
  std::iota(all_.begin(), all_.end(), 0U);
}

void DescriptorScan::set(const FeatureSet& features) {
  features_ = &features;
  if (features.descriptors.size() > near_.size()) reserve(features.descriptors.size());
  for (std::size_t i = 0; i < features.descriptors.size(); ++i)
    first_words_[i] = features.descriptors[i].words.front();
}

int DescriptorScan::find(const Descriptor& descriptor, int max_hamming, float ratio) {
  const int word_bits = max_hamming / 3;
  const int near =
      active_kernels().near_words(descriptor.words.front(), first_words_.data(),
                                  static_cast<int>(features_->descriptors.size()), word_bits, near_.data());
  measure(descriptor, {near_.data(), static_cast<std::size_t>(near)});
  int best = -1, best_distance = max_hamming + 1;
  for (std::size_t k = 0; k < static_cast<std::size_t>(near); ++k)
    if (distances_[k] < best_distance) {
      best_distance = distances_[k];
      best = static_cast<int>(near_[k]);
    }
  return best >= 0 && stands_out(descriptor, best, static_cast<float>(best_distance) / ratio) ? best : -1;
}

void DescriptorScan::measure(const Descriptor& descriptor, std::span<const std::uint32_t> indices) {
  if (!indices.empty())
    active_kernels().hamming(descriptor.words.data(), features_->descriptors.front().words.data(),
                             indices.data(), static_cast<int>(indices.size()), distances_.data());
}

// No other corner is nearer than this; a corner at the same place is no rival.
bool DescriptorScan::stands_out(const Descriptor& descriptor, int best, float least_distance) {
  constexpr std::size_t kAtOnce = 64;
  const std::vector<Feature>& features = features_->features;
  const Feature& place = features[static_cast<std::size_t>(best)];
  for (std::size_t first = 0; first < features.size(); first += kAtOnce) {
    const std::size_t count = std::min(kAtOnce, features.size() - first);
    measure(descriptor, {all_.data() + first, count});
    for (std::size_t k = 0; k < count; ++k)
      if (static_cast<float>(distances_[k]) < least_distance && !same_place(place, features[first + k]))
        return false;
  }
  return true;
}

std::size_t DescriptorScan::bytes() const {
  return first_words_.capacity() * sizeof(std::uint64_t) +
         (near_.capacity() + all_.capacity()) * sizeof(std::uint32_t) +
         distances_.capacity() * sizeof(std::uint16_t);
}

}  // namespace farpoint::slam
