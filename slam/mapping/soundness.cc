// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/soundness.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

namespace farpoint::slam {

namespace {

// Fewest measurements of an affine field, which has six parameters: fewer hardly separate it from chance.
constexpr double kLeastMeasurements = 30.0;

// Least squares of a view's residuals by 1, x, y, where the image reaches from -1 to 1 in x. The weights are
// no inverse variances. The part of independent, equal errors that the field explains is therefore a trace,
// not its number of parameters.
struct Field {
  // Sums of weight, weight^2.
  double weight = 0, weight2 = 0;
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero(), normal2 = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, 2> right = Eigen::Matrix<double, 3, 2>::Zero();
  double squares = 0;       // in sigmas
  double variance_px2 = 0;  // claimed, weighted sum

  void add(const Eigen::Vector3d& place, const Eigen::Vector2d& residual, double sigma_px, double w) {
    weight += w;
    weight2 += w * w;
    normal += w * place * place.transpose();
    normal2 += w * w * place * place.transpose();
    right += w * place * residual.transpose();
    squares += w * residual.squaredNorm();
    variance_px2 += w * sigma_px * sigma_px;
  }
  // Number of equal weights with the same information.
  [[nodiscard]] double measurements() const { return weight2 > 0.0 ? weight * weight / weight2 : 0.0; }
};

// Of one view, in sigmas: variance of one component of the residuals beside the field, mean square of the
// field, which is negative where chance gives more.
struct FieldSize {
  double variance = 0, square = 0;
};

FieldSize size_of(const Field& field) {
  const auto solver = field.normal.ldlt();
  const double explained = solver.solve(field.right).cwiseProduct(field.right).sum();
  const double by_chance = 2.0 * solver.solve(field.normal2).trace();
  const double rest = 2.0 * field.weight - by_chance;
  FieldSize size;
  size.variance = rest > 0.0 ? std::max((field.squares - explained) / rest, 0.0) : 0.0;
  size.square = (explained - by_chance * size.variance) / field.weight;
  return size;
}

// Over views.
struct FieldSums {
  double field_px2 = 0, measurements = 0, sigma_px2 = 0;
  int fields = 0;

