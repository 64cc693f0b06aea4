// SPDX-License-Identifier: Apache-2.0
#include "slam/tracking/pose_solver.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <random>
#include <vector>

#include "tests/ipc/allocations.h"

namespace farpoint::slam {
namespace {

struct PointOptions {
  double near_m = 4, far_m = 400;
  double noise_px = 0.5;
  double relative_depth_sigma = 0.0;  // of the inverse depth: drawn with it, and given to the solver
};

// A body with two cameras among points anchored a little behind it.
class PoseSolverTest : public testing::Test {
 protected:
  PoseSolverTest() {
    Camera::Parameters p;
    p.width_px = 752, p.height_px = 480;
    p.fx_px = 458, p.fy_px = 457, p.cx_px = 367, p.cy_px = 248;
    p.distortion = {-0.28, 0.07, 0.0002, 0.00002, 0.0};
    rig.cameras.push_back({"front", Camera(p), {q_body_forward_camera(), {0.3, 0.1, 0.2}}});
    p.model = CameraModel::kKannalaBrandt;
    p.distortion = {0.01, -0.005, 0.002, 0.0, 0.0};
    rig.cameras.push_back(
        {"side", Camera(p), SE3{so3_exp({0, 0.1, 0.6}), {0.1, 0.4, 0.0}} * rig.cameras[0].T_body_camera});
  }

  double normal() { return std::normal_distribution<double>()(random); }
  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  }
  Eigen::Vector3d normal3() { return {normal(), normal(), normal()}; }
  SE3 random_pose() { return {so3_exp(normal3()), 10.0 * normal3()}; }
  SE3 disturbed(const SE3& T, double sigma_m, double sigma_rad) {
    Vector6d d;
    d << sigma_m * normal3(), sigma_rad * normal3();
    return T.boxplus(d);
  }

  // One sighting from `truth`, of a random point.
  PoseMeasurement sighting(const SE3& truth, const PointOptions& o, int cameras = 2) {
    for (;;) {
      PoseMeasurement m;
      m.camera = static_cast<int>(uniform(0, cameras - 1e-9));
      const RigCamera& camera = rig.cameras[static_cast<std::size_t>(m.camera)];
      const Eigen::Vector2d pixel(uniform(10, 740), uniform(10, 470));
      Eigen::Vector3d bearing;
      if (!camera.camera.unproject(pixel, &bearing)) continue;
      const SE3 T_world_camera = truth * camera.T_body_camera;
      const Eigen::Vector3d point =
          T_world_camera * (o.near_m * std::pow(o.far_m / o.near_m, uniform(0, 1)) * bearing);
      m.anchor_w = T_world_camera * Eigen::Vector3d(0.3 * normal(), 0.2 * normal(), -uniform(0.5, 2.0));
      const Eigen::Vector3d ray = point - m.anchor_w;
      const double rho = 1.0 / ray.norm();
      m.inverse_depth_sigma = o.relative_depth_sigma * rho;
      place(m, ray, rho + m.inverse_depth_sigma * normal());
      m.pixel = pixel + o.noise_px * Eigen::Vector2d(normal(), normal());
      m.sigma_px = o.noise_px > 0.0 ? o.noise_px : 1.0;
      return m;
    }
  }
  static void place(PoseMeasurement& m, const Eigen::Vector3d& ray, double rho) {
    m.point_w.head<3>() = ray.normalized() + rho * m.anchor_w;
    m.point_w[3] = rho;
  }
  std::vector<PoseMeasurement> sightings(int n, const SE3& truth, const PointOptions& o, int cameras = 2) {
    std::vector<PoseMeasurement> out;
    for (int i = 0; i < n; ++i) out.push_back(sighting(truth, o, cameras));
    return out;
  }
  // Turns a share of the sightings into ones of something else.
  std::vector<bool> spoil(double share, std::vector<PoseMeasurement>* measurements) {
    std::vector<bool> spoilt;
    for (PoseMeasurement& m : *measurements) {
      spoilt.push_back(uniform(0, 1) < share);
      if (spoilt.back()) m.pixel = {uniform(0, 751), uniform(0, 479)};
    }
    return spoilt;
  }

