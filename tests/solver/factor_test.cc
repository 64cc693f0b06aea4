// SPDX-License-Identifier: Apache-2.0
#include "slam/solver/factor.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <array>

#include "slam/solver/ceres_solver.h"
#include "slam/solver/schur_solver.h"
#include "tests/solver/bundle_scene.h"
#include "tests/solver/factor_support.h"

namespace farpoint::slam {
namespace {

// A factor over every kind of state, with a residual of known derivatives: velocity drives the body from one
// pose to the next for a second, gravity and scale enter as in an inertial factor.
class DriftFactor final : public StateFactor {
 public:
  DriftFactor(int from, int to, int motion, int gravity, int scale, Eigen::Vector3d measured)
      : blocks_{StateBlock::pose(from), StateBlock::pose(to), StateBlock::motion(motion),
                StateBlock::global(gravity), StateBlock::global(scale)},
        measured_(std::move(measured)) {}

  [[nodiscard]] std::span<const StateBlock> blocks() const override { return blocks_; }
  [[nodiscard]] int residuals() const override { return 3; }
  [[nodiscard]] double huber_delta() const override { return 3.0; }
  void evaluate(const StateWindow& s, FactorResidual* r, FactorJacobian* J) const override {
    const SE3& a = s.T_world_body(blocks_[0].index);
    const SE3& b = s.T_world_body(blocks_[1].index);
    const MotionState& m = s.motion(blocks_[2].index);
    const GlobalState& gravity = s.global(blocks_[3].index);
    const double scale = s.global(blocks_[4].index).value.x();
    const Eigen::Vector3d in_world = scale * (b.t - a.t) - m.velocity_world + kGravity * gravity.value;
    const Eigen::Vector3d in_body = a.q.conjugate() * in_world;
    *r = kInverseSigma * (in_body + m.accelerometer_bias_m_per_s2 - measured_);
    if (J == nullptr) return;
    const Eigen::Matrix3d R_body_world = a.rotation().transpose();
    J->block<3, 3>(0, 0) = -scale * Eigen::Matrix3d::Identity();
    J->block<3, 3>(0, 3) = skew(in_body);
    J->block<3, 3>(0, 6) = scale * R_body_world * b.rotation();
    J->block<3, 3>(0, 12) = -R_body_world;
    J->block<3, 3>(0, 18) = Eigen::Matrix3d::Identity();
    J->block<3, 2>(0, 21) = -kGravity * R_body_world * skew(gravity.value) * gravity.tangent();
    J->col(23) = scale * R_body_world * (b.t - a.t);
    *J *= kInverseSigma;
  }

 private:
  static constexpr double kGravity = 9.81, kInverseSigma = 20.0;
  std::array<StateBlock, 5> blocks_;
  Eigen::Vector3d measured_;
};

// Holds one block of any kind to its present value: what keeps states determined.
class HoldFactor final : public StateFactor {
 public:
  HoldFactor(StateBlock block, const BundleProblem& at, double sigma)
      : block_{block}, size_(at.states().size(block)), at_(at), sigma_(sigma) {}
  [[nodiscard]] std::span<const StateBlock> blocks() const override { return block_; }
  [[nodiscard]] int residuals() const override { return size_; }
  void evaluate(const StateWindow& s, FactorResidual* r, FactorJacobian* J) const override {
    const int i = block_[0].index;
    if (J != nullptr) *J = Eigen::MatrixXd::Identity(size_, size_) / sigma_;
    if (block_[0].kind == StateBlock::Kind::kMotion) {
      const MotionState &m = s.motion(i), &n = at_.states().motion(i);
      *r << m.velocity_world - n.velocity_world, m.gyroscope_bias_rad_per_s - n.gyroscope_bias_rad_per_s,
          m.accelerometer_bias_m_per_s2 - n.accelerometer_bias_m_per_s2;
      *r /= sigma_;
    } else if (s.global(i).kind == GlobalState::Kind::kDirection) {
      *r = at_.states().global(i).tangent().transpose() * (s.global(i).value - at_.states().global(i).value) /
           sigma_;
      // The turn d about tangent() moves the direction by (tangent d) x value.
      if (J != nullptr)
        *J = -at_.states().global(i).tangent().transpose() * skew(s.global(i).value) * s.global(i).tangent() /
             sigma_;
    } else {
      (*r)[0] = std::log(s.global(i).value.x() / at_.states().global(i).value.x()) / sigma_;
    }
  }

