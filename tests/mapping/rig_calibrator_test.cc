// SPDX-License-Identifier: Apache-2.0
// The rig's refinement over made-up windows: points seen by two cameras along a way, at the optimum of poses
// and depths under a rig that is a little wrong.
#include "slam/mapping/rig_calibrator.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "slam/solver/schur_solver.h"
#include "tests/image/test_images.h"

namespace farpoint::slam {
namespace {

constexpr int kPoses = 12, kPoints = 400;

Rig given_rig() {
  Camera::Parameters p;
  p.width_px = 1240, p.height_px = 376;
  p.fx_px = p.fy_px = 720, p.cx_px = 610, p.cy_px = 180;
  Rig rig;
  rig.cameras.push_back({"left", Camera(p), {q_body_forward_camera(), {0, 0.27, 0}}});
  rig.cameras.push_back({"right", Camera(p), {q_body_forward_camera(), {0, -0.27, 0}}});
  return rig;
}

Rig with_error(const Eigen::Vector3d& rotation, double k1) {
  Rig rig = given_rig();
  CalibrationDelta delta = CalibrationDelta::Zero();
  delta[3] = k1;
  for (RigCamera& c : rig.cameras) c.camera = refined_camera(c.camera, delta);
  SE3& T = rig.cameras[1].T_body_camera;
  T.q = T.q * so3_exp(rotation);
  return rig;
}

SE3 pose_at(int i) {
  return {so3_exp({0.002 * i, -0.003 * (i % 3), 0.01 * i}), {0.8 * i, 0.004 * i * i, 0.01 * (i % 2)}};
}

// A window of what the true rig shows, described by the rig that is believed.
class MadeUpWindow {
 public:
  MadeUpWindow(const Rig& truth, std::uint64_t seed) : random_(seed) {
    for (int i = 0; i < kPoses; ++i) problem.poses.push_back({pose_at(i), i == 0});
    for (int i = 0; i < kPoints; ++i) add_point(truth);
  }
  // Poses and depths at their optimum under the rig.
  void adjust(const Rig& believed) {
    problem.rig = &believed;
    for (std::size_t i = 0; i < problem.points.size(); ++i) {
      BundleProblem::Point& p = problem.points[i];
      Eigen::Matrix<double, 3, 2> d;
      ASSERT_TRUE(believed.cameras[0].camera.unproject(host_pixels_[i], &p.bearing, &d));
      d_bearing[i] = d;
    }
    BundleOptions options;
    options.iterations = 20;
    options.relative_decrease = 1e-8;
    ASSERT_TRUE(SchurSolver().solve(options, &problem).usable);
  }

  BundleProblem problem;
  std::vector<Eigen::Matrix<double, 3, 2>> d_bearing;

 private:
  [[nodiscard]] bool look(const Rig& rig, int pose, int camera, const Eigen::Vector3d& point,
                          Eigen::Vector2d* pixel) const {
    const RigCamera& c = rig.cameras[static_cast<std::size_t>(camera)];
    return c.camera.project((pose_at(pose) * c.T_body_camera).inverse() * point, pixel) &&
           c.camera.in_image(*pixel, 5.0);
  }
  void add_point(const Rig& truth) {
    const int host = static_cast<int>(uniform(0.0, kPoses - 1e-9));
    const double range = 1.0 / uniform(1.0 / 60.0, 1.0 / 6.0);
    const Eigen::Vector3d point =
        pose_at(host) * Eigen::Vector3d(range, range * uniform(-0.7, 0.7), range * uniform(-0.22, 0.22));
    Eigen::Vector2d host_pixel;
    if (!look(truth, host, 0, point, &host_pixel)) return;
    BundleProblem::Point p;
    p.host = host;
    p.T_host_anchor = truth.cameras[0].T_body_camera;
    p.inverse_depth = 1.0 / ((pose_at(host) * p.T_host_anchor).inverse() * point).norm();
    p.first_measurement = static_cast<int>(problem.measurements.size());
    for (int i = std::max(0, host - 3); i < std::min(kPoses, host + 4); ++i)
      for (int c = 0; c < 2; ++c) {
        Eigen::Vector2d pixel;
        if ((i == host && c == 0) || !look(truth, i, c, point, &pixel)) continue;
        BundleProblem::Measurement m;
        m.pose = i;
        m.camera = c;
        m.pixel = pixel + 0.2 * Eigen::Vector2d(testing::normal(random_), testing::normal(random_));
        m.sigma_px = 0.5;
        problem.measurements.push_back(m);
      }
    p.measurements = static_cast<int>(problem.measurements.size()) - p.first_measurement;
    if (p.measurements == 0) return;
    problem.points.push_back(p);
    host_pixels_.push_back(host_pixel);
    d_bearing.emplace_back();
  }

  [[nodiscard]] double uniform(double from, double to) {
    return from + (to - from) * testing::uniform(random_);
  }

  std::mt19937_64 random_;
  std::vector<Eigen::Vector2d> host_pixels_;
};

// A few windows, as a drive gives them.
RigCalibrator refined(const Rig& truth) {
  RigCalibrator calibrator(CalibrationConfig{}, given_rig());
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    MadeUpWindow window(truth, seed);
    window.adjust(calibrator.rig());
    (void)calibrator.update(window.problem, window.d_bearing);
  }
  return calibrator;
}

TEST(RigCalibrator, LeavesARightRigAlone) {
  const RigCalibrator calibrator = refined(given_rig());
  EXPECT_LT(calibrator.delta().tail<3>().norm(), 3e-4);
  EXPECT_LT(calibrator.delta().head<2>().norm(), 0.003);
  EXPECT_FALSE(calibrator.contradicts_given());
}

TEST(RigCalibrator, FindsATurnedCamera) {
  const Eigen::Vector3d rotation(0.0006, -0.0012, 0.0009);
  const RigCalibrator calibrator = refined(with_error(rotation, 0.0));
  EXPECT_LT((calibrator.delta().tail<3>() - rotation).norm(), 4e-4) << calibrator.delta().transpose();
  EXPECT_FALSE(calibrator.contradicts_given());
}

TEST(RigCalibrator, FindsTheDistortionThatRectificationLeft) {
  const RigCalibrator calibrator = refined(with_error(Eigen::Vector3d::Zero(), -0.013));
  for (int c = 0; c < 2; ++c) EXPECT_NEAR(calibrator.delta()[c], -0.013, 0.004) << c;
  EXPECT_LT(calibrator.delta().tail<3>().norm(), 4e-4);
}

// About its vertical axis, that is: turned about another one it shows nothing on the curves, and there is no
// map.
TEST(RigCalibrator, SaysThatACameraTurnedByTwoDegreesIsAnotherRig) {
  constexpr double kTwoDegrees_rad = 0.035;
  EXPECT_TRUE(refined(with_error({0.0, kTwoDegrees_rad, 0.0}, 0.0)).contradicts_given());
}

}  // namespace
}  // namespace farpoint::slam
