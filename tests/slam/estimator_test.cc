// SPDX-License-Identifier: Apache-2.0
#include "slam/estimator.h"

#include <gtest/gtest.h>

#include "tests/slam/simulated_drive.h"

namespace farpoint::slam {
namespace {

TEST(Estimator, RefusesARigWithoutCamera) {
  EXPECT_THROW(Estimator(EstimatorConfig{}, Rig{}), std::invalid_argument);
}

TEST(Estimator, RefusesAMaskOfAnotherSizeThanTheCameras) {
  SimulatedDrive drive;
  Rig rig = drive.rig();
  const int width = rig.cameras[0].camera.width_px(), height = rig.cameras[0].camera.height_px();
  const std::vector<std::uint8_t> pixels(static_cast<std::size_t>(width) * static_cast<std::size_t>(height),
                                         255);
  rig.cameras[0].mask = std::make_shared<const ImageMask>(height, width, pixels);
  EXPECT_THROW(Estimator(drive.config(), rig), std::invalid_argument);
  rig.cameras[0].mask = std::make_shared<const ImageMask>(width, height, pixels);
  EXPECT_NO_THROW(Estimator(drive.config(), rig));
}

TEST(Estimator, InspectionShowsTheMapThatTheCountsCount) {
  SimulatedDrive drive;
  Estimator estimator(drive.config(), drive.rig());
  std::vector<MappingNote> notes;
  estimator.on_view([&](const MappingNote& note) { notes.push_back(note); });
  FrameResult last;
  for (int i = 0; i < 60; ++i) last = estimator.process(drive.next());
  estimator.finish();
  const EstimatorCounts& counts = estimator.counts();
  const Inspection maps = estimator.inspect();
  EXPECT_EQ(counts.frames, 60U);
  ASSERT_GT(counts.landmarks, 100U);
  ASSERT_FALSE(notes.empty());
  EXPECT_GE(notes.back().reply, last.taken.replies);

  const std::vector<LandmarkInfo> landmarks = maps.landmarks();
  EXPECT_EQ(landmarks.size(), counts.landmarks);
  EXPECT_EQ(maps.keyframe_poses().size(), counts.keyframes);
  std::size_t distances = 0, observations = 0;
  maps.visit_observation_distances([&](std::int32_t, double distance) {
    EXPECT_GT(distance, 0.0);
    ++distances;
  });
  for (const LandmarkInfo& l : landmarks) {
    EXPECT_EQ(maps.sightings(l).size(), static_cast<std::size_t>(l.observations));
    if (l.full && l.inverse_depth > 0.0) observations += static_cast<std::size_t>(l.observations);
  }
  EXPECT_EQ(distances, observations);
  LandmarkInfo gone = landmarks.front();
  ++gone.generation;
  EXPECT_TRUE(maps.sightings(gone).empty());

  const std::vector<MapTrajectory> trajectories = maps.trajectories();
  ASSERT_EQ(trajectories.size(), 1U);
  EXPECT_GT(trajectories[0].frames.size(), 30U);
  for (std::size_t i = 1; i < trajectories[0].frames.size(); ++i)
    EXPECT_GT(trajectories[0].frames[i].utime, trajectories[0].frames[i - 1].utime);
}

// What the simulator shows at a landmark's anchor is what a report calls the landmark.
TEST(Estimator, ALandmarksAnchorIsAFeatureOfItsFrame) {
  sim::Scene scene = sim::make_scene("straight");
  scene.features = 500;
  sim::Simulator simulator(scene, 3);
  sim::ShownPoints shown;
  Estimator estimator(scene.estimator(LandmarkMode::kVmp), scene.believed_rig());
  for (int i = 0; i < 40; ++i) {
    sim::Sighted sighted = simulator.next();
    shown.note(sighted);
    estimator.process(std::move(sighted.input));
  }
  int known = 0, full = 0;
  for (const LandmarkInfo& l : estimator.inspect().landmarks()) {
    if (!l.full) continue;
    ++full;
    known += shown.find(l.anchor_utime, l.anchor_pixel) < sim::kNothing ? 1 : 0;
  }
  ASSERT_GT(full, 100);
  EXPECT_GT(known, full * 9 / 10);
}

TEST(Estimator, CountsSamplesOfOtherSensors) {
  SimulatedDrive drive;
  Estimator estimator(drive.config(), drive.rig());
  FeatureInput first = drive.next(), second = drive.next();
  const std::int64_t late_utime = first.utime;
  estimator.process(std::move(first));
  ImuSample imu;
  imu.utime = late_utime;
  EXPECT_TRUE(estimator.add(imu));
  imu.utime = second.utime;
  EXPECT_TRUE(estimator.add(imu));
  WheelSample wheels;
  wheels.utime = second.utime;
  while (estimator.add(wheels)) ++wheels.utime;
  const FrameResult& result = estimator.process(std::move(second));
  EXPECT_EQ(result.taken.imu, 2U);
  EXPECT_EQ(estimator.counts().imu.used, 1U);
  EXPECT_EQ(estimator.counts().imu.late, 1U);
  EXPECT_EQ(result.taken.wheels, 1U);
  EXPECT_EQ(estimator.counts().wheels.dropped, 1U);
}

}  // namespace
}  // namespace farpoint::slam
