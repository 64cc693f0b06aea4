// SPDX-License-Identifier: Apache-2.0
// Builds the local views that tracking works with.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "slam/config.h"
#include "slam/map/local_view.h"
#include "slam/map/map.h"
#include "slam/map/shared_pool.h"
#include "slam/mapping/measurement.h"

namespace farpoint::slam {

// Copies the landmarks around a keyframe into a view from a pool that is allocated at start.
class ViewBuilder {
 public:
  // Views in use at once: tracking's own, a quick and a full one in the replies, one that frames are posed
  // against, and the one being built.
  static constexpr std::size_t kViews = 5;
  // Keyframes of a view: the reference, kNeighbours of it, and kSecondNeighbours of each of the first
  // kSecondRing members.
  static constexpr std::size_t kNeighbours = 30, kSecondRing = 10, kSecondNeighbours = 5;
  static constexpr std::size_t kMaxKeyframes = 1 + kNeighbours + kSecondRing * kSecondNeighbours;

  // Both must outlive this.
  ViewBuilder(const EstimatorConfig& config, const Map* map);

  // A view around `reference`, at most capacity.view_landmarks large. Null where all views are in use.
  // Precondition: the keyframe is alive.
  [[nodiscard]] std::shared_ptr<const LocalView> build(KeyframeHandle reference,
                                                       const MapJudgement& judgement);

  // Memory of all views.
  [[nodiscard]] std::size_t bytes() const;

 private:
  void begin(KeyframeHandle reference, const MapJudgement& judgement, LocalView* view);
  void select_keyframes(KeyframeHandle reference);
  void add_keyframe(KeyframeHandle keyframe);
  void add_landmarks(KeyframeHandle keyframe, bool is_reference, LocalView* view);
  void add_landmarks_of(const KeyframeView& keyframe_view, bool is_reference, LocalView* view);
  [[nodiscard]] ViewLandmark make_landmark(LandmarkHandle handle, const Landmark& landmark);
  // Distance and nearness of a landmark that the reference sees.
  void measure_in_reference(ViewLandmark* v, LocalView* view);
  [[nodiscard]] bool guides_tracking(const Landmark& landmark) const;
  [[nodiscard]] double median_depth();

  const EstimatorConfig& config_;
  const Map& map_;
  SharedPool<LocalView> views_;
  std::uint64_t sequence_ = 0;  // of the last view
  // Work space of one view.
  AnchorMemory anchors_;
  SE3 T_reference_world_;  // the camera of the reference whose landmarks are added
  std::vector<KeyframeHandle> keyframes_;
  std::vector<std::uint8_t> is_member_, is_taken_;  // by keyframe slot, by landmark slot
  std::vector<double> depths_;                      // of the reference's landmarks, map units
};

}  // namespace farpoint::slam