  Rig rig;
  std::mt19937_64 random{17};
};

// --- derivatives
// -------------------------------------------------------------------------------------------------

TEST_F(PoseSolverTest, ResidualDerivativesMatchNumericDifferences) {
  for (int i = 0; i < 200; ++i) {
    const SE3 truth = random_pose();
    PoseMeasurement m = sighting(truth, {});
    if (i % 4 == 0) {  // at infinity
      const Eigen::Vector3d ray = m.point_w.head<3>() - m.point_w[3] * m.anchor_w;
      place(m, ray, 0.0);
    }
    const SE3 T = disturbed(truth, 0.05, 0.01);
    Eigen::Vector2d r, d_rho;
    Eigen::Matrix<double, 2, 6> J;
    ASSERT_TRUE(pose_residual(rig, T, m, &r, &J, &d_rho));
    const auto at = [&](const SE3& pose, const PoseMeasurement& measurement) {
      Eigen::Vector2d residual, unused_rho;
      Eigen::Matrix<double, 2, 6> unused;
      EXPECT_TRUE(pose_residual(rig, pose, measurement, &residual, &unused, &unused_rho));
      return residual;
    };
    constexpr double h = 1e-6;
    for (int k = 0; k < 6; ++k) {
      const Vector6d step = h * Vector6d::Unit(k);
      const Eigen::Vector2d difference = (at(T.boxplus(step), m) - at(T.boxplus(-step), m)) / (2 * h);
      EXPECT_LT((difference - J.col(k)).norm(), 2e-6 * (1.0 + J.norm())) << i << " axis " << k;
    }
    PoseMeasurement nearer = m, further = m;
    nearer.point_w += h * Eigen::Vector4d(m.anchor_w.x(), m.anchor_w.y(), m.anchor_w.z(), 1.0);
    further.point_w -= h * Eigen::Vector4d(m.anchor_w.x(), m.anchor_w.y(), m.anchor_w.z(), 1.0);
    const Eigen::Vector2d difference = (at(T, nearer) - at(T, further)) / (2 * h);
    EXPECT_LT((difference - d_rho).norm(), 2e-6 * (1.0 + d_rho.norm())) << i;
  }
}

TEST_F(PoseSolverTest, ResidualSaysWhatIsBehind) {
  PoseMeasurement m;
  m.point_w = {-1, 0, 0, 0.1};
  Eigen::Vector2d r, d_rho;
  Eigen::Matrix<double, 2, 6> J;
  EXPECT_FALSE(pose_residual(rig, SE3{}, m, &r, &J, &d_rho));
}

// --- the pose
// ----------------------------------------------------------------------------------------------------

TEST_F(PoseSolverTest, ExactMeasurementsGiveTheExactPose) {
  for (int i = 0; i < 20; ++i) {
    const SE3 truth = random_pose();
    PointOptions o;
    o.noise_px = 0.0;
    auto measurements = sightings(100, truth, o);
    const PoseSolution s = solve_pose(rig, disturbed(truth, 0.1, 0.02), measurements);
    ASSERT_TRUE(s.ok);
    EXPECT_EQ(s.inliers, 100);
    EXPECT_LT(truth.boxminus_to(s.T_world_body).norm(), 1e-7);
    EXPECT_LT(s.rms, 1e-5);
  }
}

TEST_F(PoseSolverTest, ThirtyPercentOutliersDoNotMatter) {
  for (int i = 0; i < 50; ++i) {
    const SE3 truth = random_pose();
    auto measurements = sightings(200, truth, {});
    const auto spoilt = spoil(0.3, &measurements);
    const PoseSolution s = solve_pose(rig, disturbed(truth, 0.05, 0.01), measurements);
    ASSERT_TRUE(s.ok) << i;
    const Vector6d error = truth.boxminus_to(s.T_world_body);
    EXPECT_LT(error.head<3>().norm(), 0.03) << i;
    EXPECT_LT(error.tail<3>().norm(), 0.002) << i;
    int wrong_in = 0, right_in = 0, right = 0;
    for (std::size_t k = 0; k < spoilt.size(); ++k) {
      wrong_in += spoilt[k] && measurements[k].inlier ? 1 : 0;
      right_in += !spoilt[k] && measurements[k].inlier ? 1 : 0;
      right += spoilt[k] ? 0 : 1;
    }
    EXPECT_LE(wrong_in, 1) << i;
    EXPECT_GT(right_in, 0.88 * right) << i;
    EXPECT_EQ(s.inliers, wrong_in + right_in);
    // Inliers end below the 95 % quantile: their spread is a little under one sigma.
    EXPECT_NEAR(s.rms, 0.92, 0.1) << i;
  }
}

TEST_F(PoseSolverTest, MeasurementsRuledOutAtTheStartMayComeBack) {
  const SE3 truth = random_pose();
  auto measurements = sightings(60, truth, {});
  for (std::size_t i = 0; i < 30; ++i) measurements[i].inlier = false;
  const PoseSolution s = solve_pose(rig, disturbed(truth, 0.02, 0.003), measurements);
  ASSERT_TRUE(s.ok);
  EXPECT_GT(s.inliers, 50);
}

TEST_F(PoseSolverTest, TooLittleIsNotOk) {
  const SE3 truth = random_pose();
  for (const int n : {0, 1, 3, 5}) {
    auto measurements = sightings(n, truth, {});
    const PoseSolution s = solve_pose(rig, truth, measurements);
    EXPECT_FALSE(s.ok) << n;
    EXPECT_TRUE(s.T_world_body.is_finite());
  }
  // Outliers only.
  auto measurements = sightings(40, truth, {});
  spoil(1.0, &measurements);
  const PoseSolution s = solve_pose(rig, truth, measurements);
  EXPECT_TRUE(s.T_world_body.is_finite());
  EXPECT_LT(s.inliers, 12);
}

TEST_F(PoseSolverTest, NeverGainsByDrivingPastThePoints) {
  // From far behind the true pose the first step overshoots through the points. A pose that sees no point
  // leaves no residual; it must not win by that.
  for (int i = 0; i < 20; ++i) {
    const SE3 truth = random_pose();
    PointOptions o;
    o.near_m = 0.5, o.far_m = 1.0;
    auto measurements = sightings(100, truth, o, 1);
    const SE3 start = truth.boxplus((Vector6d() << -1.0, 0, 0, 0, 0, 0).finished());
    const PoseSolution s = solve_pose(rig, start, measurements);
    EXPECT_TRUE(s.ok) << i;
    EXPECT_LT(truth.boxminus_to(s.T_world_body).norm(), 0.02) << i;
  }
}

TEST_F(PoseSolverTest, TheSameInputGivesTheSameBits) {
  const SE3 truth = random_pose();
  auto a = sightings(100, truth, {});
  spoil(0.2, &a);
  auto b = a;
  const SE3 start = disturbed(truth, 0.05, 0.01);
  const PoseSolution first = solve_pose(rig, start, a), second = solve_pose(rig, start, b);
  EXPECT_EQ(first.T_world_body.t, second.T_world_body.t);
  EXPECT_EQ(first.T_world_body.q.coeffs(), second.T_world_body.q.coeffs());
  EXPECT_EQ(first.covariance, second.covariance);
}

TEST_F(PoseSolverTest, AllocatesNothing) {
  if (!test::counts_allocations()) GTEST_SKIP() << "a sanitizer owns the heap";
  const SE3 truth = random_pose();
  PointOptions o;
  o.relative_depth_sigma = 0.1;
  auto measurements = sightings(300, truth, o);
  spoil(0.2, &measurements);
  const SE3 start = disturbed(truth, 0.05, 0.01);
  const auto before = test::allocations();
  const PoseSolution s = solve_pose(rig, start, measurements);
  const auto after = test::allocations();
  ASSERT_TRUE(s.ok);
  EXPECT_EQ(after - before, 0U);
  EXPECT_GT(before, 0U);  // the count works
}

// --- the prior
// ---------------------------------------------------------------------------------------------------

TEST_F(PoseSolverTest, PriorDerivativesMatchNumericDifferences) {
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 100; ++i) {
    const SE3 prior = random_pose(), T = disturbed(prior, 0.5, i % 3 == 0 ? 1e-5 : 0.6);
    Vector6d r, ahead, behind;
    Matrix6d J, unused;
    prior_residual(prior, T, &r, &J);
    EXPECT_LT((prior.boxplus(r).boxminus_to(T)).norm(), 1e-12);
    for (int k = 0; k < 6; ++k) {
      const Vector6d step = kStep * Vector6d::Unit(k);
      prior_residual(prior, T.boxplus(step), &ahead, &unused);
      prior_residual(prior, T.boxplus(-step), &behind, &unused);
      EXPECT_LT(((ahead - behind) / (2.0 * kStep) - J.col(k)).norm(), 1e-7) << i << " axis " << k;
    }
  }
}

