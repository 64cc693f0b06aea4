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

#include "slam/image/pyramid.h"

namespace farpoint::slam {
namespace {

constexpr int kSide = 8;  // template side, target level pixels
constexpr int kCount = kSide * kSide;
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
// tests/image/alignment_test.cc.
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

float sum(Float4 v) {
  return (v[0] + v[1]) + (v[2] + v[3]);
}

// The quadratic B-spline: weights of the pixels nearest - 1, nearest, nearest + 1 at offset t from the
// nearest, |t| <= 0.5, and their derivatives. The fourth weight is 0.
constexpr Float4 kSpline[3] = {{0.125F, 0.75F, 0.125F, 0}, {-0.5F, 0, 0.5F, 0}, {0.5F, -1, 0.5F, 0}};
Float4 spline(float t) {
  return kSpline[0] + t * (kSpline[1] + t * kSpline[2]);
}
Float4 spline_slope(float t) {
  return kSpline[1] + (2 * t) * kSpline[2];
}

int nearest_pixel(float x) {
  return static_cast<int>(std::floor(x + 0.5F));
}

using Window = std::array<float, kCount>;
// With room for a Float4 at the last pixel.
using SmoothPatch = std::array<float, Patch::kSize * Patch::kSize + 4>;

// The warped host patch: values and derivatives by the target level's pixel.
struct Template {
  Window value, dx, dy;
};

// The patch after [1 2 1]/4 along both axes; pixels outside count as their neighbour inside.
void smooth_patch(const Patch& patch, SmoothPatch* out) {
  constexpr int kSize = Patch::kSize;
  float rows[kSize + 2][kSize];
  for (int y = 0; y < kSize; ++y) {
    const std::uint8_t* p = patch.pixels.data() + y * kSize;
    const auto smooth = [p](int left, int x, int right) {
      return kBlurSide * static_cast<float>(p[left] + p[right]) + kBlurCentre * static_cast<float>(p[x]);
    };
    rows[y + 1][0] = smooth(0, 0, 1);
    for (int x = 1; x < kSize - 1; ++x) rows[y + 1][x] = smooth(x - 1, x, x + 1);
    rows[y + 1][kSize - 1] = smooth(kSize - 2, kSize - 1, kSize - 1);
  }
  std::copy_n(rows[1], kSize, rows[0]);
  std::copy_n(rows[kSize], kSize, rows[kSize + 1]);
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      (*out)[static_cast<std::size_t>(y * kSize + x)] =
          kBlurSide * (rows[y][x] + rows[y + 2][x]) + kBlurCentre * rows[y + 1][x];
    }
  }
}

// Adds value and gradient of the patch at host pixel (x, y), which the caller has checked.
void sample_patch(const SmoothPatch& patch, float x, float y, float* value, float* slope_x, float* slope_y) {
  // Positions are positive: truncation is the floor.
  const int ix = static_cast<int>(x + 0.5F), iy = static_cast<int>(y + 0.5F);
  const float tx = x - static_cast<float>(ix), ty = y - static_cast<float>(iy);
  const Float4 wy = spline(ty), dy = spline_slope(ty);
  const float* row = patch.data() + (iy - 1) * Patch::kSize + ix - 1;
  const Float4 row0 = load4(row), row1 = load4(row + Patch::kSize), row2 = load4(row + 2 * Patch::kSize);
  const Float4 across = wy[0] * row0 + wy[1] * row1 + wy[2] * row2;
  const Float4 down = dy[0] * row0 + dy[1] * row1 + dy[2] * row2;
  const Float4 wx = spline(tx);
  *value += sum(wx * across);
  *slope_x += sum(spline_slope(tx) * across);
  *slope_y += sum(wx * down);
}

