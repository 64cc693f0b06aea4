// SPDX-License-Identifier: Apache-2.0
#include "slam/map/predict.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "tests/map/map_fixture.h"

namespace farpoint::slam {
namespace {

// --- predict
// -----------------------------------------------------------------------------------------------------------

// A landmark in one keyframe's camera and another camera that looks at it.
struct Sight {
  Eigen::Vector2d host_pixel;
  double rho = 0;
  SE3 T_world_anchor, T_camera_world;
  int host_camera = 0, camera = 0;
};

class PredictTest : public testing::Test {
 protected:
  // The pixel, by geometry alone.
  std::optional<Eigen::Vector2d> pixel_of(const Sight& s, const Eigen::Vector2d& host_pixel,
                                          double rho) const {
    Eigen::Vector3d f;
    if (!model(s.host_camera).unproject(host_pixel, &f)) return {};
    const SE3 T = s.T_camera_world * s.T_world_anchor;
    Eigen::Vector2d pixel;
    if (!model(s.camera).project(T.q * f + rho * T.t, &pixel)) return {};
    return pixel;
  }

  PredictionInput input(const Sight& s) const {
    PredictionInput in;
    const auto bearing = [&](double du, double dv) {
      Eigen::Vector3d f;
      EXPECT_TRUE(model(s.host_camera).unproject(s.host_pixel + Eigen::Vector2d(du, dv), &f));
      return f;
    };
    const Eigen::Matrix3d R = s.T_world_anchor.rotation();
    in.point_w.head<3>() = R * bearing(0, 0) + s.rho * s.T_world_anchor.t;
    in.point_w[3] = s.rho;
    in.anchor_w = s.T_world_anchor.t;
    in.d_point_d_pixel.col(0) = R * (bearing(1e-3, 0) - bearing(-1e-3, 0)) / 2e-3;
    in.d_point_d_pixel.col(1) = R * (bearing(0, 1e-3) - bearing(0, -1e-3)) / 2e-3;
    return in;
  }

  Sight random_sight() {
    Sight s;
    s.host_camera = static_cast<int>(random.below(2));
    s.camera = static_cast<int>(random.below(2));
    s.host_pixel = {random.uniform(20, 620), random.uniform(20, 460)};
    s.rho = random.below(5) == 0 ? 0.0 : 1.0 / (3.0 * std::pow(1000.0, random.uniform(0, 1)));
    s.T_world_anchor = random_pose(&random);
    // The other camera stands within a metre or so and looks nearly the same way.
    const SE3 T_anchor_camera{so3_exp(random.vector(0.15)), random.vector(1.0)};
    s.T_camera_world = (s.T_world_anchor * T_anchor_camera).inverse();
    return s;
  }

  [[nodiscard]] const Camera& model(int i) const { return rig.cameras[static_cast<std::size_t>(i)].camera; }