TEST_F(PoseSolverTest, APriorWithoutInformationIsOnlyAStart) {
  const SE3 truth = random_pose();
  auto a = sightings(100, truth, {});
  spoil(0.2, &a);
  auto b = a;
  PosePrior prior;
  prior.T_world_body = disturbed(truth, 0.05, 0.01);
  const PoseSolution first = solve_pose(rig, prior.T_world_body, a), second = solve_pose(rig, prior, b);
  EXPECT_EQ(first.T_world_body.t, second.T_world_body.t);
  EXPECT_EQ(first.T_world_body.q.coeffs(), second.T_world_body.q.coeffs());
  EXPECT_EQ(first.covariance, second.covariance);
}

TEST_F(PoseSolverTest, ACertainPriorIsThePose) {
  const SE3 truth = random_pose();
  auto measurements = sightings(100, truth, {});
  PosePrior prior;
  prior.T_world_body = disturbed(truth, 0.002, 0.0003);  // within the gate of most measurements
  prior.information = 1e14 * Matrix6d::Identity();
  const PoseSolution s = solve_pose(rig, prior, measurements);
  ASSERT_TRUE(s.ok);
  EXPECT_LT(prior.T_world_body.boxminus_to(s.T_world_body).norm(), 1e-7);
  EXPECT_LT(s.covariance.norm(), 1e-13);
}

