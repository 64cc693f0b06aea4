// SPDX-License-Identifier: Apache-2.0
// The features of one keyframe laid out for searches along epipolar lines.
//
// Mapping searches thousands of lines through every neighbour of a new keyframe: what a line passes is found
// cell by cell, each cell once, and the cells of one row lie one behind the other in memory.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "slam/image/feature.h"
#include "slam/image/kernels.h"

namespace farpoint::slam {

struct EpipolarQuery {
  Eigen::Vector2d from_px = Eigen::Vector2d::Zero(), to_px = Eigen::Vector2d::Zero();  // the segment
  float half_width_px = 0;  // to each side of it, and beyond each end
  int min_level = 0, max_level = 0;
  float angle_rad = 0, max_turn_rad = 0;  // orientation, and how far from it a match may be
  const Descriptor* descriptor = nullptr;
  int max_hamming = 64;
  float ratio = 1.0F;  // the best must be at most so much of the second best (of another place)
};

struct EpipolarMatch {
  int feature = -1;  // -1: none
  int distance = 0;  // Hamming
};

class EpipolarIndex {
 public:
  // Takes the features whose `wanted` is not 0. Keeps its memory from call to call.
  void build(const FeatureSet& set, std::span<const std::uint8_t> wanted, int width_px, int height_px);

  // The feature near the segment whose descriptor is nearest; of equals the one with the lowest index. `set`
  // as in build().
  [[nodiscard]] EpipolarMatch find(const FeatureSet& set, const EpipolarQuery& query);

 private:
  void collect(const Band& band);

  int width_px_ = 0, height_px_ = 0;
  int columns_ = 0, rows_ = 0;
  std::vector<std::uint32_t> starts_;                   // first position of each cell, and the end
  std::vector<float> u_px_, v_px_, angle_rad_, level_;  // by position
  std::vector<std::uint32_t> feature_;                  // by position: index in the set
  // Work space of find().
  std::vector<PositionRange> ranges_;  // of the cells that the band passes, row by row
  std::vector<std::uint32_t> found_;
  std::vector<std::uint16_t> distance_;
  int found_count_ = 0;
};

}  // namespace farpoint::slam
