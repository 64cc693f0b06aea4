// SPDX-License-Identifier: Apache-2.0
// PyramidImage: patches and their alignment (inverse compositional Lucas-Kanade; Baker & Matthews, IJCV
// 2004).
//
// Both the host patch and the image are read through the same smoothing: [1 2 1]/4 and a quadratic B-spline.
// Two errors that pull a measurement towards whole pixels are met that way. Linear interpolation blurs by an
// amount that depends on the sub-pixel position; the B-spline blurs by a variance of 1/4 px^2 at every
// position and shifts nothing. And camera images alias: their finest detail moves with the pixel grid, not
// with the scene; the small blur takes it out of the comparison.
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "slam/image/kernels.h"
#include "slam/image/pyramid.h"

namespace farpoint::slam {
namespace {

constexpr int kSide = kTemplateSide;  // target level pixels
constexpr int kCount = kTemplateCount;
static_assert(Patch::kSize == kAlignPatchSide);
constexpr float kFirst = -(kSide - 1) / 2.0F;  // offset of the first template pixel from its centre
constexpr int kMaxIterations = 10;
constexpr float kConverged = 0.02F;  // level pixels; what is left after such a step is a fraction of it
constexpr float kMaxStep = 1.0F;     // level pixels an iteration: the linearisation holds no further
// Beyond this the patch and the image differ too much in resolution for each other even at the best level.
constexpr float kMaxScale = 2.2F;
// From here on one sample a template pixel would miss pixels of the patch: four are averaged.
constexpr float kSupersampleScale = 1.3F;
// Of the matches of recorded frames that correlate less than this, most lie nowhere near their epipolar line.
constexpr float kMinZncc = 0.8F;
// Grey levels, 1 sigma, after the smoothing, that a residual of 64 pixels may hide.
constexpr float kMinNoise = 0.7F;
// Variance of the position against what independent pixels would give. The smoothing correlates the noise of
// neighbours (about 9), and what differs between two views of a surface is as coarse as its texture.
// Measured: epipolar distances in recorded frames (KITTI, EuRoC) against this claim, see
// tests/image/patch_alignment_test.cc.
constexpr float kNoiseCorrelation = 14.0F;
// What remains where texture and noise explain nothing, level pixels; measured likewise.
constexpr float kSigmaFloor = 0.05F;
// The error of the worst direction, level pixels, above which the position along it is not known: there a
// descriptor match alone is as good.
constexpr float kMaxSigma = 0.75F;
// [1 2 1] / 4 next to the centre and at the centre.
constexpr float kBlurSide = 0.25F, kBlurCentre = 0.5F;

// Four floats in one register, on every machine's baseline instruction set.
using Float4 = float __attribute__((vector_size(16)));

Float4 load4(const float* p) {
  Float4 v;
  std::memcpy(&v, p, sizeof(v));
  return v;
}

void store4(Float4 v, float* p) {
  std::memcpy(p, &v, sizeof(v));
}

float sum(Float4 v) {
  return (v[0] + v[1]) + (v[2] + v[3]);
}

// The quadratic B-spline: weights of the pixels nearest - 1, nearest, nearest + 1 at offset t from the
// nearest, |t| <= 0.5. The fourth weight is 0.
constexpr Float4 kSpline[3] = {{0.125F, 0.75F, 0.125F, 0}, {-0.5F, 0, 0.5F, 0}, {0.5F, -1, 0.5F, 0}};
Float4 spline(float t) {
  return kSpline[0] + t * (kSpline[1] + t * kSpline[2]);
}

int nearest_pixel(float x) {
  return static_cast<int>(std::floor(x + 0.5F));
}

using SmoothPatch = std::array<float, Patch::kSize * Patch::kSize>;

// `B` maps an offset in target level pixels to one in host level pixels. False if the template leaves the
// patch.
bool warp_template(const Kernels& kernels, const Patch& patch, const Eigen::Matrix2f& B, PatchTemplate* t) {
  // The norm of an isotropic warp is sqrt(2) times its scale.
  const bool fine = B.norm() > kSupersampleScale * std::sqrt(2.0F);
  const float sub = fine ? 0.25F : 0.0F;
  const float reach = -kFirst + sub;
  // The spline reads one pixel around the nearest: positions 0.5 .. 14.5 are inside, the corner is at 8.
  constexpr float kReach = Patch::kSize - 1.5F - Patch::kCentre;
  if (!((B.cwiseAbs() * Eigen::Vector2f(reach, reach)).maxCoeff() < kReach)) return false;
  alignas(64) SmoothPatch smooth;
  kernels.smooth_patch(patch.pixels.data(), smooth.data());
  *t = {};
  const int samples = fine ? 4 : 1;
  for (int s = 0; s < samples; ++s) {
    const Eigen::Vector2f first(kFirst + ((s & 1) != 0 ? sub : -sub), kFirst + ((s & 2) != 0 ? sub : -sub));
    const Eigen::Vector2f at = Eigen::Vector2f::Constant(Patch::kCentre) + B * first;
    kernels.sample_patch(
        smooth.data(),
        {at.x(), B(0, 0), B(0, 1), at.y(), B(1, 0), B(1, 1), 1.0F / static_cast<float>(samples)}, t);
  }
  return true;
}

// Spline and blur in one: weights of the pixels nearest - 2 .. nearest + 2.
void smooth_weights(float t, float out[5]) {
  const Float4 w = spline(t);
  out[0] = kBlurSide * w[0];
  out[1] = kBlurSide * w[1] + kBlurCentre * w[0];
  out[2] = kBlurSide * (w[0] + w[2]) + kBlurCentre * w[1];
  out[3] = kBlurSide * w[1] + kBlurCentre * w[2];
  out[4] = kBlurSide * w[2];
}

// Pixels to either side of its centre that a window reads: half its side, the rounding, the spline and blur.
constexpr double kWindowSupport = 6.0;

// Sums of the image around (x, y), at the offsets of the template. False if it leaves the image.
bool sample_window(const Kernels& kernels, const ImageView& image, float x, float y,
                   const PatchTemplate& with, WindowSums* out) {
  const float x0 = x + kFirst, y0 = y + kFirst;
  // Written so that NaN fails.
  if (!(x0 >= 1.5F && y0 >= 1.5F && x0 + kSide < static_cast<float>(image.width_px) - 1.5F &&
        y0 + kSide < static_cast<float>(image.height_px) - 1.5F)) {
    return false;
  }
  const int ix = nearest_pixel(x0), iy = nearest_pixel(y0);
  float wx[5], wy[5];
  smooth_weights(x0 - static_cast<float>(ix), wx);
  smooth_weights(y0 - static_cast<float>(iy), wy);
  *out = kernels.window_sums(image.data + static_cast<std::ptrdiff_t>(iy - 2) * image.stride_bytes + ix - 2,
                             image.stride_bytes, wx, wy, with);
  return true;
}

// Template made free of brightness: the model is image(p + d) = gain * template(d + shift) + offset, and
// gradients orthogonal to the template and to a constant see the shift alone.
struct Normalised {
  // value: template, zero mean, norm 1; dx, dy: gradients, orthogonal to that and to 1.
  PatchTemplate unit;
  float norm = 0;  // of the zero-mean template
  Eigen::Matrix2f inverse_hessian;
};

// Of n->unit, as warped. False where it shows nothing that could be aligned. Each pass over the template
// makes the sums that the next one needs: they are chains of additions, and several go on at once.
bool normalise(Normalised* n) {
  PatchTemplate& t = n->unit;
  Float4 value = {}, dx = {}, dy = {};
  for (std::size_t i = 0; i < kCount; i += 4)
    value += load4(t.value + i), dx += load4(t.dx + i), dy += load4(t.dy + i);
  const float mean = sum(value) / kCount, mean_dx = sum(dx) / kCount, mean_dy = sum(dy) / kCount;
  Float4 square = {};
  for (std::size_t i = 0; i < kCount; i += 4) {
    const Float4 v = load4(t.value + i) - mean;
    store4(v, t.value + i);
    square += v * v;
  }
  n->norm = std::sqrt(sum(square));
  // Flat: less contrast than the noise.
  if (!(n->norm > kMinNoise * kSide)) return false;
  Float4 along_dx = {}, along_dy = {};
  for (std::size_t i = 0; i < kCount; i += 4) {
    const Float4 v = load4(t.value + i) / n->norm;
    const Float4 gx = load4(t.dx + i) - mean_dx, gy = load4(t.dy + i) - mean_dy;
    store4(v, t.value + i), store4(gx, t.dx + i), store4(gy, t.dy + i);
    along_dx += gx * v, along_dy += gy * v;
  }
  const float value_in_dx = sum(along_dx), value_in_dy = sum(along_dy);
  Float4 sum_xx = {}, sum_xy = {}, sum_yy = {};
  for (std::size_t i = 0; i < kCount; i += 4) {
    const Float4 v = load4(t.value + i);
    const Float4 gx = load4(t.dx + i) - value_in_dx * v, gy = load4(t.dy + i) - value_in_dy * v;
    store4(gx, t.dx + i), store4(gy, t.dy + i);
    sum_xx += gx * gx, sum_xy += gx * gy, sum_yy += gy * gy;
  }
  const float xx = sum(sum_xx), xy = sum(sum_xy), yy = sum(sum_yy);
  const float determinant = xx * yy - xy * xy;
  if (!(determinant > 1e-6F * (xx + yy) * (xx + yy))) return false;
  n->inverse_hessian << yy, -xy, -xy, xx;
  n->inverse_hessian /= determinant;
  return true;
}

float largest_eigenvalue(const Eigen::Matrix2f& m) {
  const float mean = 0.5F * (m(0, 0) + m(1, 1)), half = 0.5F * (m(0, 0) - m(1, 1));
  return mean + std::sqrt(half * half + m(0, 1) * m(0, 1));
}

// How `patch` is read for this image: the level of about its resolution, and the warp from that level's
// pixels to the patch's. False where the two differ too much in resolution.
struct Reading {
  int level = 0;
  Eigen::Matrix2f B;  // an offset in pixels of the level -> one in pixels of the patch
};

int best_level(const Pyramid& pyramid, float scale) {
  int best = 0;
  for (int l = 1; l < pyramid.levels(); ++l) {
    // Nearest in the ratio.
    if (pyramid.scale(l) * pyramid.scale(l - 1) < scale * scale) best = l;
  }
  return best;
}

bool read_patch(const Pyramid& pyramid, const Patch& patch, const Eigen::Matrix2f& A_target_host,
                Reading* out) {
  const float determinant = A_target_host.determinant();
  if (patch.level >= pyramid.levels() || !(determinant > 1e-4F)) return false;
  const float host_scale = pyramid.scale(patch.level);
  out->level = best_level(pyramid, host_scale * std::sqrt(determinant));
  out->B = A_target_host.inverse() * (pyramid.scale(out->level) / host_scale);
  const float area = out->B.determinant();
  return area < kMaxScale * kMaxScale && area * kMaxScale * kMaxScale > 1;
}

// Pixels to either side of its centre that a coarse window reads: half its side, less half a pixel.
constexpr double kCoarseSupport = (kSide - 1) / 2.0;

// A template in whole numbers, for sums without rounding.
struct CoarseTemplate {
  alignas(16) std::int16_t value[kCount];
  float norm = 0;

