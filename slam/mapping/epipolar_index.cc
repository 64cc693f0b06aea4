// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/epipolar_index.h"

#include <algorithm>
#include <cmath>

#include "slam/image/descriptor_search.h"

namespace farpoint::slam {

namespace {

// A row of cells that a line passes costs more than points looked at in vain, since a vector takes up to
// sixteen of those at once: high cells make for few rows. (Of 16, 32, 48 and 64 px on KITTI.)
constexpr int kCellWidth_px = 32, kCellHeight_px = 48;

int cell_of(float coordinate_px, int cell_px, int cells) {
  return std::clamp(static_cast<int>(coordinate_px) / cell_px, 0, cells - 1);
}

struct Interval {
  float low = 0, high = 0;
};

// Where a band passes: |dv * along_u - du * along_v| <= half width, solved for du. The divisions are made
// once a band, not once a row of cells.
class Crossing {
 public:
  // whole_u: the extent of the whole band.
  Crossing(const Band& band, Interval whole_u)
      : whole_u_(whole_u),
        u_px_(band.u_px),
        v_px_(band.v_px),
        levelled_(std::abs(band.along_v) < kLevelled),
        reach_px_(band.half_width_px / std::abs(band.along_v)),
        slope_(band.along_u / band.along_v) {}

  // Between the heights `y`: the band's extent along u, ends included.
  [[nodiscard]] Interval between(Interval y) const {
    if (levelled_) return whole_u_;
    const float a = u_px_ + (y.low - v_px_) * slope_, b = u_px_ + (y.high - v_px_) * slope_;
    return {std::max(whole_u_.low, std::min(a, b) - reach_px_),
            std::min(whole_u_.high, std::max(a, b) + reach_px_)};
  }

 private:
  static constexpr float kLevelled = 1e-4F;

