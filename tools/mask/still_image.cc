// SPDX-License-Identifier: Apache-2.0
#include "tools/mask/still_image.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "tools/mask/grid.h"

namespace farpoint::tools {
namespace {

// Columns of averaged images: averaging takes the noise of single pixels away, and edges are still found to
// a third of a percent of the image's width.
constexpr double kColumns = 320;
// Gradient, grey levels a pixel, that noise of a few grey levels does not reach after averaging.
constexpr float kTextured = 3.0F;
// A gradient that changed by this part of its length belongs to something else now.
constexpr float kChanged = 0.7F;
// Share of the textured pixels that must have changed for the image to have moved. Passing cars change less
// of it while the vehicle stands; the bonnet may take three quarters.
constexpr double kMovedShare = 0.25;
// Mean squared gradient of texture; below it a place is flat, neither still nor passing.
constexpr double kFlatPower = 2.0;
// Of the gradients' power, what agrees. Places that show a bonnet and little else have nearly all; its edge,
// where the scene passes too, has half. Lane markings, clouds and the far end of a straight road reach 0.8 in
// single pixels only, which is why half of a still part must be beyond.
constexpr double kStillShare = 0.5, kCertainShare = 0.8, kCertainPart = 0.5;
// Averaged pixels around one that are judged with it, and gaps that are closed, to either side.
constexpr int kNeighbourhood = 2, kClosing = 2;
// Most of a flat part's border that may be passing scene, for it to count as enclosed by still parts.
constexpr double kMostSceneAround = 0.1;
// A flat part of more than this many times the size of all still parts is not enclosed by them.
constexpr std::size_t kMostFilled = 4;
// Smaller still parts, of the image, are specks.
constexpr double kLeastPart = 0.002;

enum class Kind : std::uint8_t { kFlat, kStill, kPassing };

Bits cells_of(const Grid<Kind>& kinds, Kind kind) {
  Bits bits(kinds.columns, kinds.rows);
  std::transform(kinds.cells.begin(), kinds.cells.end(), bits.cells.begin(),
                 [kind](Kind k) { return k == kind ? std::uint8_t{1} : std::uint8_t{0}; });
  return bits;
}

// Still places outside `kept` pass.
void keep(const Bits& kept, Grid<Kind>* kinds) {
  for (std::size_t i = 0; i < kinds->cells.size(); ++i)
    if (kinds->cells[i] == Kind::kStill && kept.cells[i] == 0) kinds->cells[i] = Kind::kPassing;
}

// Flat parts between still ones, and the image's edge, become still. A part larger than all still ones is
// none that they enclose: it is the sky above a horizon that keeps its height.
void fill_enclosed(Grid<Kind>* kinds) {
  const auto all_still =
      static_cast<std::size_t>(std::count(kinds->cells.begin(), kinds->cells.end(), Kind::kStill));
  for_each_component(cells_of(*kinds, Kind::kFlat), [kinds, all_still](const std::vector<std::size_t>& part) {
    int still = 0, passing = 0;
    for (const std::size_t cell : part) {
      const int x = static_cast<int>(cell % static_cast<std::size_t>(kinds->columns)),
                y = static_cast<int>(cell / static_cast<std::size_t>(kinds->columns));
      const int around[4][2] = {{x - 1, y}, {x + 1, y}, {x, y - 1}, {x, y + 1}};
      for (const auto& [u, v] : around) {
        if (!kinds->holds(u, v)) continue;
        still += kinds->at(u, v) == Kind::kStill ? 1 : 0;
        passing += kinds->at(u, v) == Kind::kPassing ? 1 : 0;
      }
    }
    if (still == 0 || part.size() > kMostFilled * all_still || passing > kMostSceneAround * (still + passing))
      return;
    for (const std::size_t cell : part) kinds->cells[cell] = Kind::kStill;
  });
}

// Keeps the parts that are large enough and of which enough is certain.
Bits sound_parts(const Bits& still, const Bits& certain) {
  Bits kept(still.columns, still.rows);
  const double least = kLeastPart * static_cast<double>(still.cells.size());
  for_each_component(still, [&](const std::vector<std::size_t>& part) {
    const auto sure = static_cast<double>(
        std::count_if(part.begin(), part.end(), [&](std::size_t cell) { return certain.cells[cell] != 0; }));
    const auto size = static_cast<double>(part.size());
    if (size < least || sure < kCertainPart * size) return;
    for (const std::size_t cell : part) kept.cells[cell] = 1;
  });
  return kept;
}

}  // namespace

StillImage::StillImage(int width_px, int height_px)
    : width_px_(width_px),
      height_px_(height_px),
      factor_(std::max(1, static_cast<int>(std::lround(width_px / kColumns)))),
      columns_(std::max(1, width_px / factor_)),
      rows_(std::max(1, height_px / factor_)) {
  const std::size_t cells = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
  averaged_.assign(cells, 0);
  for (GradientImage* g : {&here_, &last_}) {
    g->dx.assign(cells, 0);
    g->dy.assign(cells, 0);
  }
  for (std::vector<double>* sum : {&sum_dx_, &sum_dy_, &power_}) sum->assign(cells, 0);
}

void StillImage::average(const ipc::GreyImage& image) {
  const auto width = static_cast<std::size_t>(width_px_), factor = static_cast<std::size_t>(factor_);
  std::fill(averaged_.begin(), averaged_.end(), 0.0F);
  const float part = 1.0F / static_cast<float>(factor_ * factor_);
  for (std::size_t y = 0; y < factor * static_cast<std::size_t>(rows_); ++y) {
    const std::uint8_t* row = image.data() + y * width;
    float* to = averaged_.data() + y / factor * static_cast<std::size_t>(columns_);
    for (std::size_t x = 0; x < static_cast<std::size_t>(columns_); ++x) {
      int sum = 0;
      for (std::size_t k = 0; k < factor; ++k) sum += row[x * factor + k];
      to[x] += part * static_cast<float>(sum);
    }
  }
}

void StillImage::differentiate() {
  const auto at = [this](int x, int y) {
    return averaged_[static_cast<std::size_t>(y) * static_cast<std::size_t>(columns_) +
                     static_cast<std::size_t>(x)];
  };
  std::size_t i = 0;
  for (int y = 0; y < rows_; ++y) {
    const int above = std::max(0, y - 1), below = std::min(rows_ - 1, y + 1);
    for (int x = 0; x < columns_; ++x, ++i) {
      here_.dx[i] = 0.5F * (at(std::min(columns_ - 1, x + 1), y) - at(std::max(0, x - 1), y));
      here_.dy[i] = 0.5F * (at(x, below) - at(x, above));
    }
  }
}

bool StillImage::has_moved() const {
  int textured = 0, changed = 0;
  for (std::size_t i = 0; i < last_.dx.size(); ++i) {
    const float length = std::hypot(last_.dx[i], last_.dy[i]);
    if (length < kTextured) continue;
    ++textured;
    if (std::hypot(here_.dx[i] - last_.dx[i], here_.dy[i] - last_.dy[i]) > kChanged * length) ++changed;
  }
  return textured > 0 && changed >= kMovedShare * textured;
}

bool StillImage::add(const ipc::GreyImage& image) {
  assert(image.width_px == width_px_ && image.height_px == height_px_);
  average(image);
  differentiate();
  if (counted_ > 0 && !has_moved()) return false;
  for (std::size_t i = 0; i < power_.size(); ++i) {
    const auto dx = static_cast<double>(here_.dx[i]), dy = static_cast<double>(here_.dy[i]);
    sum_dx_[i] += dx;
    sum_dy_[i] += dy;
    power_[i] += dx * dx + dy * dy;
  }
  std::swap(here_, last_);
  ++counted_;
  return true;
}

std::vector<std::uint8_t> StillImage::propose() const {
  Grid<double> of_sum(columns_, rows_), of_all(columns_, rows_);
  for (std::size_t i = 0; i < power_.size(); ++i) {
    of_sum.cells[i] = sum_dx_[i] * sum_dx_[i] + sum_dy_[i] * sum_dy_[i];
    of_all.cells[i] = power_[i];
  }
  const Grid<double> sums = box_sums(of_sum, kNeighbourhood), all = box_sums(of_all, kNeighbourhood),
                     areas = box_sums(Grid<double>(columns_, rows_, 1.0), kNeighbourhood);
  Grid<Kind> kinds(columns_, rows_, Kind::kPassing);
  Bits certain(columns_, rows_);
  for (std::size_t i = 0; i < kinds.cells.size(); ++i) {
    const double agreeing = sums.cells[i] / (counted_ * std::max(all.cells[i], 1e-9));
    const bool flat = all.cells[i] < kFlatPower * areas.cells[i] * counted_;
    if (flat)
      kinds.cells[i] = Kind::kFlat;
    else if (agreeing > kStillShare)
      kinds.cells[i] = Kind::kStill;
    certain.cells[i] = !flat && agreeing > kCertainShare ? 1 : 0;
  }
  keep(sound_parts(cells_of(kinds, Kind::kStill), certain), &kinds);
  fill_enclosed(&kinds);
  // One more to each side: a still edge lies anywhere in its averaged pixel.
  const Bits still = dilated(closed(cells_of(kinds, Kind::kStill), kClosing), 1);
  std::vector<std::uint8_t> mask;
  mask.reserve(static_cast<std::size_t>(width_px_) * static_cast<std::size_t>(height_px_));
  for (int y = 0; y < height_px_; ++y)
    for (int x = 0; x < width_px_; ++x)
      mask.push_back(
          still.at(std::min(x / factor_, columns_ - 1), std::min(y / factor_, rows_ - 1)) != 0 ? 0 : 255);
  return mask;
}

}  // namespace farpoint::tools
