// SPDX-License-Identifier: Apache-2.0
// FARPOINT_MAP on its way from mapping, the only thread that may read the map, to the output.
#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

#include "daemon/config/config.h"
#include "daemon/output/publisher.h"
#include "slam/frame_result.h"
#include "slam/inspection.h"
#include "slam/spsc_ring.h"

namespace farpoint::daemon {

// Mapping encodes what a view was made of, at the configured rate. The output publishes it with the first
// frame that has taken that view: the published map is the one tracked against, and a repeated run publishes
// it at the same frame.
class MapBoard {
 public:
  explicit MapBoard(const Config& config);

  // Mapping's thread.
  void note(const slam::Inspection& inspection, const slam::MappingNote& note);
  // Before the first frame: as FrameReporter::set_lever().
  void set_lever(const Eigen::Vector3d& lever_m) { lever_m_ = lever_m; }
  // Any thread. scale.assumed holds for the map of this number alone.
  void assume_scale_of(std::int32_t map_id) { assumed_map_.store(map_id, std::memory_order_relaxed); }
  // The output's thread.
  void publish_known(std::uint64_t replies_taken, Publisher* publisher);

 private:
  struct Sheet {
    std::uint64_t reply = 0;
    std::int64_t utime = 0;
    std::vector<std::uint8_t> bytes;  // an encoded map_t
  };
  // More than the output could be behind by: a view is made only after the one before was taken.
  static constexpr std::size_t kSheets = 8;

  const double rate_hz_, assumed_scale_;
  const int points_;
  std::atomic<std::int32_t> assumed_map_{-1};  // -1: every map
  Eigen::Vector3d lever_m_ = Eigen::Vector3d::Zero();
  std::int64_t next_utime_;
  slam::SpscRing<Sheet> sheets_;
};

}  // namespace farpoint::daemon
