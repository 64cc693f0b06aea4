// SPDX-License-Identifier: Apache-2.0
#include "slam/tracking/repeated_features.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "slam/tracking/work_space.h"

namespace farpoint::slam {

namespace {

constexpr std::uint64_t kPrime = 0x9E3779B97F4A7C15ULL;  // odd, bits well mixed: 2^64 over the golden ratio

std::uint64_t mixed(std::uint64_t hash, std::uint64_t word) {
  hash = (hash ^ word) * kPrime;
  return hash ^ (hash >> 32);
}

std::uint64_t key_of(const Feature& feature, const Descriptor& descriptor) {
  const auto place = static_cast<std::uint64_t>(std::bit_cast<std::uint32_t>(feature.u_px)) << 32 |
                     std::bit_cast<std::uint32_t>(feature.v_px);
  std::uint64_t hash = mixed(kPrime + feature.level, place);
  static_assert(sizeof(descriptor) % sizeof(std::uint64_t) == 0);
  for (std::size_t i = 0; i < sizeof(descriptor); i += sizeof(std::uint64_t)) {
    std::uint64_t word = 0;
    std::memcpy(&word, reinterpret_cast<const std::uint8_t*>(&descriptor) + i, sizeof(word));
    hash = mixed(hash, word);
  }
  return std::max<std::uint64_t>(hash, 1);
}

// Where the key is, or the free slot for it. The table is never full.
std::size_t slot_of(const std::vector<std::uint64_t>& table, std::uint64_t key) {
  const std::size_t mask = table.size() - 1;
  std::size_t slot = static_cast<std::size_t>(key) & mask;
  while (table[slot] != 0 && table[slot] != key) slot = (slot + 1) & mask;
  return slot;
}

}  // namespace

RepeatedFeatures::RepeatedFeatures(std::size_t features)
    : before_(std::bit_ceil(2 * features + 2)), now_(before_.size()) {}

std::size_t RepeatedFeatures::bytes() const {
  return capacity_bytes(before_) + capacity_bytes(now_);
}

double RepeatedFeatures::add(const FeatureSet& set) {
  std::swap(before_, now_);
  std::fill(now_.begin(), now_.end(), 0);
  const std::size_t count = std::min(set.features.size(), now_.size() / 2);
  std::size_t repeated = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint64_t key = key_of(set.features[i], set.descriptors[i]);
    repeated += before_[slot_of(before_, key)] == key ? 1 : 0;
    now_[slot_of(now_, key)] = key;
  }
  return count > 0 ? static_cast<double>(repeated) / static_cast<double>(count) : 0.0;
}

}  // namespace farpoint::slam