  explicit CoarseTemplate(const Normalised& from) {
    // Unit norm over 64 pixels: the largest value is below 1. Sums stay below 2^31.
    constexpr float kUnit = 4096.0F;
    std::int32_t squares = 0;
    for (int i = 0; i < kCount; ++i) {
      value[i] = static_cast<std::int16_t>(std::lround(kUnit * from.unit.value[i]));
      squares += value[i] * value[i];
    }
    norm = std::sqrt(static_cast<float>(squares));
  }
};

// -1..1, of the 8x8 pixels from `corner` on.
float correlation(const std::uint8_t* corner, int stride_bytes, const CoarseTemplate& with) {
  std::int32_t along = 0, sum = 0, squares = 0, bias = 0;
  for (int y = 0; y < kSide; ++y, corner += stride_bytes) {
    for (int x = 0; x < kSide; ++x) {
      const std::int16_t v = corner[x];
      const std::int16_t t = with.value[y * kSide + x];
      along += v * t;
      squares += v * v;
      sum += v;
      bias += t;
    }
  }
  // The template's mean is zero except for rounding.
  const float mean = static_cast<float>(sum) / kCount;
  const float energy = static_cast<float>(squares) - static_cast<float>(sum) * mean;
  if (!(energy > kMinNoise * kMinNoise * kCount)) return -1.0F;
  return (static_cast<float>(along) - static_cast<float>(bias) * mean) / (with.norm * std::sqrt(energy));
}

}  // namespace

bool PyramidImage::extract_patch(const FeatureSet& set, std::size_t index, Patch* patch) const {
  const Feature& f = set.features[index];
  if (f.level >= pyramid_->levels()) return false;
  const ImageView image = pyramid_->level(f.level);
  const float scale = pyramid_->scale(f.level);
  const int x0 = nearest_pixel((f.u_px + 0.5F) / scale - 0.5F) - Patch::kCentre;
  const int y0 = nearest_pixel((f.v_px + 0.5F) / scale - 0.5F) - Patch::kCentre;
  if (x0 < 0 || y0 < 0 || x0 + Patch::kSize > image.width_px || y0 + Patch::kSize > image.height_px)
    return false;
  if (mask_ != nullptr && mask_->touches({f.u_px, f.v_px}, pyramid_->support_px(f.level, Patch::kCentre)))
    return false;
  for (int y = 0; y < Patch::kSize; ++y) {
    std::copy_n(image.data + static_cast<std::ptrdiff_t>(y0 + y) * image.stride_bytes + x0, Patch::kSize,
                patch->pixels.data() + y * Patch::kSize);
  }
  patch->level = f.level;
  return true;
}

Alignment PyramidImage::align(const Patch& host, const Eigen::Matrix2f& A_target_host,
                              const Eigen::Vector2f& predicted_px, float max_shift_px) const {
  Alignment result;
  Reading reading;
  if (!read_patch(*pyramid_, host, A_target_host, &reading)) return result;
  const float scale = pyramid_->scale(reading.level);

  const Kernels& kernels = active_kernels();
  Normalised host_template;
  if (!warp_template(kernels, host, reading.B, &host_template.unit) || !normalise(&host_template))
    return result;

  const ImageView image = pyramid_->level(reading.level);
  const double support_px = pyramid_->support_px(reading.level, kWindowSupport);
  const Eigen::Vector2f half(0.5F, 0.5F);
  const Eigen::Vector2f start = (predicted_px + half) / scale - half;
  Eigen::Vector2f p = start;
  float gain = 0, variance = 0;
  bool converged = false;
  for (int iteration = 0; iteration < kMaxIterations && !converged; ++iteration) {
    // The template's parts have zero mean, so that the window's own mean drops out of the products.
    WindowSums product;
    if (mask_ != nullptr && mask_->touches(((p + half) * scale - half).cast<double>(), support_px))
      return result;
    if (!sample_window(kernels, image, p.x(), p.y(), host_template.unit, &product)) return result;
    const float energy = product.square - product.value * product.value / kCount;
    gain = product.along / host_template.norm;
    result.zncc = energy > 0 ? product.along / std::sqrt(energy) : 0;
    // A start half a texture period away shows no or negative correlation: there is no way down from here.
    if (!(result.zncc > 0.1F)) return result;
    Eigen::Vector2f step = host_template.inverse_hessian * Eigen::Vector2f(product.dx, product.dy) / gain;
    const float length = step.norm();
    if (length > kMaxStep) step *= kMaxStep / length;
    p -= step;
    if (!((p - start).squaredNorm() * scale * scale <= max_shift_px * max_shift_px)) return result;
    converged = length < kConverged;
    variance = (energy - product.along * product.along) / (kCount - 4);
  }
  const float noise = std::max(variance, kMinNoise * kMinNoise);
  const Eigen::Matrix2f covariance =
      host_template.inverse_hessian * (kNoiseCorrelation * noise / (gain * gain));
  const float sigma = std::sqrt(0.5F * covariance.trace() + kSigmaFloor * kSigmaFloor);
  result.pixel = (p + half) * scale - half;
  result.sigma_px = sigma * scale;
  result.ok = converged && result.zncc >= kMinZncc && largest_eigenvalue(covariance) <= kMaxSigma * kMaxSigma;
  return result;
}

bool PyramidImage::correlate(const Patch& host, const Eigen::Matrix2f& A_target_host,
                             std::span<const Eigen::Vector2f> pixels, std::span<float> zncc) const {
  Reading reading;
  Normalised host_template;
  if (!read_patch(*pyramid_, host, A_target_host, &reading) ||
      !warp_template(active_kernels(), host, reading.B, &host_template.unit) || !normalise(&host_template))
    return false;
  const CoarseTemplate coarse(host_template);
  const ImageView image = pyramid_->level(reading.level);
  const float scale = pyramid_->scale(reading.level);
  const double support_px = pyramid_->support_px(reading.level, kCoarseSupport);
  const auto is_masked = [&](int x0, int y0) {
    const Eigen::Vector2f centre(static_cast<float>(x0) - kFirst, static_cast<float>(y0) - kFirst);
    const Eigen::Vector2f half(0.5F, 0.5F);
    return mask_ != nullptr && mask_->touches(((centre + half) * scale - half).cast<double>(), support_px);
  };
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    // The template's first pixel lies kFirst, half a pixel and three, before the corner.
    const int x0 = nearest_pixel((pixels[i].x() + 0.5F) / scale - 0.5F + kFirst);
    const int y0 = nearest_pixel((pixels[i].y() + 0.5F) / scale - 0.5F + kFirst);
    const bool inside = x0 >= 0 && y0 >= 0 && x0 + kSide <= image.width_px && y0 + kSide <= image.height_px;
    zncc[i] = inside && !is_masked(x0, y0)
                  ? correlation(image.data + static_cast<std::ptrdiff_t>(y0) * image.stride_bytes + x0,
                                image.stride_bytes, coarse)
                  : -1.0F;
  }
  return true;
}

}  // namespace farpoint::slam