 private:
  std::array<StateBlock, 1> block_;
  int size_;
  const BundleProblem& at_;
  double sigma_;
};

// A drive with images, and drift factors from each pose to the next.
class DriftScene {
 public:
  explicit DriftScene(const SceneOptions& options) : scene(options) {
    BundleProblem& truth = scene.truth;
    truth.globals = {GlobalState::direction({0.05, -0.1, -1.0}), GlobalState::positive(1.7)};
    for (std::size_t i = 0; i + 1 < truth.poses.size(); ++i)
      truth.motions.push_back({scene.normal3(), 0.1 * scene.normal3(), 0.1 * scene.normal3()});
    truth.motions.front().fixed = true;
    factors.reserve(truth.motions.size());
    for (int i = 0; i < static_cast<int>(truth.motions.size()); ++i) {
      const DriftFactor zero(i, i + 1, i, 0, 1, Eigen::Vector3d::Zero());
      factors.emplace_back(i, i + 1, i, 0, 1, Eigen::Vector3d(residual_of(zero, truth) / 20.0));
    }
    holds.reserve(truth.motions.size() + 2);
    for (int i = 0; i < static_cast<int>(truth.motions.size()); ++i)
      holds.emplace_back(StateBlock::motion(i), truth, 0.05);
    for (int i = 0; i < 2; ++i) holds.emplace_back(StateBlock::global(i), truth, 0.02);
    for (BundleProblem* p : {&truth, &scene.start}) {
      p->motions = truth.motions;
      p->globals = truth.globals;
      for (const DriftFactor& factor : factors) p->factors.push_back(&factor);
      for (const HoldFactor& hold : holds) p->factors.push_back(&hold);
    }
    for (MotionState& m : scene.start.motions)
      if (!m.fixed) m.velocity_world += 0.1 * scene.normal3();
    scene.start.globals[0].move({0.02, -0.03});
    scene.start.globals[1].move({0.05, 0.0});
  }

