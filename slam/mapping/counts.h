// Counts of what mapping did, for status and reports.
#pragma once

#include <cstdint>

namespace farpoint::slam {

struct MappingCounts {
  std::uint64_t keyframes_made = 0, keyframes_culled = 0;
  // Because the map was full. The keyframes are among the culled ones.
  std::uint64_t keyframes_forgotten = 0, landmarks_forgotten = 0;
  std::uint64_t landmarks_made = 0, landmarks_culled = 0, landmarks_fused = 0;
  std::uint64_t vmp_made = 0, vmp_attached = 0, vmp_merged = 0, vmp_promoted = 0, vmp_rejected = 0,
                vmp_evicted = 0;
  std::uint64_t local_ba = 0;
  std::uint32_t vmp_alive = 0;
  bool calibration_contradicted = false;  // now: by the images, Calibrator::contradicts_given()
};

}  // namespace farpoint::slam
