// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/soundness.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <vector>

namespace farpoint::slam {

namespace {

// Fewest measurements of an affine field, which has six parameters: fewer hardly separate it from chance.
constexpr double kLeastMeasurements = 30.0;

// Least squares of a keyframe's residuals by 1, x, y, where the image reaches from -1 to 1 in x.
struct Field {
  // Sums of weight, weight^2.
  double weight = 0, weight2 = 0;
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero(), normal2 = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, 2> right = Eigen::Matrix<double, 3, 2>::Zero();
  double squares = 0;

  void add(const Eigen::Vector3d& place, const Eigen::Vector2d& residual, double w) {
    weight += w;
    weight2 += w * w;
    normal += w * place * place.transpose();
    normal2 += w * w * place * place.transpose();
    right += w * place * residual.transpose();
    squares += w * residual.squaredNorm();
  }
  // Number of equal weights with the same information.
  [[nodiscard]] double measurements() const { return weight2 > 0.0 ? weight * weight / weight2 : 0.0; }
  // The weights are no inverse variances. The part of independent, equal errors that the field explains is
  // therefore a trace, not its number of parameters.
  [[nodiscard]] double f_statistic() const {
    const auto solver = normal.ldlt();
    const double explained = solver.solve(right).cwiseProduct(right).sum();
    const double by_chance = 2.0 * solver.solve(normal2).trace(), rest = 2.0 * weight - by_chance;
    return (explained / by_chance) / std::max((squares - explained) / rest, 1e-12);
  }
};

Eigen::Vector3d place_of(const BundleProblem& problem, const BundleProblem::Measurement& m) {
  const Camera& camera = problem.rig->cameras[static_cast<std::size_t>(m.camera)].camera;
  const double half_width_px = 0.5 * camera.width_px(), half_height_px = 0.5 * camera.height_px();
  return {1.0, (m.pixel.x() - half_width_px) / half_width_px, (m.pixel.y() - half_height_px) / half_width_px};
}

double coherence_of(const BundleProblem& problem) {
  BundleFrames frames;
  frames.update(problem);
  const std::size_t cameras = problem.rig->cameras.size();
  std::vector<Field> fields(problem.poses.size() * cameras);  // one an image
  for (const BundleProblem::Point& point : problem.points) {
    const BundleFrames::WorldPoint world = frames.world_point(point);
    for (int i = 0; i < point.measurements; ++i) {
      const int index = point.first_measurement + i;
      const auto& m = problem.measurements[static_cast<std::size_t>(index)];
      const auto pose = static_cast<std::size_t>(m.pose);
      // The host's own sighting has no residual: the landmark lies on its ray.
      if (m.pose == point.host || problem.poses[pose].fixed || m.chi2 > kChi2TwoDof) continue;
      Eigen::Vector2d residual;
      if (residual_world(world, frames.view(m), m, &residual))
        fields[pose * cameras + static_cast<std::size_t>(m.camera)].add(place_of(problem, m), residual,
                                                                        point.weight);
    }
  }
  double sum = 0.0;
  int count = 0;
  for (const Field& field : fields)
    if (field.measurements() >= kLeastMeasurements) sum += field.f_statistic(), ++count;
  return count > 0 ? sum / count : 0.0;
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

bool Soundness::holds(bool held_before) const {
  // Residuals may be large because pixels are coarse or leaves move: with a global shutter and a right
  // calibration the mean is 0.4 to 1.2. They may also have a pattern that is too small to matter, where the
  // measurements are good: mean times coherence is 0.4 to 1.8 then, and up to 2.8 for a moment. A rolling
  // shutter under fast rotation shows means of 1 to 3, and 1.5 to 15. Neither alone is enough: after a while
  // the bent map fits well, with a pattern.
  constexpr double kChi2 = 1.3, kStillChi2 = 1.5;
  constexpr double kPattern = 2.0, kStillPattern = 3.0;
  return mean_chi2 <= (held_before ? kStillChi2 : kChi2) &&
         pattern() <= (held_before ? kStillPattern : kPattern);
}

bool Soundness::fits_well(bool held_before) const {
  constexpr double kGood = 1.0, kStillGood = 1.1;
  return mean_chi2 <= (held_before ? kStillGood : kGood);
}

Soundness soundness_of(const BundleProblem& problem) {
  return {mean_chi2_of(problem), coherence_of(problem)};
}

}  // namespace farpoint::slam
