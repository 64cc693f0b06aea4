// Mapping's half of the estimator: takes jobs from the exchange, works on the map, gives replies. Whoever
// calls step() is the only writer of the map.
#pragma once

#include <deque>
#include <functional>
#include <vector>

#include "slam/exchange.h"
#include "slam/map/growing_memory.h"
#include "slam/mapping/mapper.h"
#include "slam/tracking/tracker.h"

namespace farpoint::slam {

class MappingSide {
 public:
  MappingSide(const EstimatorConfig& config, const Rig& rig, Exchange* exchange);

  void listen(StageListener* listener) {
    listener_ = listener;
    mapper_.listen(listener);
  }

  // Works on the oldest job up to its next reply, which is made but not handed over yet. False where no job
  // waits.
  bool step();
  // Precondition: step() was true.
  [[nodiscard]] const MappingReply& reply() const { return *reply_; }
  void hand_over();

  // Takes in what tracking has recorded so far. step() does so too.
  void collect_recorded();

  [[nodiscard]] const Mapper& mapper() const { return mapper_; }
  // Empty without capacity.whole_trajectory.
  [[nodiscard]] const std::pmr::deque<KeptFrame>& recorded() const { return recorded_; }
  // Of the tracker that poses frames afterwards.
  [[nodiscard]] std::size_t tracker_bytes() const { return poser_.bytes(); }

 private:
  void pose_frames(const MappingJob& job);
  [[nodiscard]] bool pose_frame(const MappingJob& job, const Frame& frame, SE3* prior,
                                std::vector<RecordedFrame>* posed);
  void discard_map(std::int32_t map_id);

  const EstimatorConfig config_;
  Exchange& exchange_;
  Mapper mapper_;
  Tracker poser_;
  GrowingMemory recorded_memory_;
  // Grows to the run's end, hence never copied.
  std::pmr::deque<KeptFrame> recorded_{recorded_memory_.resource()};
  MappingReply* reply_ = nullptr;
  StageListener* listener_ = nullptr;
  std::uint64_t replies_ = 0;
  bool inserted_ = false;  // the keyframe of the present job is in the map, and waits for its refinement
};

}  // namespace farpoint::slam
