// SPDX-License-Identifier: Apache-2.0
#include "slam/mapping/calibrator.h"

#include <gtest/gtest.h>

#include "tests/solver/bundle_scene.h"

namespace farpoint::slam {
namespace {

// A scene whose map has a camera that is wrong by `truth`, refined as mapping does it.
class CalibratedScene {
 public:
  // Camera `index` of the rig is wrong; any others are right.
  CalibratedScene(const CalibrationDelta& truth, std::uint64_t seed, int cameras = 1, int index = 0)
      : scene_({.points = 800,
                .cameras = cameras,
                .rehosted_share = 0.0,
                .noise_px = 0.2,
                .start_m = 0.01,
                .start_rad = 0.001,
                .start_log_depth = 0.02,
                .seed = seed}),
        index_(static_cast<std::size_t>(index)),
        given_(refined_camera(scene_.rig.cameras[index_].camera, -truth)),
        calibrator_({}, given_, index) {
    // Where the true camera saw what each landmark's host saw.
    for (const auto& point : scene_.truth.points) {
      Eigen::Vector2d pixel;
      EXPECT_TRUE(scene_.rig.cameras[host_camera(point)].camera.project(point.bearing, &pixel));
      host_pixels_.push_back(pixel);
    }
  }

  // One keyframe: local BA with the present camera, then the refinement. True where it changed the camera.
  bool turn() {
    scene_.rig.cameras[index_].camera = calibrator_.camera();
    const Camera& camera = scene_.rig.cameras[index_].camera;
    std::vector<Eigen::Matrix<double, 3, 2>> d_bearing(host_pixels_.size(),
                                                       Eigen::Matrix<double, 3, 2>::Zero());
    for (std::size_t i = 0; i < host_pixels_.size(); ++i) {
      if (host_camera(scene_.start.points[i]) != index_) continue;
      EXPECT_TRUE(camera.unproject(host_pixels_[i], &scene_.start.points[i].bearing));
      for (int axis = 0; axis < 2; ++axis) {
        const Eigen::Vector2d half = 0.5 * Eigen::Vector2d::Unit(axis);
        Eigen::Vector3d a, b;
        EXPECT_TRUE(camera.unproject(host_pixels_[i] + half, &a) &&
                    camera.unproject(host_pixels_[i] - half, &b));
        d_bearing[i].col(axis) = a - b;
      }
    }
    (void)solve_schur({.iterations = 20}, &scene_.start);
    return calibrator_.update(scene_.start, d_bearing);
  }

  [[nodiscard]] const Calibrator& calibrator() const { return calibrator_; }

 private:
  [[nodiscard]] std::size_t host_camera(const BundleProblem::Point& point) const {
    std::size_t camera = 0;
    while (scene_.rig.cameras[camera].T_body_camera.t != point.T_host_anchor.t) ++camera;
    return camera;
  }

  BundleScene scene_;
  std::size_t index_;
  Camera given_;
  Calibrator calibrator_;
  std::vector<Eigen::Vector2d> host_pixels_;
};

TEST(Calibrator, FindsWhatIsWrongWithTheCamera) {
  const CalibrationDelta truth(0.004, 1.5, -1.0, 0.01);
  CalibratedScene scene(truth, 3);
  EXPECT_TRUE(scene.turn()) << "a pixel of the centre is noticeable";
  for (int i = 0; i < 7; ++i) scene.turn();
  const CalibrationDelta error = scene.calibrator().delta() - truth, sigma = scene.calibrator().sigma();
  for (int i = 0; i < 4; ++i) {
    EXPECT_LT(std::abs(error[i]), 4.0 * sigma[i]) << i;
    EXPECT_LT(std::abs(error[i]), 0.4 * std::abs(truth[i])) << i << ": " << scene.calibrator().delta()[i];
  }
  EXPECT_FALSE(scene.calibrator().contradicts_given()) << scene.calibrator().surprise();
}

TEST(Calibrator, FindsWhatIsWrongWithEitherCameraOfTwo) {
  const CalibrationDelta truth(0.004, 1.5, -1.0, 0.01);
  for (const int camera : {0, 1}) {
    CalibratedScene scene(truth, 3, 2, camera);
    for (int i = 0; i < 8; ++i) scene.turn();
    const CalibrationDelta error = scene.calibrator().delta() - truth, sigma = scene.calibrator().sigma();
    for (int i = 0; i < 4; ++i) {
      EXPECT_LT(std::abs(error[i]), 4.0 * sigma[i]) << camera << ' ' << i;
      EXPECT_LT(std::abs(error[i]), 0.5 * std::abs(truth[i])) << camera << ' ' << i;
    }
  }
}

TEST(Calibrator, ARightCameraBesideARightOneIsLeftAlone) {
  CalibratedScene scene(CalibrationDelta::Zero(), 4, 2, 1);
  for (int i = 0; i < 4; ++i) scene.turn();
  const CalibrationDelta sigma = scene.calibrator().sigma();
  for (int i = 0; i < 4; ++i) EXPECT_LT(std::abs(scene.calibrator().delta()[i]), 4.0 * sigma[i]) << i;
  EXPECT_LT(scene.calibrator().surprise(), 3.0);
}

TEST(Calibrator, LeavesARightCameraAlone) {
  CalibratedScene scene(CalibrationDelta::Zero(), 4);
  for (int i = 0; i < 4; ++i) scene.turn();
  const CalibrationDelta sigma = scene.calibrator().sigma();
  for (int i = 0; i < 4; ++i) EXPECT_LT(std::abs(scene.calibrator().delta()[i]), 4.0 * sigma[i]) << i;
  EXPECT_LT(scene.calibrator().surprise(), 3.0);
}

TEST(Calibrator, ALargeErrorContradictsTheGivenCamera) {
  CalibratedScene scene(CalibrationDelta(0.1, 0.0, 0.0, 0.0), 3);
  for (int i = 0; i < 8; ++i) scene.turn();
  EXPECT_TRUE(scene.calibrator().contradicts_given()) << scene.calibrator().surprise();
  // The first windows count too: the map had not followed yet.
  EXPECT_GT(scene.calibrator().wanted_by_images()[0], 0.05);
  EXPECT_LT(scene.calibrator().wanted_by_images()[0], 0.15);
}

TEST(Calibrator, AYoungWindowSaysNothing) {
  CalibratedScene scene(CalibrationDelta(0.004, 1.5, -1.0, 0.01), 5);
  Calibrator young({.min_keyframes = 100}, Camera(scene.calibrator().camera().parameters()));
  EXPECT_EQ(young.delta(), CalibrationDelta::Zero());
  EXPECT_EQ(young.surprise(), 0.0);
  EXPECT_EQ(young.wanted_by_images(), CalibrationDelta::Zero());
  EXPECT_TRUE(young.sigma().isApprox(CalibrationDelta(0.003, 2.0, 2.0, 0.02)));
}

}  // namespace
}  // namespace farpoint::slam