  Interval whole_u_;
  float u_px_, v_px_;
  bool levelled_;
  float reach_px_, slope_;
};

}  // namespace

void EpipolarIndex::build(const FeatureSet& set, std::span<const std::uint8_t> wanted, int width_px,
                          int height_px) {
  width_px_ = width_px;
  height_px_ = height_px;
  columns_ = width_px / kCellWidth_px + 1;
  rows_ = height_px / kCellHeight_px + 1;
  const auto cell = [this](const Feature& f) {
    const int at =
        cell_of(f.v_px, kCellHeight_px, rows_) * columns_ + cell_of(f.u_px, kCellWidth_px, columns_);
    return static_cast<std::size_t>(at);
  };
  // Counting sort: starts_[c + 1] counts, then begins, then ends cell c.
  starts_.assign(static_cast<std::size_t>(columns_ * rows_) + 2, 0);
  for (std::size_t i = 0; i < set.features.size(); ++i)
    if (wanted[i] != 0) ++starts_[cell(set.features[i]) + 2];
  for (std::size_t c = 2; c < starts_.size(); ++c) starts_[c] += starts_[c - 1];
  const std::size_t count = starts_.back();
  for (std::vector<float>* array : {&u_px_, &v_px_, &angle_rad_, &level_})
    array->resize(count + kRowAlignment);
  ranges_.resize(static_cast<std::size_t>(rows_) + 1);
  feature_.resize(count);
  found_.resize(count);
  distance_.resize(count);
  for (std::size_t i = 0; i < set.features.size(); ++i) {
    if (wanted[i] == 0) continue;
    const Feature& f = set.features[i];
    const std::size_t at = starts_[cell(f) + 1]++;
    u_px_[at] = f.u_px;
    v_px_[at] = f.v_px;
    angle_rad_[at] = f.angle_rad;
    level_[at] = f.level;
    feature_[at] = static_cast<std::uint32_t>(i);
  }
}

// Positions of all that lies in the band, in found_.
void EpipolarIndex::collect(const Band& band) {
  const float reach = band.half_width_px * (std::abs(band.along_u) + std::abs(band.along_v));
  const float end_u = band.u_px + band.length_px * band.along_u,
              end_v = band.v_px + band.length_px * band.along_v;
  const Interval u{std::min(band.u_px, end_u) - reach, std::max(band.u_px, end_u) + reach};
  const Interval v{std::min(band.v_px, end_v) - reach, std::max(band.v_px, end_v) + reach};
  found_count_ = 0;
  const auto width = static_cast<float>(width_px_), height = static_cast<float>(height_px_);
  // Written so that NaN fails.
  if (!(u.high >= 0.0F && u.low <= width && v.high >= 0.0F && v.low <= height)) return;
  const Crossing crossing(band, u);
  const int last_row = cell_of(std::min(v.high, height), kCellHeight_px, rows_);
  int range_count = 0;
  for (int row = cell_of(std::max(v.low, 0.0F), kCellHeight_px, rows_); row <= last_row; ++row) {
    const auto top = static_cast<float>(row * kCellHeight_px);
    const Interval x = crossing.between({std::max(v.low, top), std::min(v.high, top + kCellHeight_px)});
    if (!(x.high >= 0.0F && x.low <= width)) continue;
    const int first_cell = row * columns_ + cell_of(std::max(x.low, 0.0F), kCellWidth_px, columns_);
    const int last_cell = row * columns_ + cell_of(std::min(x.high, width), kCellWidth_px, columns_);
    const auto begin = static_cast<int>(starts_[static_cast<std::size_t>(first_cell)]),
               end = static_cast<int>(starts_[static_cast<std::size_t>(last_cell) + 1]);
    // Written in any case and kept where it is not empty: whether it is, no branch predictor can tell.
    ranges_[static_cast<std::size_t>(range_count)] = {begin, end};
    range_count += begin < end ? 1 : 0;
  }
  if (range_count == 0) return;
  const PointArrays points{u_px_.data(), v_px_.data(), angle_rad_.data(), level_.data()};
  found_count_ = active_kernels().select_in_band(points, ranges_.data(), range_count, band, found_.data());
}

EpipolarMatch EpipolarIndex::find(const FeatureSet& set, const EpipolarQuery& q) {
  const Eigen::Vector2d along = q.to_px - q.from_px;
  const double length = along.norm();
  Band band;
  band.u_px = static_cast<float>(q.from_px.x());
  band.v_px = static_cast<float>(q.from_px.y());
  if (length > 1e-6) {
    band.along_u = static_cast<float>(along.x() / length);
    band.along_v = static_cast<float>(along.y() / length);
  }
  band.length_px = static_cast<float>(length);
  band.half_width_px = q.half_width_px;
  band.min_level = static_cast<float>(q.min_level);
  band.max_level = static_cast<float>(q.max_level);
  band.angle_rad = q.angle_rad;
  band.max_turn_rad = q.max_turn_rad;
  collect(band);
  if (found_count_ == 0) return {};
  for (int i = 0; i < found_count_; ++i) {
    std::uint32_t& f = found_[static_cast<std::size_t>(i)];
    f = feature_[f];
  }
  active_kernels().hamming(q.descriptor->words.data(), set.descriptors.data()->words.data(), found_.data(),
                           found_count_, distance_.data());

  EpipolarMatch best{-1, q.max_hamming + 1};
  for (int i = 0; i < found_count_; ++i) {
    const int f = static_cast<int>(found_[static_cast<std::size_t>(i)]),
              d = distance_[static_cast<std::size_t>(i)];
    if (d < best.distance || (d == best.distance && best.feature >= 0 && f < best.feature)) best = {f, d};
  }
  if (best.feature < 0) return {};
  // Corners at the best one's place are no rivals of it: the same corner is often found on the next level
  // too.
  const Feature& place = set.features[static_cast<std::size_t>(best.feature)];
  for (int i = 0; i < found_count_; ++i) {
    const std::uint32_t f = found_[static_cast<std::size_t>(i)];
    const bool rival = static_cast<float>(best.distance) >
                       q.ratio * static_cast<float>(distance_[static_cast<std::size_t>(i)]);
    if (rival && !same_place(place, set.features[f])) return {};
  }
  return best;
}

}  // namespace farpoint::slam
