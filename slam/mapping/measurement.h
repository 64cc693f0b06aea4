// What a keyframe measures of a landmark: the aligned place of its patch near a corner.
#pragma once

#include "slam/config.h"
#include "slam/map/map.h"
#include "slam/map/predict.h"

namespace farpoint::slam {

// Aligns the landmark's patch with the keyframe's image, from corner `feature`. False where the keyframe has
// no pixels any more or the patch is not there; *out then says nothing.
[[nodiscard]] bool measure_observation(const EstimatorConfig& config, const Map& map,
                                       const Landmark& landmark, KeyframeHandle handle, std::size_t feature,
                                       Observation* out);

// What predict() needs of a landmark.
[[nodiscard]] PredictionInput prediction_input(const Map& map, const Landmark& landmark);

}  // namespace farpoint::slam