TEST_F(PoseSolverTest, AVagueOneIsForgotten) {
  const SE3 truth = random_pose();
  auto with = sightings(100, truth, {});
  auto without = with;
  PosePrior prior;
  prior.T_world_body = disturbed(truth, 0.05, 0.01);
  prior.information = 1e-9 * Matrix6d::Identity();
  const PoseSolution a = solve_pose(rig, prior, with), b = solve_pose(rig, prior.T_world_body, without);
  ASSERT_TRUE(a.ok && b.ok);
  EXPECT_LT(a.T_world_body.boxminus_to(b.T_world_body).norm(), 1e-6);
}

TEST_F(PoseSolverTest, InBetweenItIsTheMeanWeightedByInformation) {
  for (int i = 0; i < 20; ++i) {
    const SE3 truth = random_pose();
    PointOptions exact;
    exact.noise_px = 0.0;
    auto measurements = sightings(60, truth, exact);
    auto images_alone = measurements;
    const PoseSolution images = solve_pose(rig, truth, images_alone);
    ASSERT_TRUE(images.ok);
    const Matrix6d information_of_images = images.covariance.inverse();
    PosePrior prior;
    // A tenth of the images' sigma away, so that everything is linear.
    Vector6d away = 0.1 * images.covariance.diagonal().cwiseSqrt();
    prior.T_world_body = truth.boxplus(away);
    prior.information = information_of_images.diagonal().asDiagonal();
    const PoseSolution s = solve_pose(rig, prior, measurements);
    ASSERT_TRUE(s.ok);
    const Matrix6d sum = information_of_images + prior.information;
    const Vector6d expected = sum.ldlt().solve(prior.information * away);
    EXPECT_LT((truth.boxminus_to(s.T_world_body) - expected).norm(), 0.02 * expected.norm()) << i;
    EXPECT_LT((s.covariance - sum.inverse()).norm(), 0.02 * sum.inverse().norm()) << i;
  }
}