// `B` maps an offset in target level pixels to one in host level pixels. False if the template leaves the
// patch.
bool warp_template(const Patch& patch, const Eigen::Matrix2f& B, Template* t) {
  // The norm of an isotropic warp is sqrt(2) times its scale.
  const bool fine = B.norm() > kSupersampleScale * std::sqrt(2.0F);
  const float sub = fine ? 0.25F : 0.0F;
  const float reach = -kFirst + sub;
  // The spline reads one pixel around the nearest: positions 0.5 .. 14.5 are inside, the corner is at 8.
  constexpr float kReach = Patch::kSize - 1.5F - Patch::kCentre;
  if (!((B.cwiseAbs() * Eigen::Vector2f(reach, reach)).maxCoeff() < kReach)) return false;
  SmoothPatch smooth;
  constexpr float kCentre = Patch::kCentre;
  smooth_patch(patch, &smooth);
  const int samples = fine ? 4 : 1;
  const float share = 1.0F / static_cast<float>(samples);
  const float bxx = B(0, 0), bxy = B(0, 1), byx = B(1, 0), byy = B(1, 1);
  for (int i = 0; i < kCount; ++i) {
    const float dx = kFirst + static_cast<float>(i % kSide), dy = kFirst + static_cast<float>(i / kSide);
    float value = 0, slope_x = 0, slope_y = 0;
    for (int s = 0; s < samples; ++s) {
      const float sx = dx + ((s & 1) != 0 ? sub : -sub), sy = dy + ((s & 2) != 0 ? sub : -sub);
      sample_patch(smooth, kCentre + bxx * sx + bxy * sy, kCentre + byx * sx + byy * sy, &value, &slope_x,
                   &slope_y);
    }
    const auto index = static_cast<std::size_t>(i);
    t->value[index] = value * share;
    t->dx[index] = (bxx * slope_x + byx * slope_y) * share;
    t->dy[index] = (bxy * slope_x + byy * slope_y) * share;
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

// The image around (x, y), at the offsets of the template. False if it leaves the image.
bool sample_window(const ImageView& image, float x, float y, Window* out) {
  constexpr int kRows = kSide + 4;
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
  // Two halves of four columns each.
  Float4 rows[kRows][2];
  for (int r = 0; r < kRows; ++r) {
    const std::uint8_t* p =
        image.data + static_cast<std::ptrdiff_t>(iy - 2 + r) * image.stride_bytes + ix - 2;
    float pixels[kRows];
    for (int c = 0; c < kRows; ++c) pixels[c] = static_cast<float>(p[c]);
    for (int half = 0; half < 2; ++half) {
      const float* q = pixels + 4 * half;
      rows[r][half] = wx[0] * load4(q) + wx[1] * load4(q + 1) + wx[2] * load4(q + 2) + wx[3] * load4(q + 3) +
                      wx[4] * load4(q + 4);
    }
  }
  for (int r = 0; r < kSide; ++r) {
    for (int half = 0; half < 2; ++half) {
      const Float4 v = wy[0] * rows[r][half] + wy[1] * rows[r + 1][half] + wy[2] * rows[r + 2][half] +
                       wy[3] * rows[r + 3][half] + wy[4] * rows[r + 4][half];
      std::memcpy(out->data() + r * kSide + 4 * half, &v, sizeof(v));
    }
  }
  return true;
}

float dot(const Window& a, const Window& b) {
  Float4 total = {};
  for (std::size_t i = 0; i < kCount; i += 4) total += load4(&a[i]) * load4(&b[i]);
  return sum(total);
}

void subtract_mean(Window* w) {
  Float4 total = {};
  for (std::size_t i = 0; i < kCount; i += 4) total += load4(&(*w)[i]);
  const float mean = sum(total) / kCount;
  for (float& v : *w) v -= mean;
}

// Template made free of brightness: the model is image(p + d) = gain * template(d + shift) + offset, and
// gradients orthogonal to the template and to a constant see the shift alone.
struct Normalised {
  Window unit;     // template, zero mean, norm 1
  Window dx, dy;   // gradients, orthogonal to `unit` and to 1
  float norm = 0;  // of the zero-mean template
  Eigen::Matrix2f inverse_hessian;
};

bool normalise(Template* t, Normalised* n) {
  subtract_mean(&t->value);
  n->norm = std::sqrt(dot(t->value, t->value));
  // Flat: less contrast than the noise.
  if (!(n->norm > kMinNoise * kSide)) return false;
  for (std::size_t i = 0; i < kCount; ++i) n->unit[i] = t->value[i] / n->norm;
  const auto free_of_brightness = [n](Window* gradient, Window* out) {
    subtract_mean(gradient);
    const float along = dot(*gradient, n->unit);
    for (std::size_t i = 0; i < kCount; ++i) (*out)[i] = (*gradient)[i] - along * n->unit[i];
  };
  free_of_brightness(&t->dx, &n->dx);
  free_of_brightness(&t->dy, &n->dy);
  const float xx = dot(n->dx, n->dx), xy = dot(n->dx, n->dy), yy = dot(n->dy, n->dy);
  const float determinant = xx * yy - xy * xy;
  if (!(determinant > 1e-6F * (xx + yy) * (xx + yy))) return false;
  n->inverse_hessian << yy, -xy, -xy, xx;
  n->inverse_hessian /= determinant;
  return true;
}

// What one iteration needs of a window: its energy about its mean, and its products with the template.
struct Products {
  float energy, along, dx, dy;
};

// In one pass. The template's parts have zero mean, so that the window's own mean drops out of the products.
Products multiply(const Window& window, const Normalised& n) {
  Float4 total = {}, square = {}, along = {}, dx = {}, dy = {};
  // About some grey level in the middle: the squares then keep their digits.
  const Float4 reference = Float4{} + window[kCount / 2];
  for (std::size_t i = 0; i < kCount; i += 4) {
    const Float4 v = load4(&window[i]) - reference;
    total += v;
    square += v * v;
    along += v * load4(&n.unit[i]);
    dx += v * load4(&n.dx[i]);
    dy += v * load4(&n.dy[i]);
  }
  const float mean_part = sum(total);
  return {sum(square) - mean_part * mean_part / kCount, sum(along), sum(dx), sum(dy)};
}

float largest_eigenvalue(const Eigen::Matrix2f& m) {
  const float mean = 0.5F * (m(0, 0) + m(1, 1)), half = 0.5F * (m(0, 0) - m(1, 1));
  return mean + std::sqrt(half * half + m(0, 1) * m(0, 1));
}

int best_level(const Pyramid& pyramid, float scale) {
  int best = 0;
  for (int l = 1; l < pyramid.levels(); ++l) {
    // Nearest in the ratio.
    if (pyramid.scale(l) * pyramid.scale(l - 1) < scale * scale) best = l;
  }
  return best;
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
  const float determinant = A_target_host.determinant();
  if (host.level >= pyramid_->levels() || !(determinant > 1e-4F)) return result;
  const float host_scale = pyramid_->scale(host.level);
  const int level = best_level(*pyramid_, host_scale * std::sqrt(determinant));
  const float scale = pyramid_->scale(level);
  const Eigen::Matrix2f B = A_target_host.inverse() * (scale / host_scale);
  const float area = B.determinant();
  if (!(area < kMaxScale * kMaxScale && area * kMaxScale * kMaxScale > 1)) return result;

  Template warped;
  Normalised host_template;
  if (!warp_template(host, B, &warped) || !normalise(&warped, &host_template)) return result;

  const ImageView image = pyramid_->level(level);
  const Eigen::Vector2f half(0.5F, 0.5F);
  const Eigen::Vector2f start = (predicted_px + half) / scale - half;
  Eigen::Vector2f p = start;
  Window window;
  float gain = 0, variance = 0;
  bool converged = false;
  for (int iteration = 0; iteration < kMaxIterations && !converged; ++iteration) {
    if (!sample_window(image, p.x(), p.y(), &window)) return result;
    const Products product = multiply(window, host_template);
    gain = product.along / host_template.norm;
    result.zncc = product.energy > 0 ? product.along / std::sqrt(product.energy) : 0;
    // A start half a texture period away shows no or negative correlation: there is no way down from here.
    if (!(result.zncc > 0.1F)) return result;
    Eigen::Vector2f step = host_template.inverse_hessian * Eigen::Vector2f(product.dx, product.dy) / gain;
    const float length = step.norm();
    if (length > kMaxStep) step *= kMaxStep / length;
    p -= step;
    if (!((p - start).squaredNorm() * scale * scale <= max_shift_px * max_shift_px)) return result;
    converged = length < kConverged;
    variance = (product.energy - product.along * product.along) / (kCount - 4);
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

}  // namespace farpoint::slam
