// SPDX-License-Identifier: Apache-2.0
#include "slam/image/pyramid.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <vector>

#include "slam/image/kernels.h"

namespace farpoint::slam {
namespace {

int round_up(int value) {
  return (value + kRowAlignment - 1) / kRowAlignment * kRowAlignment;
}

// Where one output row or column of a level comes from: the source pixel nearest to it and its weights.
//
// The three weights are the quadratic B-spline at offset t: they keep the first moment exactly (no shift
// between the levels, whatever t is) and spread by the same variance, 1/4 px^2, at every t, so that all
// pixels of a level are equally sharp. That is also about the blur that sampling 1.2 times coarser asks for.
struct Tap {
  int nearest = 0;
  int weight[3] = {};  // sum to `unit`
};

Tap make_tap(int x, double factor, int unit) {
  const double position = (x + 0.5) * factor - 0.5;
  Tap tap;
  tap.nearest = static_cast<int>(std::floor(position + 0.5));
  const double t = position - tap.nearest;
  // The difference of the outer weights is the shift: round that first, then their sum to the same parity.
  const int difference = static_cast<int>(std::lround(t * unit));
  int sum = static_cast<int>(std::lround((t * t + 0.25) * unit));
  if ((sum - difference) % 2 != 0) ++sum;
  tap.weight[0] = (sum - difference) / 2;
  tap.weight[2] = (sum + difference) / 2;
  tap.weight[1] = unit - sum;
  return tap;
}

std::vector<ResampleBlock> make_blocks(int source_width, int width, double factor) {
  constexpr int kBlock = ResampleBlock::kBlock;
  std::vector<ResampleBlock> blocks(static_cast<std::size_t>((width + kBlock - 1) / kBlock));
  const auto clamped = [&](int i) { return std::clamp(i, 0, source_width - 1); };
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    ResampleBlock& block = blocks[b];
    const int x0 = static_cast<int>(b) * kBlock;
    block.first = clamped(make_tap(std::min(x0, width - 1), factor, 128).nearest - 1);
    for (int i = 0; i < kBlock; ++i) {
      const Tap tap = make_tap(std::min(x0 + i, width - 1), factor, 128);
      for (int k = 0; k < 3; ++k) {
        const int position = clamped(tap.nearest + k - 1) - block.first;
        assert(position >= 0 && position < ResampleBlock::kWindow);
        block.shuffle[k][2 * i] = static_cast<std::uint8_t>(position);
        block.shuffle[k][2 * i + 1] = 0x80;
        block.weight[k][i] = static_cast<std::int16_t>(tap.weight[k]);
      }
    }
  }
  return blocks;
}

struct RowTap {
  int source[3] = {};
  std::int16_t weight[3] = {};
};

std::vector<RowTap> make_row_taps(int source_height, int height, double factor) {
  std::vector<RowTap> taps(static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) {
    const Tap tap = make_tap(y, factor, 1 << 15);
    for (int k = 0; k < 3; ++k) {
      taps[static_cast<std::size_t>(y)].source[k] = std::clamp(tap.nearest + k - 1, 0, source_height - 1);
      taps[static_cast<std::size_t>(y)].weight[k] = static_cast<std::int16_t>(tap.weight[k]);
    }
  }
  return taps;
}

struct Level {
  int width = 0, height = 0, stride = 0;
  float scale = 1;
  double spread_px = 0;  // how far the level-0 pixels lie that one of its pixels is made of
  std::uint8_t* pixels = nullptr;
  std::vector<ResampleBlock> blocks;  // from the level below
  std::vector<RowTap> rows;
};

}  // namespace

struct Pyramid::Storage {
  static constexpr int kRing = 4;  // source rows kept after the row pass; three are in use
  std::vector<Level> levels;
  std::vector<std::uint8_t> memory;
  std::vector<std::int16_t> ring;
  int ring_stride = 0;

  void resample(const Level& source, const Level& target, const Kernels& kernels);
};

