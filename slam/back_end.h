// SPDX-License-Identifier: Apache-2.0
// Mapping's half of the estimator: takes jobs, works on the map, makes replies. The thread that calls step()
// is the only writer of the map.
#pragma once

#include <deque>
#include <functional>
#include <vector>

#include "slam/fusion/wheel_fusion.h"
#include "slam/fusion/wheel_motion_model.h"
#include "slam/map/growing_memory.h"
#include "slam/mapping/mapper.h"
#include "slam/mapping_rings.h"
#include "slam/tracking/tracker.h"

namespace farpoint::slam {

class BackEnd {
 public:
  BackEnd(const EstimatorConfig& config, const Rig& rig, MappingRings* rings,
          const VehiclePoints& points = {});

  void listen(StageListener* listener) {
    listener_ = listener;
    mapper_.listen(listener);
  }

  // Works on the oldest job up to its next reply, which hand_over() then sends. False where no job waits.
  bool step();
  // Precondition: step() was true.
  [[nodiscard]] const MappingReply& reply() const { return *reply_; }
  void hand_over();

  // Takes the poses that tracking has recorded so far. step() does so too.
  void collect_recorded();
  // Gives a map another origin, other axes or another unit (Mapper::transform_map). Between two steps.
  void transform_map(std::int32_t map_id, const Sim3& S_new_old) { mapper_.transform_map(map_id, S_new_old); }

  [[nodiscard]] const Mapper& mapper() const { return mapper_; }
  // From the map's body to the calibration's.
  [[nodiscard]] const Eigen::Vector3d& body_point_m() const { return points_.body_m; }
  // Empty without capacity.whole_trajectory.
  [[nodiscard]] const std::pmr::deque<KeptFrame>& recorded() const { return recorded_; }
  // Work space of the tracker that poses frames from before the map.
  [[nodiscard]] std::size_t tracker_bytes() const { return poser_.bytes(); }

 private:
  void pose_frames(const MappingJob& job);
  [[nodiscard]] bool pose_frame(const MappingJob& job, const Frame& frame, SE3* prior,
                                std::vector<RecordedFrame>* posed);
  [[nodiscard]] bool pose_in_view(const LocalView& view, std::uint64_t keyframe_id, SE3* T_view_body) const;
  void discard_map(std::int32_t map_id);

  const EstimatorConfig config_;
  const VehiclePoints points_;
  MappingRings& rings_;
  WheelFusion wheels_;
  Mapper mapper_;
  Tracker poser_;
  GrowingMemory recorded_memory_;
  // Grows to the run's end; a deque never copies what it holds.
  std::pmr::deque<KeptFrame> recorded_{recorded_memory_.resource()};
  MappingReply* reply_ = nullptr;
  StageListener* listener_ = nullptr;
  std::uint64_t replies_ = 0;
  bool inserted_ = false;  // the present job's keyframe is in the map and not refined yet
};

}  // namespace farpoint::slam
