// SPDX-License-Identifier: Apache-2.0
#include "slam/image/extractor.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "slam/image/corner_selection.h"
#include "slam/image/descriptor_pattern.h"
#include "slam/image/kernels.h"

namespace farpoint::slam {
namespace {

// Distance of corners from the edge of their level: the patch (15), the blur (3) and one to spare.
constexpr int kBorder = 19;
// What a corner and its descriptor depend on, to either side of it: the patch and the blur.
constexpr int kSupport = kBorder - 1;
// Blurred pixels exist from here on: a patch around the outermost corner reaches no further.
constexpr int kBlurBorder = kBorder - kPatchRadiusPx;
static_assert(kBlurBorder >= 3, "the blur reads three pixels to each side");

const SteeredPattern& steered_pattern() {
  static const SteeredPattern pattern;
  return pattern;
}

std::size_t padded(int width) {
  return (static_cast<std::size_t>(width) + 2 * kRowAlignment - 1) / kRowAlignment * kRowAlignment;
}

// What one level has while a frame is worked on.
struct Level {
  std::vector<Corner> corners;
  int cell_columns = 0, cell_rows = 0;

  [[nodiscard]] std::size_t cells() const {
    return static_cast<std::size_t>(cell_columns) * static_cast<std::size_t>(cell_rows);
  }
  // Row-major.
  [[nodiscard]] std::size_t cell_of(const Corner& c, int cell_px) const {
    return static_cast<std::size_t>(c.y / cell_px) * static_cast<std::size_t>(cell_columns) +
           static_cast<std::size_t>(c.x / cell_px);
  }
};

}  // namespace

struct Extractor::Workspace {
  Workspace(int width, int height, const PyramidOptions& pyramid_options,
            const ExtractorOptions& extractor_options);

  void detect(const Pyramid& pyramid, int l, const ImageMask* mask);
  void scan(const Pyramid& pyramid, int l, const ImageMask* mask, PixelBox box, int threshold,
            std::vector<Corner>* corners);
  void choose(const Pyramid& pyramid, int most);
  void blur(const ImageView& image);
  void describe(const Pyramid& pyramid, int l, FeatureSet* out);

  [[nodiscard]] std::uint8_t* score_row(int y) {
    return scores.data() + static_cast<std::size_t>(y % 3) * row_stride;
  }
  [[nodiscard]] std::uint8_t* blurred_row(int y) {
    return blurred.data() + static_cast<std::size_t>(y) * row_stride;
  }