// Far apart: one step does not suffice. The optimum is where images and prior pull alike.
TEST_F(PoseSolverTest, ImagesAndPriorBalanceWhereTheSolveEnds) {
  for (int i = 0; i < 20; ++i) {
    const SE3 truth = random_pose();
    PointOptions exact;
    exact.noise_px = 0.0;
    auto measurements = sightings(120, truth, exact);
    for (PoseMeasurement& m : measurements) m.sigma_px = 40.0;  // all take part from afar
    PosePrior prior;
    prior.T_world_body = disturbed(truth, 0.1, 0.05);
    prior.information = 2e4 * Matrix6d::Identity();
    const PoseSolution s = solve_pose(rig, prior, measurements);
    ASSERT_TRUE(s.ok);
    ASSERT_EQ(s.inliers, 120);
    Vector6d r, of_prior, of_images = Vector6d::Zero();
    Matrix6d J;
    prior_residual(prior.T_world_body, s.T_world_body, &r, &J);
    of_prior = J.transpose() * prior.information * r;
    Matrix6d H = J.transpose() * prior.information * J;
    for (const PoseMeasurement& m : measurements) {
      Eigen::Vector2d residual_px, unused;
      Eigen::Matrix<double, 2, 6> d_pose;
      ASSERT_TRUE(pose_residual(rig, s.T_world_body, m, &residual_px, &d_pose, &unused));
      of_images += d_pose.transpose() * residual_px / (m.sigma_px * m.sigma_px);
      H += d_pose.transpose() * d_pose / (m.sigma_px * m.sigma_px);
    }
    // In sigmas: the distance that is left, and the pull of each side.
    const auto sigmas = [&H](const Vector6d& gradient) {
      return std::sqrt(gradient.dot(H.ldlt().solve(gradient)));
    };
    EXPECT_LT(sigmas(of_prior + of_images), 0.05) << i;
    EXPECT_GT(sigmas(of_prior), 0.5) << i;
  }
}

TEST_F(PoseSolverTest, WithAPriorAllocatesNothing) {
  if (!test::counts_allocations()) GTEST_SKIP() << "a sanitizer owns the heap";
  const SE3 truth = random_pose();
  auto measurements = sightings(100, truth, {});
  PosePrior prior;
  prior.T_world_body = truth;
  prior.information = 100.0 * Matrix6d::Identity();
  const auto before = test::allocations();
  const PoseSolution s = solve_pose(rig, prior, measurements);
  const auto after = test::allocations();
  ASSERT_TRUE(s.ok);
  EXPECT_EQ(after - before, 0U);
}

// --- the covariance
// ------------------------------------------------------------------------------------------------

// Mean of error' covariance^-1 error over many solves: six where the covariance is right.
struct Consistency {
  double nees = 0;
  double translation = 0, rotation = 0;  // the same of each half, three where right
};

class PoseCovarianceTest : public PoseSolverTest,
                           public testing::WithParamInterface<std::pair<double, double>> {};
INSTANTIATE_TEST_SUITE_P(OutlierShareAndDepthSigma, PoseCovarianceTest,
                         testing::Values(std::pair{0.0, 0.0}, std::pair{0.0, 0.1}, std::pair{0.2, 0.0},
                                         std::pair{0.2, 0.1}));

TEST_P(PoseCovarianceTest, IsRight) {
  constexpr int kTrials = 600;
  const auto [outliers, depth_sigma] = GetParam();
  Consistency sum;
  for (int i = 0; i < kTrials; ++i) {
    const SE3 truth = random_pose();
    PointOptions o;
    // The covariance is of first order: what ten percent of depth move the nearest must be small beside f.
    o.near_m = 8;
    o.relative_depth_sigma = depth_sigma;
    auto measurements = sightings(120, truth, o);
    spoil(outliers, &measurements);
    const PoseSolution s = solve_pose(rig, disturbed(truth, 0.03, 0.005), measurements);
    ASSERT_TRUE(s.ok);
    const Vector6d e = truth.boxminus_to(s.T_world_body);
    sum.nees += e.dot(s.covariance.inverse() * e);
    sum.translation += e.head<3>().dot(s.covariance.topLeftCorner<3, 3>().inverse() * e.head<3>());
    sum.rotation += e.tail<3>().dot(s.covariance.bottomRightCorner<3, 3>().inverse() * e.tail<3>());
  }
  RecordProperty("nees", std::to_string(sum.nees / kTrials));
  // The mean of 600 has a standard deviation of sqrt(2 * 6 / 600) = 0.14 (three of freedom: 0.10).
  EXPECT_NEAR(sum.nees / kTrials, 6.0, 0.5);
  EXPECT_NEAR(sum.translation / kTrials, 3.0, 0.35);
  EXPECT_NEAR(sum.rotation / kTrials, 3.0, 0.35);
}