  void add(double square_px2, double count, double variance_px2) {
    field_px2 += square_px2;
    measurements += count;
    sigma_px2 += variance_px2;
    ++fields;
  }
  [[nodiscard]] double field_px() const {
    return fields > 0 ? std::sqrt(std::max(field_px2 / fields, 0.0)) : 0.0;
  }
};

Eigen::Vector3d place_of(const BundleProblem& problem, const BundleProblem::Measurement& m) {
  const Camera& camera = problem.rig->cameras[static_cast<std::size_t>(m.camera)].camera;
  const double half_width_px = 0.5 * camera.width_px(), half_height_px = 0.5 * camera.height_px();
  return {1.0, (m.pixel.x() - half_width_px) / half_width_px, (m.pixel.y() - half_height_px) / half_width_px};
}

// Sums over the inliers in free keyframes, one field a view, and chi2 of all measurements there.
struct Residuals {
  std::vector<Field> fields;
  double weight = 0, chi2 = 0;
};

Residuals residuals_of(const BundleProblem& problem) {
  BundleFrames frames;
  frames.update(problem);
  const std::size_t cameras = problem.rig->cameras.size();
  Residuals sums;
  sums.fields.resize(problem.poses.size() * cameras);
  for (const BundleProblem::Point& point : problem.points) {
    const BundleFrames::WorldPoint world = frames.world_point(point);
    for (int i = 0; i < point.measurements; ++i) {
      const int index = point.first_measurement + i;
      const auto& m = problem.measurements[static_cast<std::size_t>(index)];
      const auto pose = static_cast<std::size_t>(m.pose);
      // The host's own sighting has no residual: the landmark lies on its ray.
      if (m.pose == point.host || problem.poses[pose].fixed) continue;
      if (m.camera == 0) {
        sums.weight += point.weight;
        sums.chi2 += point.weight * std::min(m.chi2, kLargestChi2);
      }
      Eigen::Vector2d residual;
      if (m.chi2 <= kChi2TwoDof && residual_world(world, frames.view(m), m, &residual))
        sums.fields[pose * cameras + static_cast<std::size_t>(m.camera)].add(place_of(problem, m), residual,
                                                                             m.sigma_px, point.weight);
    }
  }
  return sums;
}

double mean_chi2_of(const BundleProblem& problem) {
  double sum = 0.0, weight = 0.0;
  for (const BundleProblem::Point& point : problem.points)
    for (int i = 0; i < point.measurements; ++i) {
      const int index = point.first_measurement + i;
      const double chi2 = problem.measurements[static_cast<std::size_t>(index)].chi2;
      sum += point.weight * std::min(chi2, kLargestChi2);
      weight += point.weight;
    }
  return weight > 0.0 ? sum / weight : 0.0;
}

}  // namespace

Refusal Soundness::refusal(bool held_before) const {
  // What a global shutter and a right calibration leave: fields of up to 0.14 px, of coarse pixels and of
  // patches that change with the angle of view. A rolling shutter under fast rotation leaves 0.25 px and
  // more. Excess is 1.0 to 1.3 in rigid scenes.
  const double most_field_px = held_before ? 0.2 : 0.15, most_excess = held_before ? 1.8 : 1.5;
  // Beyond it the patches are not the landmarks' any more, whatever sigma they claim.
  constexpr double kMostNoise_px = 1.0;
  if (field_px > most_field_px) return {Reason::kField, field_px, most_field_px};
  if (excess > most_excess) return {Reason::kExcess, excess, most_excess};
  if (noise_px > kMostNoise_px) return {Reason::kNoise, noise_px, kMostNoise_px};
  return {};
}

bool Soundness::fits_well(bool held_before) const {
  constexpr double kGood = 1.0, kStillGood = 1.1;
  return mean_chi2 <= (held_before ? kStillGood : kGood);
}

Soundness soundness_of(const BundleProblem& problem) {
  // Inliers are cut off at the 95 % quantile of chi2; of normal errors that leaves this part of the variance.
  constexpr double kInlierVariance = 0.842;
  Soundness s;
  s.mean_chi2 = mean_chi2_of(problem);
  const Residuals residuals = residuals_of(problem);
  const std::size_t cameras = problem.rig->cameras.size();
  double weight = 0.0, variance = 0.0, variance_px2 = 0.0;
  FieldSums first, further;
  for (std::size_t i = 0; i < residuals.fields.size(); ++i) {
    const Field& field = residuals.fields[i];
    if (field.measurements() < kLeastMeasurements) continue;
    const FieldSize size = size_of(field);
    const double sigma_px2 = field.variance_px2 / field.weight;
    const bool of_first = i % cameras == 0;
    (of_first ? first : further).add(size.square * sigma_px2, field.measurements(), sigma_px2);
    if (!of_first) continue;
    weight += field.weight;
    variance += field.weight * size.variance;
    variance_px2 += field.weight * size.variance * sigma_px2;
  }
  if (weight <= 0.0 || variance <= 0.0) return s;
  const double noise2 = variance / weight / kInlierVariance;
  s.noise_sigmas = std::sqrt(noise2);
  s.noise_px = std::sqrt(variance_px2 / weight / kInlierVariance);
  s.field_px = first.field_px();
  s.further_field_px = further.field_px();
  if (further.fields > 0) {
    s.further_measurements = further.measurements / further.fields;
    s.further_sigma_px = std::sqrt(further.sigma_px2 / further.fields);
  }
  s.excess = residuals.chi2 / residuals.weight / (2.0 * noise2);
  return s;
}

}  // namespace farpoint::slam