  ExtractorOptions options;
  const Kernels* kernels = nullptr;  // of the running extract()
  std::size_t row_stride = 0;        // of all rows below, elements
  std::vector<Level> levels;
  std::vector<double> weights;  // share of each level
  std::vector<int> available, quota;
  std::vector<std::uint8_t> scores;    // three rows of FAST scores
  std::vector<std::uint16_t> maxima;   // one row
  std::vector<std::uint8_t> cell_hit;  // of one level: 1 where a strong corner lies
  std::vector<std::uint8_t> ring;      // seven rows of the blur
  std::vector<std::uint8_t> blurred;   // one level
};

Extractor::Workspace::Workspace(int width, int height, const PyramidOptions& pyramid_options,
                                const ExtractorOptions& extractor_options)
    : options(extractor_options), row_stride(padded(width)) {
  options.cell_px = std::max(8, options.cell_px);
  options.fast_threshold_min = std::clamp(options.fast_threshold_min, 1, 255);
  options.fast_threshold = std::clamp(options.fast_threshold, options.fast_threshold_min, 255);
  const std::size_t count = static_cast<std::size_t>(std::max(1, pyramid_options.levels));
  levels.resize(count);
  available.resize(count);
  quota.resize(count);
  for (std::size_t l = 0; l < count; ++l) {
    const double scale = std::pow(pyramid_options.scale_factor, static_cast<double>(l));
    const int w = static_cast<int>(std::lround(width / scale)),
              h = static_cast<int>(std::lround(height / scale));
    Level& level = levels[l];
    // No two maxima of 3x3 neighbourhoods lie in the same 2x2 block.
    level.corners.reserve((static_cast<std::size_t>(w) / 2 + 1) * (static_cast<std::size_t>(h) / 2 + 1));
    level.cell_columns = w / options.cell_px + 1;
    level.cell_rows = h / options.cell_px + 1;
    // Between equal density on the level's own pixels (1 / scale^2) and equal numbers.
    weights.push_back(1 / scale);
  }
  scores.assign(3 * row_stride, 0);
  maxima.assign(row_stride, 0);
  cell_hit.assign(levels[0].cells(), 0);
  ring.assign(7 * row_stride, 0);
  blurred.assign(row_stride * static_cast<std::size_t>(height), 0);
}

// Corners of at least `threshold` in `box`, added to *corners. A corner must be a maximum of its 3x3
// neighbourhood, in the box or not; scores under the threshold count as 0, which takes nothing from a
// stronger one.
void Extractor::Workspace::scan(const Pyramid& pyramid, int l, const ImageMask* mask, PixelBox box,
                                int threshold, std::vector<Corner>* corners) {
  const ImageView image = pyramid.level(l);
  const double scale = pyramid.scale(l), support_px = pyramid.support_px(l, kSupport);
  const auto masked = [&](int x, int y) {
    return mask != nullptr && mask->touches({(x + 0.5) * scale - 0.5, (y + 0.5) * scale - 0.5}, support_px);
  };
  // Row y is scored, then row y - 1 has both neighbours.
  bool any[3] = {};
  for (int y = box.y0 - 1; y <= box.y1; ++y) {
    const std::uint8_t* row = image.data + static_cast<std::ptrdiff_t>(y) * image.stride_bytes;
    any[y % 3] =
        kernels->fast_score_row(row, image.stride_bytes, box.x0 - 1, box.x1 + 1, threshold, score_row(y));
    const int centre = y - 1;
    if (centre < box.y0 || !any[centre % 3]) continue;
    const std::uint8_t* here = score_row(centre);
    const int count =
        kernels->maxima_row(score_row(centre - 1), here, score_row(y), box.x0, box.x1, maxima.data());
    for (int i = 0; i < count; ++i) {
      const int x = maxima[static_cast<std::size_t>(i)];
      if (masked(x, centre)) continue;
      corners->push_back({static_cast<std::uint16_t>(x), static_cast<std::uint16_t>(centre), here[x], 0});
    }
  }
}

// Strong corners everywhere, then weak ones where a cell has none.
void Extractor::Workspace::detect(const Pyramid& pyramid, int l, const ImageMask* mask) {
  Level& level = levels[static_cast<std::size_t>(l)];
  level.corners.clear();
  const ImageView image = pyramid.level(l);
  const PixelBox inside{kBorder, kBorder, image.width_px - kBorder, image.height_px - kBorder};
  if (inside.x1 <= inside.x0 || inside.y1 <= inside.y0) return;
  scan(pyramid, l, mask, inside, options.fast_threshold, &level.corners);
  std::fill(cell_hit.begin(), cell_hit.end(), std::uint8_t{0});
  const int cell = options.cell_px;
  for (const Corner& c : level.corners) {
    cell_hit[level.cell_of(c, cell)] = 1;
  }
  if (options.fast_threshold_min == options.fast_threshold) return;
  for (int row = 0; row < level.cell_rows; ++row) {
    const std::uint8_t* hit = cell_hit.data() + static_cast<std::ptrdiff_t>(row) * level.cell_columns;
    for (int first = 0, last = 0; first < level.cell_columns; first = last + 1) {
      last = first;  // a run of cells without a hit is [first, last)
      while (last < level.cell_columns && hit[last] == 0) ++last;
      const PixelBox box{std::max(first * cell, inside.x0), std::max(row * cell, inside.y0),
                         std::min(last * cell, inside.x1), std::min((row + 1) * cell, inside.y1)};
      if (box.x1 <= box.x0 || box.y1 <= box.y0) continue;
      scan(pyramid, l, mask, box, options.fast_threshold_min, &level.corners);
    }
  }
}

void Extractor::Workspace::choose(const Pyramid& pyramid, int most) {
  for (std::size_t l = 0; l < levels.size(); ++l) {
    available[l] = static_cast<int>(levels[l].corners.size());
  }
  share_quota(std::min(options.features, most), weights, available, quota);
  for (std::size_t l = 0; l < levels.size(); ++l) {
    Level& level = levels[l];
    const ImageView image = pyramid.level(static_cast<int>(l));
    const PixelBox box{kBorder, kBorder, image.width_px - kBorder, image.height_px - kBorder};
    level.corners.resize(static_cast<std::size_t>(select_spread(level.corners, box, quota[l])));
    const int cell = options.cell_px;
    const auto place = [&](const Corner& c) {
      return (static_cast<std::uint64_t>(level.cell_of(c, cell)) << 32) |
             (static_cast<std::uint64_t>(c.y) << 16) | c.x;
    };
    std::sort(level.corners.begin(), level.corners.end(),
              [&](const Corner& a, const Corner& b) { return place(a) < place(b); });
  }
}

// Blurs all of a level but its outermost kBlurBorder pixels into `blurred`.
void Extractor::Workspace::blur(const ImageView& image) {
  const int width = image.width_px - 2 * kBlurBorder;
  const auto ring_row = [this](int y) { return ring.data() + static_cast<std::size_t>(y % 7) * row_stride; };
  const int first = kBlurBorder, last = image.height_px - kBlurBorder;
  for (int y = first - 3; y < last + 3; ++y) {
    kernels->blur_row(image.data + static_cast<std::ptrdiff_t>(y) * image.stride_bytes + kBlurBorder, width,
                      ring_row(y));
    const int centre = y - 3;
    if (centre < first) continue;
    const std::uint8_t* rows[7];
    for (int k = 0; k < 7; ++k) rows[k] = ring_row(centre - 3 + k);
    kernels->blur_column(rows, width, blurred_row(centre) + kBlurBorder);
  }
}

void Extractor::Workspace::describe(const Pyramid& pyramid, int l, FeatureSet* out) {
  const Level& level = levels[static_cast<std::size_t>(l)];
  if (level.corners.empty()) return;
  const ImageView image = pyramid.level(l);
  const float scale = pyramid.scale(l);
  blur(image);
  alignas(64) std::uint8_t patch[kPatchSidePx * kPatchStrideBytes];
  for (const Corner& c : level.corners) {
    const CentroidMoments m = kernels->centroid(
        image.data + static_cast<std::ptrdiff_t>(c.y) * image.stride_bytes + c.x, image.stride_bytes);
    Feature f;
    f.u_px = (static_cast<float>(c.x) + 0.5F) * scale - 0.5F;
    f.v_px = (static_cast<float>(c.y) + 0.5F) * scale - 0.5F;
    f.angle_rad = std::atan2(static_cast<float>(m.m01), static_cast<float>(m.m10));
    f.score = static_cast<float>(c.score);
    f.level = static_cast<std::uint8_t>(l);
    out->features.push_back(f);

    for (int y = 0; y < kPatchSidePx; ++y) {
      std::memcpy(patch + y * kPatchStrideBytes, blurred_row(c.y - kPatchRadiusPx + y) + c.x - kPatchRadiusPx,
                  kPatchStrideBytes);
    }
    kernels->compare_pairs(patch, steered_pattern().offsets(f.angle_rad),
                           out->descriptors.emplace_back().words.data());
  }
}

Extractor::Extractor(int width_px, int height_px, const PyramidOptions& pyramid,
                     const ExtractorOptions& options)
    : workspace_(std::make_unique<Workspace>(width_px, height_px, pyramid, options)) {
  (void)steered_pattern();  // built now, not in the first frame
}

Extractor::~Extractor() = default;

void Extractor::extract(const Pyramid& pyramid, const ImageMask* mask, FeatureSet* out, int most) {
  Workspace& w = *workspace_;
  w.kernels = &active_kernels();
  out->features.clear();
  out->descriptors.clear();
  out->features.reserve(static_cast<std::size_t>(w.options.features));
  out->descriptors.reserve(static_cast<std::size_t>(w.options.features));
  for (int l = 0; l < pyramid.levels(); ++l) w.detect(pyramid, l, mask);
  w.choose(pyramid, most);
  for (int l = 0; l < pyramid.levels(); ++l) w.describe(pyramid, l, out);
}

}  // namespace farpoint::slam
