// SPDX-License-Identifier: Apache-2.0
#include "slam/tracking/sighting_counter.h"

#include "slam/tracking/work_space.h"

namespace farpoint::slam {

SightingCounter::SightingCounter(std::size_t landmarks) : counts_(landmarks) {
  reserve_touched(&counted_slots_, landmarks);
}

void SightingCounter::take(std::vector<SightingCount>* out) {
  out->clear();
  for (const std::uint32_t slot : counted_slots_) out->push_back(counts_[slot]);
  clear();
}

void SightingCounter::clear() {
  for (const std::uint32_t slot : counted_slots_) counts_[slot] = {};
  counted_slots_.clear();
}

std::size_t SightingCounter::bytes() const {
  return capacity_bytes(counts_) + capacity_bytes(counted_slots_);
}

}  // namespace farpoint::slam
