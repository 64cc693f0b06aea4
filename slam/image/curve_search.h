// SPDX-License-Identifier: Apache-2.0
// Where another camera shows what a patch shows: search along the epipolar curve, then alignment to a
// fraction of a pixel. For any two cameras of known places, rectified or not.
#pragma once

#include <array>

#include "slam/geometry/camera.h"
#include "slam/geometry/se3.h"
#include "slam/image/feature.h"

namespace farpoint::slam {

// The patch, and the ray that it was seen on.
struct CurveQuery {
  const Patch* patch = nullptr;
  Eigen::Vector3d bearing = Eigen::Vector3d::UnitZ();  // unit, axes of the patch's camera
  Eigen::Matrix<double, 3, 2> d_bearing_d_pixel = Eigen::Matrix<double, 3, 2>::Zero();
  float level_scale = 1.0F;  // level-0 pixels a pixel of the patch
  // Depths searched, 1 / units of the motion between the cameras.
  double min_inverse_depth = 0.0, max_inverse_depth = 0.0;
};

struct CurveMatch {
  bool ok = false;
  Eigen::Vector2f pixel = Eigen::Vector2f::Zero();  // measured, level 0
  float sigma_px = 1.0F;                            // its error, level-0 pixels
  float zncc = 0.0F;
};

// Searches one image. Bounded work: at most kMostSamples correlations and two alignments a patch. Makes no
// heap call. Deterministic; any thread.
class CurveSearch {
 public:
  static constexpr int kMostSamples = 320;

  // `target` and `image` must outlive the search. T_target_host: of the cameras.
  CurveSearch(const Camera& target, const SE3& T_target_host, const FrameImage& image)
      : target_(target), image_(image), R_(T_target_host.rotation()), t_(T_target_host.t) {}

  // Not ok where nothing on the curve looks like the patch, where two places on it look alike, or where the
  // place found lies beside the curve.
  [[nodiscard]] CurveMatch find(const CurveQuery& query) const;

 private:
  struct Samples;
  struct Place;

  [[nodiscard]] bool place_at(const CurveQuery& query, double inverse_depth, Place* place) const;
  [[nodiscard]] bool sample(const CurveQuery& query, Samples* samples) const;
  static void find_peaks(const Samples& samples, std::array<int, 2>* peaks);
  [[nodiscard]] bool is_on_curve(const CurveQuery& query, double inverse_depth,
                                 const Eigen::Vector2f& pixel) const;
  [[nodiscard]] Alignment align_at(const CurveQuery& query, double inverse_depth) const;

  const Camera& target_;
  const FrameImage& image_;
  const Eigen::Matrix3d R_;
  const Eigen::Vector3d t_;
};

}  // namespace farpoint::slam
