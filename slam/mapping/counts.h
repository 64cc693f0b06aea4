// SPDX-License-Identifier: Apache-2.0
// Counts of what mapping has done since the start, for status and reports.
#pragma once

#include <cstdint>

namespace farpoint::slam {

struct MappingCounts {
  std::uint64_t keyframes_made = 0;
  std::uint64_t keyframes_culled = 0;  // removed for any reason except a discarded map
  // Removed because the map was full. The keyframes are among keyframes_culled.
  std::uint64_t keyframes_forgotten = 0, landmarks_forgotten = 0;
  std::uint64_t landmarks_made = 0, landmarks_culled = 0;
  std::uint64_t landmarks_fused = 0;  // duplicates removed
  // Virtual map points: made from a pair, given a sighting, fused, turned into landmarks, given up, removed.
  std::uint64_t vmp_made = 0, vmp_attached = 0, vmp_merged = 0, vmp_promoted = 0, vmp_rejected = 0,
                vmp_evicted = 0;
  std::uint64_t local_ba = 0;             // adjustments solved
  std::uint32_t vmp_alive = 0;            // at present
  bool calibration_contradicted = false;  // at present: Calibrator::contradicts_given()
};

}  // namespace farpoint::slam
