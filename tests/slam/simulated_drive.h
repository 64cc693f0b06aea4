// SPDX-License-Identifier: Apache-2.0
// A simulated drive at the level of features: frames for the tests of the facade and its halves.
#pragma once

#include "slam/front_end.h"
#include "tests/scenes/simulator.h"

namespace farpoint::slam {

class SimulatedDrive {
 public:
  SimulatedDrive() : scene_(small_scene()), simulator_(scene_, 3) {}

  [[nodiscard]] EstimatorConfig config() const { return scene_.estimator(LandmarkMode::kVmp); }
  [[nodiscard]] Rig rig() const { return scene_.believed_rig(); }
  // The next frame of the drive.
  [[nodiscard]] FeatureInput next() { return simulator_.next().input; }
  // The same with descriptors that match nothing.
  [[nodiscard]] FeatureInput next_unknown() {
    FeatureInput input = next();
    for (Descriptor& d : input.features.descriptors)
      for (auto& word : d.words) word = random_ = random_ * 6364136223846793005ULL + 1442695040888963407ULL;
    return input;
  }
  // A frame without features.
  [[nodiscard]] FeatureInput next_blind() {
    FeatureInput input = next();
    input.features = {};
    return input;
  }

 private:
  [[nodiscard]] static sim::Scene small_scene() {
    sim::Scene scene = sim::make_scene("straight");
    scene.features = 500;
    return scene;
  }

  sim::Scene scene_;
  sim::Simulator simulator_;
  std::uint64_t random_ = 1;
};

}  // namespace farpoint::slam
