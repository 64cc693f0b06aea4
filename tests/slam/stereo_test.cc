// SPDX-License-Identifier: Apache-2.0
// The estimator with two cameras: rendered images of textured walls, along a known way.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <optional>
#include <span>
#include <vector>

#include "slam/estimator.h"
#include "tests/support/walls.h"

namespace farpoint::slam {
namespace {

using testing::OwnedImage;
using testing::Walls;

constexpr int kFrames = 14;
constexpr double kFrame_s = 0.1;

// Small, coarse lenses: rendering is most of the test's time. The second camera is turned, and not level with
// the first.
Rig rig_of_two() {
  Camera::Parameters p;
  p.width_px = 320, p.height_px = 240;
  p.fx_px = p.fy_px = 260, p.cx_px = 160, p.cy_px = 120;
  Camera::Parameters q = p;
  q.fx_px = q.fy_px = 240;
  q.distortion = {-0.05, 0.01, 0, 0, 0};
  Rig rig;
  rig.cameras.push_back({"left", Camera(p), {q_body_forward_camera(), {0.3, 0.15, 0.1}}});
  rig.cameras.push_back(
      {"right", Camera(q), {q_body_forward_camera() * so3_exp({0.01, -0.03, 0.02}), {0.28, -0.25, 0.12}}});
  return rig;
}

// The walls stand in the axes of a camera at the world's origin that looks along x.
SE3 T_walls_world() {
  return SE3{q_body_forward_camera(), Eigen::Vector3d::Zero()}.inverse();
}

SE3 true_pose(int frame) {
  const double s = 0.06 * frame;
  return {so3_exp({0.0, 0.0, 0.004 * frame}), {s, 0.5 * s, 0.02 * s}};
}

// Images of every frame by both cameras, rendered once.
class Drive {
 public:
  static const Drive& get() {
    static const Drive drive;
    return drive;
  }
  [[nodiscard]] const OwnedImage& image(int frame, int camera) const {
    return images_[static_cast<std::size_t>(2 * frame + camera)];
  }

 private:
  Drive() {
    const Rig rig = rig_of_two();
    const Walls walls(5.0);
    for (int i = 0; i < kFrames; ++i)
      for (const RigCamera& c : rig.cameras)
        images_.push_back(photograph(walls, c.camera, T_walls_world() * true_pose(i) * c.T_body_camera,
                                     static_cast<std::uint64_t>(images_.size() + 1)));
  }
  std::vector<OwnedImage> images_;
};

EstimatorConfig small_config() {
  EstimatorConfig config;
  config.extractor.features = 500;
  config.capacity.keyframes = 40;
  config.capacity.landmarks = 6000;
  config.capacity.window_images = 8;
  return config;
}

// Frame by frame. `right`: index of the camera whose image is given as the second's; none: no image.
class Ride {
 public:
  explicit Ride(const Rig& rig = rig_of_two()) : estimator_(small_config(), rig) {}

  FrameResult step(std::optional<int> right, int left = 0) {
    const Drive& drive = Drive::get();
    FrameInput input;
    input.utime = 1'000'000 + static_cast<std::int64_t>(1e6 * kFrame_s * frame_);
    input.sequence = frame_;
    input.image = drive.image(frame_, left).view();
    CameraImage second{1, {}};
    if (right) {
      second.image = drive.image(frame_, *right).view();
      input.others = std::span(&second, 1);
    }
    ++frame_;
    return estimator_.process(input);
  }
  // Distance of the pose from the truth, both from the first frame on, metres.
  [[nodiscard]] double error(const FrameResult& result) const {
    const SE3 truth = true_pose(0).inverse() * true_pose(frame_ - 1);
    return (result.T_map_body.t - truth.t).norm();
  }
  [[nodiscard]] int frame() const { return frame_; }

 private:
  Estimator estimator_;
  int frame_ = 0;
};

double way(int frame) {
  return (true_pose(frame).t - true_pose(0).t).norm();
}

TEST(EstimatorOfTwoCameras, IsMetricAndValidFromTheSecondFrameOn) {
  Ride ride;
  (void)ride.step(1);  // the map of this frame's two images is made before the next one comes
  FrameResult last;
  while (ride.frame() < kFrames) {
    last = ride.step(1);
    EXPECT_TRUE(is_valid(last.state)) << ride.frame();
    EXPECT_EQ(last.scale, ScaleState::kMetric);
    EXPECT_LT(ride.error(last), 0.01) << ride.frame();
  }
  std::printf("  off by %.4f of %.3f m\n", ride.error(last), way(kFrames - 1));
  EXPECT_LT(ride.error(last), 0.01 * way(kFrames - 1));
  EXPECT_EQ(last.map_id, 1);
}

TEST(EstimatorOfTwoCameras, AFrameWithoutTheSecondImageIsPosedWithoutAStep) {
  Ride ride;
  for (int i = 0; i < kFrames; ++i) {
    const bool missing = i == 4 || (i >= 7 && i < 10);
    const FrameResult result = missing ? ride.step(std::nullopt) : ride.step(1);
    if (i == 0) continue;
    EXPECT_TRUE(is_valid(result.state)) << i;
    EXPECT_EQ(result.scale, ScaleState::kMetric) << i;
    EXPECT_LT(ride.error(result), 0.012) << i;
  }
}

TEST(EstimatorOfTwoCameras, AnImageOfAWrongSizeCountsAsMissing) {
  Ride ride;
  (void)ride.step(1);
  FrameInput input;
  input.utime = 1'050'000;
  input.image = Drive::get().image(0, 0).view();
  const OwnedImage wrong(160, 120, 50);
  const CameraImage second{1, wrong.view()};
  input.others = std::span(&second, 1);
  Estimator estimator(small_config(), rig_of_two());
  (void)estimator.process(input);
  EXPECT_EQ(estimator.counts().frames, 1U);
  EXPECT_EQ(estimator.counts().frames_rejected, 0U);
}

TEST(EstimatorOfTwoCameras, AMapFromBeforeTheSecondCameraCameGivesWayToAMetricOne) {
  Ride ride;
  FrameResult result;
  for (int i = 0; i < 10; ++i) result = ride.step(std::nullopt);
  EXPECT_EQ(result.scale, ScaleState::kUnknown);
  const std::uint32_t resets = result.reset_counter;
  const bool had_map = result.has_pose;
  while (ride.frame() < kFrames) result = ride.step(1);
  EXPECT_EQ(result.scale, ScaleState::kMetric);
  EXPECT_TRUE(is_valid(result.state));
  EXPECT_EQ(result.reset_counter, resets + 1);
  EXPECT_TRUE(had_map) << "the way before was too short for a map: the test shows nothing";
}

TEST(EstimatorOfTwoCameras, SwappedCamerasGiveNothingMetric) {
  Ride ride;
  while (ride.frame() < kFrames) {
    const FrameResult result = ride.step(0, 1);
    EXPECT_FALSE(result.scale == ScaleState::kMetric && is_valid(result.state)) << ride.frame();
  }
}

}  // namespace
}  // namespace farpoint::slam
