// SPDX-License-Identifier: Apache-2.0
#include "slam/image/curve_search.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

namespace farpoint::slam {

namespace {

// Samples between two places that the camera models compute; those between lie on a straight line. The warp
// holds for as many.
constexpr int kBlock = 8;
// Least correlation, with whole pixels, of a place worth an alignment. The alignment's own limit is higher:
// half a pixel beside the place, fine texture has lost that much.
constexpr float kMinCoarse = 0.55F;
// A second place on the curve is another one from this many samples on: a corner's own peak is as wide.
constexpr int kPeakSamples = 4;
// Two places look alike where what the second lacks of a full correlation is less than this many times what
// the first lacks. With both far from full, noise decides.
constexpr float kDistinct = 1.5F;
// What two images of one surface lack of a full correlation in any case: noise, and their different light.
constexpr float kCommonLack = 0.02F;
// Largest distance of the place found from the curve, pixels of the patch's level: alignment is good to a
// tenth, a rig's calibration to about a pixel.
constexpr float kMostOffCurve_level_px = 1.0F;
// Least correlation of a match. Two images of one moment show a surface in one light: right matches correlate
// by 0.95 and more, and a hundred places of a curve offer more chances of 0.8 than one.
constexpr float kMinFine = 0.9F;
// Alignments that end nearer to each other than this have found the same place.
constexpr float kApart_level_px = 2.0F;
// How far alignment may move from the sample, pixels of the patch's level.
constexpr float kMostShift_level_px = 2.5F;

}  // namespace

struct CurveSearch::Place {
  Eigen::Vector2d pixel;
  Eigen::Vector2d d_inverse_depth;
  Eigen::Matrix2f A_target_host;
};

// Places along the curve with their correlations. By ascending inverse depth.
struct CurveSearch::Samples {
  std::array<float, kMostSamples> zncc;
  std::array<double, kMostSamples> inverse_depth;
  int count = 0;

  [[nodiscard]] float at(int i) const { return zncc[static_cast<std::size_t>(i)]; }
  [[nodiscard]] double inverse_depth_at(int i) const { return inverse_depth[static_cast<std::size_t>(i)]; }
};

bool CurveSearch::place_at(const CurveQuery& query, double inverse_depth, Place* place) const {
  Matrix23d d_point;
  const Eigen::Vector3d point = R_ * query.bearing + inverse_depth * t_;
  if (!target_.project(point, &place->pixel, &d_point)) return false;
  place->d_inverse_depth = d_point * t_;
  place->A_target_host = (d_point * R_ * query.d_bearing_d_pixel).cast<float>();
  return true;
}

bool CurveSearch::sample(const CurveQuery& query, Samples* samples) const {
  Place from;
  double rho = query.min_inverse_depth;
  if (!place_at(query, rho, &from)) return false;
  std::array<Eigen::Vector2f, kBlock> pixels;
  while (samples->count < kMostSamples) {
    // One pixel of the level that the patch is compared on.
    const double step_px = query.level_scale * std::sqrt(std::abs(from.A_target_host.determinant()));
    const double speed_px = std::max(from.d_inverse_depth.norm(), 1e-9);
    const double step = step_px / speed_px;
    const int block = std::min(kBlock, kMostSamples - samples->count);
    const auto first = static_cast<std::size_t>(samples->count);
    Place to;
    const bool visible = place_at(query, rho + block * step, &to);
    const Eigen::Vector2d along = visible ? Eigen::Vector2d((to.pixel - from.pixel) / block)
                                          : Eigen::Vector2d(step * from.d_inverse_depth);
    for (int i = 0; i < block; ++i) {
      pixels[static_cast<std::size_t>(i)] = (from.pixel + i * along).cast<float>();
      samples->inverse_depth[first + static_cast<std::size_t>(i)] = rho + i * step;
    }
    const auto n = static_cast<std::size_t>(block);
    if (!image_.correlate(*query.patch, from.A_target_host, std::span(pixels).first(n),
                          std::span(samples->zncc).subspan(first, n)))
      return samples->count > 0;
    samples->count += block;
    rho += block * step;
    if (!visible || rho > query.max_inverse_depth) break;
    // The curve has left the image. Where it began outside it may still come in.
    if (target_.in_image(from.pixel) && !target_.in_image(to.pixel)) break;
    from = to;
  }
  return true;
}

Alignment CurveSearch::align_at(const CurveQuery& query, double inverse_depth) const {
  Place place;
  if (!place_at(query, inverse_depth, &place)) return {};
  const float scale = query.level_scale * std::sqrt(std::abs(place.A_target_host.determinant()));
  return image_.align(*query.patch, place.A_target_host, place.pixel.cast<float>(),
                      kMostShift_level_px * scale);
}

// The best sample, and the best one that is not on its slope.
void CurveSearch::find_peaks(const Samples& samples, std::array<int, 2>* peaks) {
  const std::span<const float> zncc(samples.zncc.data(), static_cast<std::size_t>(samples.count));
  const auto best = static_cast<int>(std::max_element(zncc.begin(), zncc.end()) - zncc.begin());
  int second = -1;
  for (int i = 0; i < samples.count; ++i)
    if (std::abs(i - best) >= kPeakSamples && (second < 0 || samples.at(i) > samples.at(second))) second = i;
  const auto or_none = [&](int i) { return i >= 0 && samples.at(i) >= kMinCoarse ? i : -1; };
  *peaks = {samples.count > 0 ? or_none(best) : -1, or_none(second)};
}

bool CurveSearch::is_on_curve(const CurveQuery& query, double inverse_depth,
                              const Eigen::Vector2f& pixel) const {
  Place place;
  if (!place_at(query, inverse_depth, &place)) return false;
  const Eigen::Vector2d direction = place.d_inverse_depth.normalized();
  const Eigen::Vector2d off = pixel.cast<double>() - place.pixel;
  const double off_px = std::fabs(direction.x() * off.y() - direction.y() * off.x());
  return off_px <= double{kMostOffCurve_level_px * query.level_scale};
}

CurveMatch CurveSearch::find(const CurveQuery& query) const {
  Samples samples;
  std::array<int, 2> peaks{-1, -1};
  if (sample(query, &samples)) find_peaks(samples, &peaks);
  std::array<Alignment, 2> found;
  for (std::size_t i = 0; i < 2; ++i)
    if (peaks[i] >= 0) found[i] = align_at(query, samples.inverse_depth_at(peaks[i]));
  const std::size_t first = found[1].ok && (!found[0].ok || found[1].zncc > found[0].zncc) ? 1 : 0;
  const Alignment &best = found[first], &rival = found[1 - first];
  CurveMatch match;
  if (!best.ok || best.zncc < kMinFine) return match;
  const bool elsewhere = (rival.pixel - best.pixel).norm() > kApart_level_px * query.level_scale;
  if (rival.ok && elsewhere && 1.0F - rival.zncc < kDistinct * (1.0F - best.zncc) + kCommonLack) return match;
  if (!is_on_curve(query, samples.inverse_depth_at(peaks[first]), best.pixel)) return match;
  match.pixel = best.pixel;
  match.sigma_px = best.sigma_px;
  match.zncc = best.zncc;
  match.ok = true;
  return match;
}

}  // namespace farpoint::slam