// --- the depth's own sigma
// -----------------------------------------------------------------------------------------

TEST_F(PoseSolverTest, WrongDepthsThatSayTheyAreUncertainDoNotBiasThePose) {
  double honest_rad = 0, naive_rad = 0, honest_m = 0, naive_m = 0;
  constexpr int kTrials = 40;
  for (int i = 0; i < kTrials; ++i) {
    const SE3 truth = random_pose();
    PointOptions near, far;
    near.near_m = 4, near.far_m = 15;
    far.near_m = 2000, far.far_m = 20000;
    auto measurements = sightings(150, truth, near);
    // All near points are taken 30 % too far away: together they pull one way.
    for (PoseMeasurement& m : measurements) {
      const Eigen::Vector3d ray = m.point_w.head<3>() - m.point_w[3] * m.anchor_w;
      m.inverse_depth_sigma = 0.3 * m.point_w[3];
      place(m, ray, m.point_w[3] / 1.3);
    }
    for (const PoseMeasurement& m : sightings(40, truth, far)) measurements.push_back(m);
    auto naive = measurements;
    for (PoseMeasurement& m : naive) m.inverse_depth_sigma = 0.0;
    const SE3 start = disturbed(truth, 0.03, 0.005);
    const PoseSolution s = solve_pose(rig, start, measurements), n = solve_pose(rig, start, naive);
    ASSERT_TRUE(s.ok);
    const Vector6d e = truth.boxminus_to(s.T_world_body), e_naive = truth.boxminus_to(n.T_world_body);
    honest_rad += e.tail<3>().squaredNorm(), naive_rad += e_naive.tail<3>().squaredNorm();
    honest_m += e.head<3>().squaredNorm(), naive_m += e_naive.head<3>().squaredNorm();
    // The far points give the rotation, and its reported sigma is small.
    EXPECT_LT(std::sqrt(s.covariance.diagonal().tail<3>().maxCoeff()), 1e-3);
    EXPECT_LT(e.tail<3>().norm(), 3e-3) << i;
  }
  honest_rad = std::sqrt(honest_rad / kTrials), naive_rad = std::sqrt(naive_rad / kTrials);
  honest_m = std::sqrt(honest_m / kTrials), naive_m = std::sqrt(naive_m / kTrials);
  RecordProperty("honest_rad", std::to_string(honest_rad));
  RecordProperty("naive_rad", std::to_string(naive_rad));
  RecordProperty("honest_m", std::to_string(honest_m));
  RecordProperty("naive_m", std::to_string(naive_m));
  EXPECT_LT(honest_rad, 1e-3);
  EXPECT_LT(honest_m, 0.5 * naive_m);
}

TEST_F(PoseSolverTest, FarPointsAlonePinRotationAndSayThatTranslationIsOpen) {
  const SE3 truth = random_pose();
  PointOptions far;
  far.near_m = 1000, far.far_m = 5000;
  auto measurements = sightings(100, truth, far);
  const PoseSolution s = solve_pose(rig, disturbed(truth, 0.1, 0.01), measurements);
  ASSERT_TRUE(s.ok);
  // 100 points at 0.5 px and f = 458: about 0.1 mrad about the axes across the view, three times that along
  // it.
  EXPECT_LT(truth.boxminus_to(s.T_world_body).tail<3>().norm(), 1e-3);
  EXPECT_LT(s.covariance.diagonal().tail<3>().maxCoeff(), 1e-6);
  EXPECT_GT(s.covariance.diagonal().head<3>().minCoeff(), 0.01);
}

}  // namespace
}  // namespace farpoint::slam
