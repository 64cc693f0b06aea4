// SPDX-License-Identifier: Apache-2.0
// Cameras: round trips over the whole image, derivatives against differences, refusals, checks.
#include "slam/geometry/camera.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "tests/geometry/random_geometry.h"

namespace farpoint::slam {
namespace {

using testing::direction;
using testing::Rng;
using testing::uniform;

struct NamedCamera {
  std::string name;
  Camera::Parameters p;
  double margin_px = 0.0;  // how far beyond the image round trips are asked for
};

Camera::Parameters radtan(int w, int h, double fx, double fy, double cx, double cy, std::array<double, 5> d) {
  return {CameraModel::kPinholeRadtan, w, h, fx, fy, cx, cy, d};
}

// The first three with the calibrations published with the data sets, the others made up to be extreme.
std::vector<NamedCamera> cameras() {
  return {
      {"EuRoC", radtan(752, 480, 458.654, 457.296, 367.215, 248.375,
                       {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05, 0})},
      {"TUM fr1",
       radtan(640, 480, 517.306408, 516.469215, 318.643040, 255.313989,
              {0.262383, -0.953104, -0.005358, 0.002628, 1.163314}),
       50},
      {"KITTI", radtan(1241, 376, 718.856, 718.856, 607.1928, 185.2157, {}), 500},
      {"tangential", radtan(640, 480, 400, 410, 330, 230, {-0.1, 0.02, 0.02, -0.015, 0})},
      {"fisheye 180",
       {CameraModel::kKannalaBrandt,
        1000,
        1000,
        318.0,
        318.0,
        499.5,
        499.5,
        {0.01, -0.005, 0.002, -0.0003, 0}}},
      {"fisheye TUM-VI",
       {CameraModel::kKannalaBrandt,
        512,
        512,
        190.978,
        190.973,
        254.932,
        256.897,
        {0.0034823894, 0.00071504, -0.0020532361, 0.00020293673, 0}}},
  };
}

class CameraRoundTrip : public ::testing::TestWithParam<NamedCamera> {};

TEST_P(CameraRoundTrip, PixelToRayToPixelOverTheWholeImage) {
  const Camera camera(GetParam().p);
  const double m = GetParam().margin_px;
  int rays = 0, pixels = 0;
  for (int i = 0; i <= 60; ++i) {
    for (int k = 0; k <= 60; ++k) {
      const Eigen::Vector2d pixel(-m + (camera.width_px() - 1 + 2 * m) * i / 60.0,
                                  -m + (camera.height_px() - 1 + 2 * m) * k / 60.0);
      ++pixels;
      Eigen::Vector3d bearing;
      if (!camera.unproject(pixel, &bearing)) continue;
      ++rays;
      EXPECT_NEAR(bearing.norm(), 1.0, 1e-15);
      Eigen::Vector2d back;
      ASSERT_TRUE(camera.project(7.5 * bearing, &back)) << pixel.transpose();
      // 1e-9 rad is 1e-9 f px; these come back far better.
      EXPECT_LT((back - pixel).norm(), 1e-9) << pixel.transpose();
    }
  }
  EXPECT_EQ(rays, pixels);
}

TEST_P(CameraRoundTrip, RayToPixelToRay) {
  const Camera camera(GetParam().p);
  Rng rng(1);
  int seen = 0;
  for (int i = 0; i < 5000; ++i) {
    const Eigen::Vector3d bearing = direction(rng);
    Eigen::Vector2d pixel;
    if (!camera.project(bearing * uniform(rng, 0.01, 1e4), &pixel) || !camera.in_image(pixel)) continue;
    ++seen;
    Eigen::Vector3d back;
    ASSERT_TRUE(camera.unproject(pixel, &back));
    // Nothing folds: the ray that comes back is the one that went in.
    EXPECT_LT((back - bearing).norm(), 1e-9) << bearing.transpose();
  }
  EXPECT_GT(seen, 100);
}

TEST_P(CameraRoundTrip, DerivativeMatchesDifferences) {
  const Camera camera(GetParam().p);
  Rng rng(2);
  int checked = 0;
  while (checked < 300) {
    const Eigen::Vector2d pixel(uniform(rng, 0, camera.width_px() - 1),
                                uniform(rng, 0, camera.height_px() - 1));
    Eigen::Vector3d bearing;
    ASSERT_TRUE(camera.unproject(pixel, &bearing));
    const Eigen::Vector3d point = bearing * uniform(rng, 0.5, 20.0);
    Eigen::Vector2d same;
    Matrix23d j;
    ASSERT_TRUE(camera.project(point, &same, &j));
    const double step = 1e-5 * point.norm();
    for (Eigen::Index c = 0; c < 3; ++c) {
      Eigen::Vector3d more = point, less = point;
      more(c) += step;
      less(c) -= step;
      Eigen::Vector2d u, v;
      if (!camera.project(more, &u) || !camera.project(less, &v)) continue;
      EXPECT_LT((j.col(c) - (u - v) / (2 * step)).norm() * point.norm(), 1e-4)
          << point.transpose() << " column " << c;
    }
    // Moving along the ray moves no pixel.
    EXPECT_LT((j * point).norm(), 1e-9);
    ++checked;
  }
}

TEST_P(CameraRoundTrip, DerivativeOfTheBearingMatchesDifferences) {
  const Camera camera(GetParam().p);
  Rng rng(3);
  constexpr double kStep_px = 1e-3;
  int checked = 0;
  while (checked < 300) {
    const Eigen::Vector2d pixel(uniform(rng, 1, camera.width_px() - 2),
                                uniform(rng, 1, camera.height_px() - 2));
    Eigen::Vector3d bearing;
    Eigen::Matrix<double, 3, 2> d;
    ASSERT_TRUE(camera.unproject(pixel, &bearing, &d));
    for (Eigen::Index c = 0; c < 2; ++c) {
      const Eigen::Vector2d step = kStep_px * Eigen::Vector2d::Unit(c);
      Eigen::Vector3d more, less;
      if (!camera.unproject(pixel + step, &more) || !camera.unproject(pixel - step, &less)) continue;
      EXPECT_LT((d.col(c) - (more - less) / (2 * kStep_px)).norm() * camera.focal_px(), 1e-5)
          << pixel.transpose() << " column " << c;
    }
    // It stays on the unit sphere.
    EXPECT_LT((bearing.transpose() * d).norm() * camera.focal_px(), 1e-9);
    ++checked;
  }
}

TEST_P(CameraRoundTrip, IsSoundOnAndNextToTheAxis) {
  const Camera camera(GetParam().p);
  const Eigen::Vector2d centre(camera.parameters().cx_px, camera.parameters().cy_px);
  for (const double off : {0.0, 1e-300, 1e-20, 1e-12, 1e-8}) {
    Eigen::Vector2d pixel;
    Matrix23d j;
    ASSERT_TRUE(camera.project({2.0 * off, -2.0 * off, 2.0}, &pixel, &j));
    EXPECT_LT((pixel - centre).norm(), 2e-5);  // 1e-8 rad in x and y at f = 719
    ASSERT_TRUE(j.allFinite()) << off;
    EXPECT_NEAR(j(0, 0), camera.parameters().fx_px / 2.0, 1e-3);
    EXPECT_NEAR(j(1, 1), camera.parameters().fy_px / 2.0, 1e-3);
    Eigen::Vector3d bearing;
    ASSERT_TRUE(camera.unproject(centre + Eigen::Vector2d(off, off), &bearing));
    EXPECT_LT((bearing - Eigen::Vector3d::UnitZ()).norm(), 1e-9);
  }
}

TEST_P(CameraRoundTrip, PassesItsCheck) {
  EXPECT_EQ(Camera::check(GetParam().p), "");
}

INSTANTIATE_TEST_SUITE_P(All, CameraRoundTrip, ::testing::ValuesIn(cameras()),
                         [](const ::testing::TestParamInfo<NamedCamera>& i) {
                           std::string name = i.param.name;
                           std::replace_if(
                               name.begin(), name.end(), [](char c) { return c == ' ' || c == '-'; }, '_');
                           return name;
                         });

TEST(Camera, FollowsTheDefinitionsOfItsModels) {
  // By hand, x = 0.3, y = -0.2: r2 = 0.13.
  const Camera pinhole(radtan(1000, 1000, 100, 200, 500, 400, {0.1, 0.2, 0.01, 0.02, 0.3}));
  const double radial = 1 + 0.1 * 0.13 + 0.2 * 0.13 * 0.13 + 0.3 * 0.13 * 0.13 * 0.13;
  const double x = 0.3 * radial + 2 * 0.01 * 0.3 * -0.2 + 0.02 * (0.13 + 2 * 0.09);
  const double y = -0.2 * radial + 0.01 * (0.13 + 2 * 0.04) + 2 * 0.02 * 0.3 * -0.2;
  Eigen::Vector2d pixel;
  ASSERT_TRUE(pinhole.project({0.6, -0.4, 2.0}, &pixel));
  EXPECT_NEAR(pixel.x(), 100 * x + 500, 1e-12);
  EXPECT_NEAR(pixel.y(), 200 * y + 400, 1e-12);

  // An angle of 1 rad from the axis, towards x.
  const Camera fisheye(
      {CameraModel::kKannalaBrandt, 1000, 1000, 100, 100, 500, 400, {0.1, -0.02, 0.003, -0.0004, 0}});
  ASSERT_TRUE(fisheye.project({3 * std::sin(1.0), 0.0, 3 * std::cos(1.0)}, &pixel));
  EXPECT_NEAR(pixel.x(), 100 * (1 + 0.1 - 0.02 + 0.003 - 0.0004) + 500, 1e-12);
  EXPECT_NEAR(pixel.y(), 400, 1e-12);
}

TEST(Camera, RefusesPointsBehindAPinhole) {
  const Camera camera(cameras()[2].p);
  Eigen::Vector2d pixel;
  EXPECT_FALSE(camera.project({0.0, 0.0, -1.0}, &pixel));
  EXPECT_FALSE(camera.project({0.1, 0.0, 0.0}, &pixel));
  EXPECT_FALSE(camera.project({0.0, 0.0, 0.0}, &pixel));
  EXPECT_FALSE(camera.project({1.0, 0.0, 1e-4}, &pixel));
  EXPECT_FALSE(camera.project({std::nan(""), 0.0, 1.0}, &pixel));
  EXPECT_FALSE(camera.project({0.0, 0.0, std::nan("")}, &pixel));
  EXPECT_TRUE(camera.project({0.0, 0.0, 1e-3}, &pixel));
}

TEST(Camera, SeesBeyondNinetyDegreesWithAFisheyeOnly) {
  const Camera camera(cameras()[4].p);
  Eigen::Vector2d pixel;
  Eigen::Vector3d bearing;
  const Eigen::Vector3d aside(std::sin(1.6), 0.0, std::cos(1.6));
  ASSERT_LT(aside.z(), 0.0);
  ASSERT_TRUE(camera.project(aside, &pixel));
  ASSERT_TRUE(camera.unproject(pixel, &bearing));
  EXPECT_LT((bearing - aside).norm(), 1e-9);
  EXPECT_FALSE(camera.project({0.0, 0.0, -1.0}, &pixel));
  EXPECT_FALSE(camera.project({0.0, 0.0, 0.0}, &pixel));
}

TEST(Camera, NeverFoldsFarOffAxisPointsBackIntoTheImage) {
  // With k1 alone the distorted radius turns back at r = 1 / sqrt(-3 k1) = 1.08 (47 degrees): a point at 65
  // degrees would land in the image, among points it has nothing to do with.
  const Camera camera(radtan(752, 480, 458, 458, 375, 240, {-0.2834, 0, 0, 0, 0}));
  const double r = std::tan(65.0 / 57.29578);
  const double folded_px = 458 * r * (1 - 0.2834 * r * r);
  ASSERT_LT(std::abs(folded_px), 376.0);
  Eigen::Vector2d pixel;
  EXPECT_FALSE(camera.project({r, 0.0, 1.0}, &pixel));
  // Just inside the limit it projects, and farther out than anything nearer the axis.
  double last = 0.0;
  for (double x = 0.01; x < 1.07; x += 0.01) {
    ASSERT_TRUE(camera.project({x, 0.0, 1.0}, &pixel)) << x;
    EXPECT_GT(pixel.x(), last);
    last = pixel.x();
  }
  EXPECT_FALSE(camera.project({1.09, 0.0, 1.0}, &pixel));
  // A pixel beyond the largest distorted radius has no ray.
  Eigen::Vector3d bearing;
  EXPECT_FALSE(camera.unproject({375.0 + 458.0, 240.0}, &bearing));
  EXPECT_FALSE(camera.unproject({std::nan(""), 240.0}, &bearing));
}

TEST(Camera, KnowsTheImageBorder) {
  const Camera camera(cameras()[2].p);
  EXPECT_TRUE(camera.in_image({0.0, 0.0}));
  EXPECT_TRUE(camera.in_image({1240.0, 375.0}));
  EXPECT_FALSE(camera.in_image({1240.01, 375.0}));
  EXPECT_FALSE(camera.in_image({-0.01, 100.0}));
  EXPECT_FALSE(camera.in_image({9.9, 100.0}, 10.0));
  EXPECT_TRUE(camera.in_image({10.0, 100.0}, 10.0));
  EXPECT_FALSE(camera.in_image({std::nan(""), 100.0}));
}

TEST(Camera, CheckSaysWhatIsWrong) {
  const Camera::Parameters good = cameras()[0].p;
  const auto message = [&](auto change) {
    Camera::Parameters p = good;
    change(p);
    return Camera::check(p);
  };
  const auto says = [](const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
  };
  const double nan = std::nan(""), infinity = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(says(message([](auto& p) { p.width_px = 0; }), "width is 0"));
  EXPECT_TRUE(says(message([](auto& p) { p.height_px = -480; }), "height is -480"));
  EXPECT_TRUE(says(message([](auto& p) { p.fx_px = -458; }), "fx is -458"));
  EXPECT_TRUE(says(message([&](auto& p) { p.fy_px = nan; }), "fy is nan"));
  EXPECT_TRUE(says(message([](auto& p) { p.cx_px = 752; }), "cx is 752, expected 0 to 751"));
  EXPECT_TRUE(says(message([&](auto& p) { p.cy_px = nan; }), "cy is nan, expected 0 to 479"));
  EXPECT_TRUE(says(message([&](auto& p) { p.distortion[2] = infinity; }), "p1 is inf"));
  EXPECT_TRUE(says(message([](auto& p) { p.distortion[0] = -5.0; }), "monotonic"));
  Camera::Parameters fisheye = cameras()[4].p;
  fisheye.distortion[4] = 0.1;
  EXPECT_TRUE(says(Camera::check(fisheye), "distortion[4] is 0.1"));
  EXPECT_FALSE(says(message([](auto& p) { p.width_px = 0; }), "\n"));
}

}  // namespace
}  // namespace farpoint::slam
