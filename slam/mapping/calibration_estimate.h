// SPDX-License-Identifier: Apache-2.0
// A calibration's parameters, estimated window by window against what was given: shared by Calibrator and
// RigCalibrator.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>

namespace farpoint::slam {

// Vector: parameters relative to the given calibration.
template <int kSize>
class CalibrationEstimate {
 public:
  using Vector = Eigen::Matrix<double, kSize, 1>;
  using Square = Eigen::Matrix<double, kSize, kSize>;

  // prior_sigma: 1 sigma of the given calibration.
  explicit CalibrationEstimate(const Vector& prior_sigma)
      : prior_(prior_sigma.cwiseAbs2().cwiseInverse().asDiagonal()), information_(prior_) {}

  // Takes a window's information matrix and gradient at delta(). `keyframes`: how many windows see one
  // keyframe, about. Returns the best parameters by all windows; nothing where they are not determined.
  [[nodiscard]] std::optional<Vector> take(const Square& H, const Vector& g, double keyframes) {
    const Square total = information_ + H;
    const Vector right = information_vector_ + H * delta_ - g;
    const Vector best = total.ldlt().solve(right);
    if (!best.allFinite()) return std::nullopt;
    // Kept: the share of this window that no later window will see again; what was kept before fades.
    information_ = prior_ + kRemembered * (information_ - prior_) + H / keyframes;
    information_vector_ = kRemembered * information_vector_ + (H * delta_ - g) / keyframes;
    constexpr double kContradicts = 5.0, kAgrees = 3.0;
    contradicts_given_ = surprise() > (contradicts_given_ ? kAgrees : kContradicts);
    return best;
  }
  // These parameters are in use from here on.
  void use(const Vector& delta) { delta_ = delta; }

  // The parameters in use.
  [[nodiscard]] const Vector& delta() const { return delta_; }
  // 1 sigma of delta.
  [[nodiscard]] Vector sigma() const { return information_.inverse().diagonal().cwiseSqrt(); }
  // Distance of what the windows alone ask for from the given calibration, in standard deviations
  // (Mahalanobis): of the windows' information and the prior's together. A tight prior hides nothing from it,
  // as it does from delta(), which hardly moves then.
  [[nodiscard]] double surprise() const {
    const Square of_images = information_ - prior_;
    const Square covariance = of_images + of_images * prior_.inverse() * of_images;
    return std::sqrt(std::max(0.0, information_vector_.dot(covariance.ldlt().solve(information_vector_))));
  }
  // What the windows alone ask for, without the prior.
  [[nodiscard]] Vector wanted_by_images() const {
    const Square of_images = information_ - prior_;
    const Vector wanted = of_images.ldlt().solve(information_vector_);
    return wanted.allFinite() ? wanted : Vector::Zero();
  }
  // The given calibration is of another camera, focus or resolution: what is that far off has not been
  // refined, only bent towards what fits. From 5 sigma, and until 3: the recordings' right calibrations were
  // never further off than 1.8, a focal length that is 10 % wrong is 8 off.
  [[nodiscard]] bool contradicts_given() const { return contradicts_given_; }

 private:
  // Of what windows said, this share is remembered from one to the next, about 50 windows. Each spoke of a
  // map that the calibration of its day had bent; kept for good, the first of them would outvote all that
  // come later.
  static constexpr double kRemembered = 0.98;

  Vector delta_ = Vector::Zero();
  bool contradicts_given_ = false;
  Square prior_, information_;  // what is kept, the prior included
  Vector information_vector_ = Vector::Zero();
};

// Moves of the image below this are not worth another calibration.
inline constexpr double kNoticeable_px = 0.05;

}  // namespace farpoint::slam