  BundleScene scene;
  std::vector<DriftFactor> factors;
  std::vector<HoldFactor> holds;
};

SceneOptions small_scene() {
  SceneOptions o;
  o.poses = 7, o.points = 120, o.infinite_share = 0.0, o.far_m = 60.0;
  return o;
}

// --- states
// ---------------------------------------------------------------------------------------------

TEST(GlobalState, DirectionStaysAUnitVectorAndTurnsByTheStep) {
  for (const Eigen::Vector3d& v :
       {Eigen::Vector3d(0, 0, -1), Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0.3, -0.5, 0.8)}) {
    GlobalState g = GlobalState::direction(v);
    const Eigen::Vector3d before = g.value;
    EXPECT_NEAR((g.tangent().transpose() * g.value).norm(), 0.0, 1e-15);
    EXPECT_NEAR((g.tangent().transpose() * g.tangent() - Eigen::Matrix2d::Identity()).norm(), 0.0, 1e-15);
    g.move({0.3, 0.4});
    EXPECT_NEAR(g.value.norm(), 1.0, 1e-15);
    EXPECT_NEAR(std::acos(g.value.dot(before)), 0.5, 1e-12);
  }
}

TEST(GlobalState, PositiveStaysPositive) {
  GlobalState g = GlobalState::positive(2.0);
  g.move({-5.0, 0.0});
  EXPECT_NEAR(g.value.x(), 2.0 * std::exp(-5.0), 1e-15);
  g.move({5.0, 0.0});
  EXPECT_NEAR(g.value.x(), 2.0, 1e-14);
}

TEST(StateLayout, PosesComeFirstAndFixedStatesHaveNoPlace) {
  BundleProblem p;
  p.poses = {{SE3{}, true}, {SE3{}, false}, {SE3{}, false}};
  p.motions.resize(3);
  p.motions[1].fixed = true;
  p.globals = {GlobalState::real(1), GlobalState::direction({0, 0, 1}), GlobalState::positive(1)};
  p.globals[0].fixed = true;
  StateLayout layout;
  layout.update(p.states());
  EXPECT_EQ(layout.offset(StateBlock::pose(0)), -1);
  EXPECT_EQ(layout.offset(StateBlock::pose(2)), 6);
  EXPECT_EQ(layout.offset(StateBlock::motion(0)), 12);
  EXPECT_EQ(layout.offset(StateBlock::motion(1)), -1);
  EXPECT_EQ(layout.offset(StateBlock::motion(2)), 21);
  EXPECT_EQ(layout.offset(StateBlock::global(0)), -1);
  EXPECT_EQ(layout.offset(StateBlock::global(1)), 30);
  EXPECT_EQ(layout.offset(StateBlock::global(2)), 32);
  EXPECT_EQ(layout.entries(), 33);
}

TEST(StateFactor, DerivativesByAllKindsOfStatesMatchNumericDifferences) {
  DriftScene s(small_scene());
  for (const StateFactor* factor : s.scene.start.factors) expect_jacobian(*factor, s.scene.start);
}

// --- the solve
// ------------------------------------------------------------------------------------------

TEST(SchurSolverWithFactors, FindsTheTruthOfAllStates) {
  SceneOptions options = small_scene();
  options.noise_px = 0.0;
  DriftScene s(options);
  BundleProblem p = s.scene.start;
  const BundleSummary summary = solve_schur({100, 1e-30}, &p);
  ASSERT_TRUE(summary.usable);
  EXPECT_GT(summary.initial_cost, 100.0);
  EXPECT_LT(summary.final_cost, 1e-12);
  for (std::size_t i = 0; i < p.motions.size(); ++i)
    EXPECT_LT((p.motions[i].velocity_world - s.scene.truth.motions[i].velocity_world).norm(), 1e-6) << i;
  EXPECT_LT((p.globals[0].value - s.scene.truth.globals[0].value).norm(), 1e-6);
  EXPECT_NEAR(p.globals[1].value.x(), 1.7, 1e-6);
}

TEST(SchurSolverWithFactors, EndsWhereCeresEnds) {
  DriftScene s(small_scene());
  BundleProblem a = s.scene.start, b = s.scene.start;
  const BundleSummary schur = solve_schur({300, 1e-13}, &a), ceres = solve_ceres({300, 1e-13}, &b);
  ASSERT_TRUE(schur.usable && ceres.usable);
  EXPECT_NEAR(schur.initial_cost, ceres.initial_cost, 1e-9 * ceres.initial_cost);
  EXPECT_NEAR(schur.final_cost, ceres.final_cost, 1e-8 * ceres.final_cost);
  for (std::size_t i = 0; i < a.poses.size(); ++i)
    EXPECT_LT(a.poses[i].T_world_body.boxminus_to(b.poses[i].T_world_body).norm(), 1e-4) << i;
  for (std::size_t i = 0; i < a.motions.size(); ++i) {
    EXPECT_LT((a.motions[i].velocity_world - b.motions[i].velocity_world).norm(), 1e-4) << i;
    EXPECT_LT((a.motions[i].accelerometer_bias_m_per_s2 - b.motions[i].accelerometer_bias_m_per_s2).norm(),
              1e-4)
        << i;
  }
  for (std::size_t i = 0; i < 2; ++i) EXPECT_LT((a.globals[i].value - b.globals[i].value).norm(), 1e-4) << i;
  EXPECT_GT((a.globals[1].value - s.scene.start.globals[1].value).norm(), 1e-3);  // it moved
}

// Ten times the arc tangent of a number and of a velocity: from 3, Gauss-Newton goes beyond -9.
class OvershootFactor final : public StateFactor {
 public:
  [[nodiscard]] std::span<const StateBlock> blocks() const override { return blocks_; }
  [[nodiscard]] int residuals() const override { return 2; }
  void evaluate(const StateWindow& s, FactorResidual* r, FactorJacobian* J) const override {
    const double x = s.global(0).value.x(), v = s.motion(0).velocity_world.x();
    *r << 10.0 * std::atan(x), 10.0 * std::atan(v);
    if (J == nullptr) return;
    (*J)(0, 0) = 10.0 / (1.0 + x * x);
    (*J)(1, 1) = 10.0 / (1.0 + v * v);
  }