Pyramid::Pyramid(int width_px, int height_px, const PyramidOptions& options)
    : storage_(std::make_shared<Storage>()) {
  Storage& s = *storage_;
  s.levels.resize(static_cast<std::size_t>(std::max(1, options.levels)));
  std::size_t bytes = 0;
  for (std::size_t l = 0; l < s.levels.size(); ++l) {
    Level& level = s.levels[l];
    const double scale = std::pow(options.scale_factor, static_cast<double>(l));
    level.scale = static_cast<float>(scale);
    level.width = std::max(1, static_cast<int>(std::lround(width_px / scale)));
    level.height = std::max(1, static_cast<int>(std::lround(height_px / scale)));
    level.stride = round_up(level.width + ResampleBlock::kWindow);
    bytes += static_cast<std::size_t>(level.stride) * static_cast<std::size_t>(level.height);
    if (l == 0) continue;
    const Level& below = s.levels[l - 1];
    // The taps: one pixel to either side of the nearest, which is up to half a pixel away.
    level.spread_px = below.spread_px + 1.5 * static_cast<double>(below.scale);
    level.blocks = make_blocks(below.width, level.width, options.scale_factor);
    level.rows = make_row_taps(below.height, level.height, options.scale_factor);
  }
  s.memory.assign(bytes + 2 * kRowAlignment, 0);
  std::uint8_t* next = s.memory.data();
  next += (kRowAlignment - reinterpret_cast<std::uintptr_t>(next) % kRowAlignment) % kRowAlignment;
  for (Level& level : s.levels) {
    level.pixels = next;
    next += static_cast<std::ptrdiff_t>(level.stride) * level.height;
  }
  s.ring_stride = s.levels[0].stride;
  s.ring.assign(static_cast<std::size_t>(s.ring_stride) * Storage::kRing, 0);
}

// Rows are filtered along x once each, in order, into a ring; every target row combines three of them.
void Pyramid::Storage::resample(const Level& source, const Level& target, const Kernels& kernels) {
  const auto ring_row = [this](int y) {
    return ring.data() + static_cast<std::ptrdiff_t>(y % kRing) * ring_stride;
  };
  int filtered = 0;  // rows [0, filtered) have passed
  for (int y = 0; y < target.height; ++y) {
    const RowTap& tap = target.rows[static_cast<std::size_t>(y)];
    // Coarser steps than two rows skip some: they need no filtering.
    filtered = std::max(filtered, tap.source[0]);
    for (; filtered <= tap.source[2]; ++filtered) {
      kernels.resample_row(source.pixels + static_cast<std::ptrdiff_t>(filtered) * source.stride,
                           target.blocks.data(), target.width, ring_row(filtered));
    }
    const std::int16_t* const rows[3] = {ring_row(tap.source[0]), ring_row(tap.source[1]),
                                         ring_row(tap.source[2])};
    kernels.combine_rows(rows, tap.weight, target.width,
                         target.pixels + static_cast<std::ptrdiff_t>(y) * target.stride);
  }
}

void Pyramid::build(const ImageView& image) {
  Storage& s = *storage_;
  const Level& base = s.levels[0];
  assert(image.width_px == base.width && image.height_px == base.height);
  for (int y = 0; y < base.height; ++y) {
    std::memcpy(base.pixels + static_cast<std::ptrdiff_t>(y) * base.stride,
                image.data + static_cast<std::ptrdiff_t>(y) * image.stride_bytes,
                static_cast<std::size_t>(base.width));
  }
  const Kernels& kernels = active_kernels();
  for (std::size_t l = 1; l < s.levels.size(); ++l) s.resample(s.levels[l - 1], s.levels[l], kernels);
}

int Pyramid::levels() const {
  return static_cast<int>(storage_->levels.size());
}

ImageView Pyramid::level(int l) const {
  const Level& level = storage_->levels[static_cast<std::size_t>(l)];
  return {level.pixels, level.width, level.height, level.stride};
}

float Pyramid::scale(int l) const {
  return storage_->levels[static_cast<std::size_t>(l)].scale;
}

double Pyramid::support_px(int l, double radius_px) const {
  const Level& level = storage_->levels[static_cast<std::size_t>(l)];
  return radius_px * static_cast<double>(level.scale) + level.spread_px;
}

std::size_t Pyramid::bytes() const {
  return storage_->memory.size() + storage_->ring.size() * sizeof(std::int16_t);
}

}  // namespace farpoint::slam