  Rig rig = two_camera_rig();
  Random random{7};
};

TEST_F(PredictTest, MatchesGeometryAndNumericDifferences) {
  int seen = 0, infinite = 0;
  for (int i = 0; i < 2000; ++i) {
    const Sight s = random_sight();
    const auto pixel = pixel_of(s, s.host_pixel, s.rho);
    Prediction p;
    const bool visible = predict(input(s), model(s.camera), s.T_camera_world, 10.0, &p);
    ASSERT_EQ(visible, pixel && model(s.camera).in_image(*pixel, 10.0)) << i;
    if (!visible) continue;
    ++seen;
    infinite += s.rho == 0.0 ? 1 : 0;
    EXPECT_LT((p.pixel - *pixel).norm(), 1e-9);
    constexpr double h = 1e-3;
    for (int axis = 0; axis < 2; ++axis) {
      const Eigen::Vector2d step = h * Eigen::Vector2d::Unit(axis);
      const Eigen::Vector2d difference =
          (*pixel_of(s, s.host_pixel + step, s.rho) - *pixel_of(s, s.host_pixel - step, s.rho)) / (2 * h);
      EXPECT_LT((p.A_target_host.col(axis).cast<double>() - difference).norm(), 1e-4) << i;
    }
    constexpr double d = 1e-6;
    const Eigen::Vector2d by_depth =
        (*pixel_of(s, s.host_pixel, s.rho + d) - *pixel_of(s, s.host_pixel, s.rho - d)) / (2 * d);
    EXPECT_LT((p.d_pixel_d_inverse_depth - by_depth).norm(), 1e-4 * (1.0 + by_depth.norm())) << i;
    if (HasFailure()) return;
  }
  EXPECT_GT(seen, 1000);
  EXPECT_GT(infinite, 200);
}

TEST_F(PredictTest, ScaleIsTheRatioOfDistancesAndCosineTheAngleOfRays) {
  for (int i = 0; i < 500; ++i) {
    const Sight s = random_sight();
    Prediction p;
    const PredictionInput in = input(s);
    if (s.rho == 0.0 || !predict(in, model(s.camera), s.T_camera_world, 0.0, &p)) continue;
    const Eigen::Vector3d point = in.point_w.head<3>() / s.rho;
    const Eigen::Vector3d from_host = point - s.T_world_anchor.t,
                          from_here = point - s.T_camera_world.inverse().t;
    EXPECT_NEAR(p.scale_change, from_host.norm() / from_here.norm(), 1e-5 * p.scale_change);
    EXPECT_NEAR(p.view_cosine, from_host.normalized().dot(from_here.normalized()), 1e-9);
  }
}

TEST_F(PredictTest, AtInfinityNothingChangesWithTranslation) {
  Sight s = random_sight();
  s.rho = 0.0;
  s.host_camera = s.camera = 0;
  s.host_pixel = {320, 240};
  s.T_world_anchor = SE3{};
  s.T_camera_world = SE3{Eigen::Quaterniond::Identity(), {100, -50, 30}};
  Prediction p;
  ASSERT_TRUE(predict(input(s), model(0), s.T_camera_world, 0.0, &p));
  EXPECT_LT((p.pixel - s.host_pixel).norm(), 1e-6);
  EXPECT_FLOAT_EQ(p.scale_change, 1.0F);
  EXPECT_NEAR(p.view_cosine, 1.0, 1e-12);
  EXPECT_LT((p.A_target_host - Eigen::Matrix2f::Identity()).norm(), 1e-4F);
}

TEST_F(PredictTest, BehindOrOutsideIsNotSeen) {
  PredictionInput in;
  in.point_w = {0, 0, -1, 0.1};
  Prediction p;
  EXPECT_FALSE(predict(in, model(0), SE3{}, 0.0, &p));
  in.point_w = {0, 0, 1, 0.1};
  EXPECT_TRUE(predict(in, model(0), SE3{}, 0.0, &p));
  // The principal point is 239 px from the upper edge.
  EXPECT_TRUE(predict(in, model(0), SE3{}, 238.0, &p));
  EXPECT_FALSE(predict(in, model(0), SE3{}, 240.0, &p));
}

TEST_F(PredictTest, TheMapsOwnDerivativeGivesThePrediction) {
  CapacityConfig capacity;
  capacity.keyframes = 2, capacity.landmarks = 200;
  Map map(capacity, rig);
  const KeyframeHandle k = map.add_keyframe(make_keyframe(rig, 0, random_pose(&random), 100, &random));
  int seen = 0;
  for (std::size_t f = 0; f < 100; ++f) {
    const LandmarkHandle h = map.add_landmark(k, 0, f);
    Landmark& l = map.landmarks()[h];
    l.inverse_depth = 0.1;
    const SE3 T_world_anchor = map.T_world_anchor(l);
    PredictionInput in;
    in.point_w = map.world_point(l);
    in.anchor_w = T_world_anchor.t;
    in.d_point_d_pixel = T_world_anchor.rotation() * l.d_bearing_d_pixel;
    Prediction p;
    // Seen from its own camera every corner is where and as it was.
    if (!predict(in, rig.cameras[0].camera, map.T_world_camera(map.keyframes()[k], 0).inverse(), 0.0, &p))
      continue;
    ++seen;
    const Feature& feature = map.keyframes()[k].views[0].set.features[f];
    EXPECT_LT((p.pixel - Eigen::Vector2d(feature.u_px, feature.v_px)).norm(), 1e-3);
    EXPECT_LT((p.A_target_host - Eigen::Matrix2f::Identity()).norm(), 1e-3F);
    EXPECT_LT(p.d_pixel_d_inverse_depth.norm(), 1e-6);
    EXPECT_NEAR(p.scale_change, 1.0F, 1e-5F);
  }
  EXPECT_EQ(seen, 100);
}

// --- levels and limits
// ------------------------------------------------------------------------------------------------

TEST(PredictedLevel, FollowsTheScale) {
  EXPECT_EQ(predicted_level(2, 1.0F, 1.2F, 8), 2);
  EXPECT_EQ(predicted_level(2, 1.2F, 1.2F, 8), 3);
  EXPECT_EQ(predicted_level(2, 1.0F / 1.2F, 1.2F, 8), 1);
  EXPECT_EQ(predicted_level(2, 1.2F * 1.2F * 1.2F, 1.2F, 8), 5);
  EXPECT_EQ(predicted_level(2, 1.09F, 1.2F, 8), 2);  // less than half a level
  EXPECT_EQ(predicted_level(2, 1.10F, 1.2F, 8), 3);  // more
  EXPECT_EQ(predicted_level(2, 100.0F, 1.2F, 8), 7);
  EXPECT_EQ(predicted_level(2, 0.001F, 1.2F, 8), 0);
  EXPECT_EQ(predicted_level(5, 0.0F, 1.2F, 8), 0);
}

TEST(IsMatchable, WithinSixtyDegreesOfTheAnchorsRay) {
  Prediction p;
  p.view_cosine = 0.51;
  EXPECT_TRUE(is_matchable(p));
  p.view_cosine = 0.49;
  EXPECT_FALSE(is_matchable(p));
}

TEST(IsMatchable, BetweenAThirdAndThreeTimesTheSize) {
  Prediction p;
  for (const float change : {0.31F, 1.0F, 3.2F}) {
    p.scale_change = change;
    EXPECT_TRUE(is_matchable(p)) << change;
  }
  for (const float change : {0.0F, 0.29F, 3.4F}) {
    p.scale_change = change;
    EXPECT_FALSE(is_matchable(p)) << change;
  }
}

}  // namespace
}  // namespace farpoint::slam