 private:
  std::array<StateBlock, 2> blocks_{StateBlock::global(0), StateBlock::motion(0)};
};

TEST(SchurSolverWithFactors, ARefusedStepLeavesAllStatesWhereTheyWere) {
  const Rig rig;
  const OvershootFactor factor;
  BundleProblem start;
  start.rig = &rig;
  start.globals = {GlobalState::real(3.0)};
  start.motions.resize(1);
  start.motions[0].velocity_world.x() = 3.0;
  start.factors = {&factor};
  BundleProblem p = start;
  const BundleSummary one = solve_schur({1, 1e-9}, &p);
  EXPECT_EQ(one.final_cost, one.initial_cost);
  EXPECT_EQ(p.globals[0].value.x(), 3.0);
  EXPECT_EQ(p.motions[0].velocity_world.x(), 3.0);
  const BundleSummary all = solve_schur({60, 1e-15}, &p);
  EXPECT_LT(all.final_cost, 1e-12);
  EXPECT_NEAR(p.globals[0].value.x(), 0.0, 1e-6);
  EXPECT_NEAR(p.motions[0].velocity_world.x(), 0.0, 1e-6);
}

TEST(SchurSolverWithFactors, FixedStatesStay) {
  DriftScene s(small_scene());
  BundleProblem p = s.scene.start;
  p.globals[1].fixed = true;
  (void)solve_schur({20, 1e-9}, &p);
  EXPECT_EQ(p.globals[1].value, s.scene.start.globals[1].value);
  EXPECT_EQ(p.motions[0].velocity_world, s.scene.start.motions[0].velocity_world);
  EXPECT_NE(p.motions[1].velocity_world, s.scene.start.motions[1].velocity_world);
}

TEST(SchurSolverWithFactors, StatesThatNothingMeasuresStay) {
  BundleScene scene(small_scene());
  BundleProblem with = scene.start, without = scene.start;
  with.motions.resize(2);
  with.globals = {GlobalState::positive(3.0)};
  (void)solve_schur({8, 1e-4}, &with);
  (void)solve_schur({8, 1e-4}, &without);
  EXPECT_EQ(with.globals[0].value.x(), 3.0);
  for (std::size_t i = 0; i < with.poses.size(); ++i)
    EXPECT_LT(with.poses[i].T_world_body.boxminus_to(without.poses[i].T_world_body).norm(), 1e-9);
}

// --- covariances
// ----------------------------------------------------------------------------------------

// Gauss-Newton Hessian of everything that is free, inverse depths last; weights as in the solve.
Eigen::MatrixXd dense_hessian(const BundleProblem& p, const StateLayout& layout) {
  const auto n = static_cast<Eigen::Index>(layout.entries());
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(n + static_cast<Eigen::Index>(p.points.size()),
                                            n + static_cast<Eigen::Index>(p.points.size()));
  const auto add = [&H](const Eigen::MatrixXd& J, double weight) { H += weight * J.transpose() * J; };
  for (std::size_t k = 0; k < p.points.size(); ++k)
    for (int i = 0; i < p.points[k].measurements; ++i) {
      const int index = p.points[k].first_measurement + i;
      const auto& m = p.measurements[static_cast<std::size_t>(index)];
      BundleLinearisation lin;
      if (!linearise(p, p.points[k], m, &lin)) continue;
      Eigen::MatrixXd J = Eigen::MatrixXd::Zero(2, H.cols());
      const int host = layout.offset(StateBlock::pose(p.points[k].host)),
                target = layout.offset(StateBlock::pose(m.pose));
      if (host >= 0) J.middleCols<6>(host) += lin.d_host;
      if (target >= 0) J.middleCols<6>(target) += lin.d_target;
      J.col(n + static_cast<Eigen::Index>(k)) = lin.d_inverse_depth;
      add(J, p.points[k].weight * huber_weight(lin.residual.squaredNorm()));
    }
  for (const StateFactor* factor : p.factors) {
    const FactorJacobian by_block = jacobian_of(*factor, p);
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(factor->residuals(), H.cols());
    int first = 0;
    for (const StateBlock block : factor->blocks()) {
      const int size = p.states().size(block), at = layout.offset(block);
      if (at >= 0) J.middleCols(at, size) = by_block.middleCols(first, size);
      first += size;
    }
    add(J, huber_weight(residual_of(*factor, p).squaredNorm(), factor->huber_delta()));
  }
  return H;
}

const std::array kChosen = {StateBlock::pose(3), StateBlock::global(1), StateBlock::motion(4),
                            StateBlock::pose(5), StateBlock::global(0)};

// Largest difference, each entry in units of its two sigmas' product.
double difference(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  const Eigen::VectorXd s = b.diagonal().cwiseSqrt().cwiseInverse();
  return (s.asDiagonal() * (a - b) * s.asDiagonal()).cwiseAbs().maxCoeff();
}

TEST(SchurCovariance, IsTheDenseInverseOfTheWholeSystem) {
  SceneOptions options = small_scene();
  options.outlier_share = 0.05;
  options.least_weight = 0.3;
  DriftScene s(options);
  BundleProblem p = s.scene.start;
  (void)solve_schur({60, 1e-12}, &p);
  StateLayout layout;
  layout.update(p.states());
  const Eigen::MatrixXd whole = dense_hessian(p, layout).ldlt().solve(
      Eigen::MatrixXd::Identity(layout.entries() + static_cast<Eigen::Index>(p.points.size()),
                                layout.entries() + static_cast<Eigen::Index>(p.points.size())));
  std::vector<Eigen::Index> entries;
  for (const StateBlock block : kChosen)
    for (int k = 0; k < p.states().size(block); ++k) entries.push_back(layout.offset(block) + k);
  Eigen::MatrixXd covariance;
  ASSERT_TRUE(SchurSolver().covariance(p, kChosen, &covariance));
  EXPECT_LT(difference(covariance, whole(entries, entries)), 1e-6);
}

TEST(SchurCovariance, IsCeresCovariance) {
  SceneOptions options = small_scene();
  options.noise_px = 0.0;
  DriftScene s(options);
  // At the truth all residuals are zero: there the two weigh alike.
  Eigen::MatrixXd schur, ceres;
  ASSERT_TRUE(SchurSolver().covariance(s.scene.truth, kChosen, &schur));
  ASSERT_TRUE(covariance_ceres(s.scene.truth, kChosen, &ceres));
  EXPECT_LT(difference(schur, ceres), 1e-6);
}

TEST(SchurCovariance, OfAFixedStateIsZero) {
  DriftScene s(small_scene());
  const std::array blocks = {StateBlock::pose(0), StateBlock::pose(4)};
  Eigen::MatrixXd covariance;
  ASSERT_TRUE(SchurSolver().covariance(s.scene.truth, blocks, &covariance));
  EXPECT_EQ(covariance.rows(), 12);
  EXPECT_TRUE(covariance.topRows<6>().isZero(0.0));
  EXPECT_TRUE((covariance.diagonal().tail<6>().array() > 0.0).all());
  for (BundleProblem::Pose& pose : s.scene.truth.poses) pose.fixed = true;
  BundleProblem fixed = s.scene.truth;
  fixed.motions.clear(), fixed.globals.clear(), fixed.factors.clear();
  ASSERT_TRUE(SchurSolver().covariance(fixed, blocks, &covariance));
  EXPECT_TRUE(covariance.isZero(0.0));
}

TEST(SchurCovariance, RefusesWhatNothingDetermines) {
  SceneOptions options = small_scene();
  options.fixed = 0;  // seven directions are free
  BundleScene scene(options);
  Eigen::MatrixXd covariance;
  const std::array blocks = {StateBlock::pose(2)};
  EXPECT_FALSE(SchurSolver().covariance(scene.truth, blocks, &covariance));
  options.fixed = 2;
  BundleScene held(options);
  EXPECT_TRUE(SchurSolver().covariance(held.truth, blocks, &covariance));
  held.truth.motions.resize(1);  // measured by nothing
  EXPECT_FALSE(SchurSolver().covariance(held.truth, blocks, &covariance));
}

}  // namespace
}  // namespace farpoint::slam
