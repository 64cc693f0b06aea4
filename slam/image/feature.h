// SPDX-License-Identifier: Apache-2.0
// What one image gives the estimator: corners, descriptors, and patches for sub-pixel measurement.
#pragma once

#include <Eigen/Core>
#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

namespace farpoint::slam {

// A grey 8-bit image, owned by the caller. Rows are `stride_bytes` apart.
struct ImageView {
  const std::uint8_t* data = nullptr;
  int width_px = 0, height_px = 0;
  int stride_bytes = 0;
};

// 256-bit oriented binary descriptor; compared by Hamming distance.
struct Descriptor {
  std::array<std::uint64_t, 4> words{};
  [[nodiscard]] bool operator==(const Descriptor&) const = default;
};

// Number of differing bits, 0..256.
[[nodiscard]] inline int hamming_distance(const Descriptor& a, const Descriptor& b) {
  int sum = 0;
  for (std::size_t i = 0; i < 4; ++i) sum += std::popcount(a.words[i] ^ b.words[i]);
  return sum;
}

// One corner. (u, v) are level-0 pixels; on its own pyramid level a corner sits on a whole pixel, so that
// u_px = (level pixel + 0.5) * scale - 0.5 and the patch around it is a plain copy.
struct Feature {
  float u_px = 0, v_px = 0;
  float angle_rad = 0;     // orientation of the patch (intensity centroid), -pi..pi
  float score = 0;         // corner strength, larger is stronger
  std::uint8_t level = 0;  // pyramid level, 0 is full resolution
};

// The surroundings of a corner on its pyramid level: kSize x kSize pixels, row-major, the corner at index
// (kCentre, kCentre). The estimator passes it on unread: only a FrameImage of the kind that made it reads
// it.
struct Patch {
  static constexpr int kSize = 16;
  static constexpr int kCentre = 8;
  std::array<std::uint8_t, kSize * kSize> pixels{};
  std::uint8_t level = 0;
};

// Outcome of the alignment of a host patch with an image.
struct Alignment {
  bool ok = false;
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  // level-0 pixel of the host's corner in this image
  float sigma_px = 0;                               // expected error of `pixel`, level-0 pixels, 1 sigma
  float zncc = 0;  // zero-mean normalised cross correlation at the end, -1..1
};

// Corners and descriptors of one image, in one fixed order (deterministic); both vectors have the same length
// and keep their capacity from frame to frame.
struct FeatureSet {
  std::vector<Feature> features;
  std::vector<Descriptor> descriptors;
};

// The pixels of a frame, for patches and alignment. Two kinds exist: a pyramid of a real image
// (PyramidImage), and the feature-level simulator of the tests, which computes what alignment would have
// measured.
class FrameImage {
 public:
  virtual ~FrameImage() = default;
  // Copy of the surroundings of feature `index` of this image. False where it is too close to the edge.
  [[nodiscard]] virtual bool extract_patch(const FeatureSet& set, std::size_t index, Patch* patch) const = 0;
  // Aligns `host` with this image. `A_target_host`: derivative of this image's level-0 pixel by the host
  // image's level-0 pixel (2x2) at the corner; `predicted_px`: where to start. Inverse compositional,
  // translation + gain + offset, on the pyramid level of this image on which the warped patch has about its
  // own resolution. Not ok where it leaves the image, does not converge, moves further than max_shift_px
  // (level-0), or correlates badly.
  [[nodiscard]] virtual Alignment align(const Patch& host, const Eigen::Matrix2f& A_target_host,
                                        const Eigen::Vector2f& predicted_px, float max_shift_px) const = 0;
  // Zero-mean normalised cross correlation of the warped `host` with this image at each of `pixels` (level
  // 0), to the nearest pixel of the level that align() reads; -1 where the image ends or is masked. A search,
  // not a measurement. False where the patch cannot be warped, or this image cannot be searched.
  [[nodiscard]] virtual bool correlate(const Patch& /*host*/, const Eigen::Matrix2f& /*A_target_host*/,
                                       std::span<const Eigen::Vector2f> /*pixels*/,
                                       std::span<float> /*zncc*/) const {
    return false;
  }
};

}  // namespace farpoint::slam
