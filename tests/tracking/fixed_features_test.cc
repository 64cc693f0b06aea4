// SPDX-License-Identifier: Apache-2.0
#include "slam/tracking/fixed_features.h"

#include <gtest/gtest.h>

#include <random>

namespace farpoint::slam {
namespace {

Camera pinhole() {
  Camera::Parameters p;
  p.width_px = 640, p.height_px = 480;
  p.fx_px = p.fy_px = 500.0;
  p.cx_px = 319.5, p.cy_px = 239.5;
  return Camera(p);
}

constexpr std::int64_t kFrame_us = 200'000;

// A camera that turns in place: features of far things move in the image, those of a bonnet stay.
class TurningCamera {
 public:
  // Of `features`, the first `fixed` move with the camera.
  TurningCamera(int features, int fixed) : fixed_(fixed) {
    std::mt19937 random(3);
    std::uniform_real_distribution<float> u(60.0F, 580.0F), v(60.0F, 420.0F);
    for (int i = 0; i < features; ++i) {
      Feature f;
      f.u_px = u(random), f.v_px = v(random);
      start_.features.push_back(f);
      Descriptor d;
      for (std::uint64_t& word : d.words) word = (std::uint64_t{random()} << 32U) | random();
      start_.descriptors.push_back(d);
    }
  }

  // The next frame, turned by this much more.
  void turn(double yaw_rad, FixedFeatures* found) {
    q_map_camera_ = (q_map_camera_ * so3_exp({0.0, yaw_rad, 0.0})).normalized();
    const Eigen::Quaterniond q_now_start = q_map_camera_.conjugate();
    FeatureSet now = start_;
    for (std::size_t i = static_cast<std::size_t>(fixed_); i < now.features.size(); ++i) {
      Feature& f = now.features[i];
      Eigen::Vector3d bearing;
      Eigen::Vector2d px;
      ASSERT_TRUE(camera_.unproject({f.u_px, f.v_px}, &bearing));
      ASSERT_TRUE(camera_.project(q_now_start * bearing, &px));
      f.u_px = static_cast<float>(px.x()), f.v_px = static_cast<float>(px.y());
    }
    grid_.build(now.features);
    found->add(now, grid_, camera_, q_map_camera_, utime_ += kFrame_us);
  }

 private:
  const int fixed_;
  const Camera camera_ = pinhole();
  FeatureSet start_;
  FeatureGrid grid_{640, 480, 32, 1000};
  Eigen::Quaterniond q_map_camera_ = Eigen::Quaterniond::Identity();
  std::int64_t utime_ = 0;
};

double share_after(int turns, double yaw_rad, int fixed) {
  FixedFeatures found(1000);
  TurningCamera camera(500, fixed);
  for (int i = 0; i <= turns; ++i) camera.turn(yaw_rad, &found);
  return found.share();
}

TEST(FixedFeatures, AWorldThatTurnsPastHasNone) {
  EXPECT_EQ(share_after(4, 0.03, 0), 0.0);
}

TEST(FixedFeatures, ThoseOfABonnetAreCountedFromTheSecondTurnOn) {
  EXPECT_LT(share_after(1, 0.03, 100), 0.15) << "one turn counts half";
  EXPECT_NEAR(share_after(2, 0.03, 100), 0.2, 0.01);
  EXPECT_GT(share_after(2, 0.03, 100), FixedFeatures::kMostShare);
}

TEST(FixedFeatures, WithoutATurnNothingIsKnown) {
  EXPECT_EQ(share_after(20, 0.0, 100), 0.0);
}

// A new map's orientation does not continue from the old one's.
TEST(FixedFeatures, AForgottenReferenceIsComparedWithNoLaterFrame) {
  FixedFeatures found(1000);
  TurningCamera camera(500, 100);
  for (int i = 0; i < 10; ++i) {
    camera.turn(0.03, &found);
    found.forget_reference();
  }
  EXPECT_EQ(found.share(), 0.0);
}

}  // namespace
}  // namespace farpoint::slam
