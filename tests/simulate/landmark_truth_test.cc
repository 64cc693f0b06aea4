// SPDX-License-Identifier: Apache-2.0
// Landmarks against the simulated world: perfect ones are right, and errors put in come out.
#include "tools/evaluate/landmark_truth.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>

#include "tests/simulate/small_worlds.h"
#include "tools/common/errors.h"
#include "tools/evaluate/landmark_metrics.h"

namespace farpoint::tools {
namespace {

constexpr std::int64_t kFrame = 40, kBirthFrame = 48;
constexpr double kRate_hz = 10.0, kScale = 2.5;  // metres a map unit

class LandmarkTruth : public testing::Test {
 protected:
  // The world is made once: that takes seconds.
  static void SetUpTestSuite() {
    simulation = std::make_unique<simulate::Simulation>(simulate::request_for("town", 310, 94, 10.0));
    world = std::make_unique<SimulatedWorld>(simulation->message());
  }
  static void TearDownTestSuite() {
    simulation.reset();
    world.reset();
  }

  LandmarkTruth() {
    // The map: turned, moved, and in its own unit.
    map_to_world_.S_world_map = {kScale, slam::so3_exp({0.1, -0.2, 1.3}), {40.0, -7.0, 3.0}};
    map_to_world_.scale = kScale;
    for (int i = 0; i < 100; ++i) {
      const slam::SE3 truth = simulation->body().pose_at(i / kRate_hz);
      pairs_.push_back({i / kRate_hz, truth, to_map(truth.t), 0});
    }
  }

  slam::SE3 to_map(const Eigen::Vector3d& p_world) const {
    return {Eigen::Quaterniond::Identity(), map_to_world_.S_world_map.inverse() * p_world};
  }

  // One landmark a pixel, right except for a factor on its distance.
  landmarks_t landmarks_at(const std::vector<Eigen::Vector2d>& pixels, double factor, float relative_sigma) {
    const slam::SE3 camera = simulation->body().pose_at(kFrame / kRate_hz) * simulation->T_body_camera(0);
    const std::vector<simulate::SeenPoint> seen = simulation->look(kFrame, 0, pixels);
    landmarks_t message{};
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      Eigen::Vector3d ray;
      EXPECT_TRUE(simulation->camera(0).unproject(pixels[i], &ray));
      const double distance_m = factor * (std::isfinite(seen[i].distance_m) ? seen[i].distance_m : 500.0);
      landmark_t l{};
      l.anchor_utime = kFrame * 100'000;
      l.created_utime = kBirthFrame * 100'000;
      for (int k = 0; k < 2; ++k) l.anchor_pixel[k] = static_cast<float>(pixels[i][k]);
      const Eigen::Vector3d position = to_map(camera * Eigen::Vector3d(distance_m * ray)).t;
      std::copy(position.data(), position.data() + 3, l.position);
      l.distance = distance_m / kScale;
      l.relative_sigma = relative_sigma;
      message.landmarks.push_back(l);
    }
    message.nlandmarks = static_cast<std::int32_t>(message.landmarks.size());
    return message;
  }

  static std::vector<Eigen::Vector2d> grid() {
    std::vector<Eigen::Vector2d> pixels;
    for (int y = 4; y < 90; y += 6) {
      for (int x = 5; x < 305; x += 10) pixels.emplace_back(x + 0.25, y + 0.5);
    }
    return pixels;
  }

  static std::unique_ptr<simulate::Simulation> simulation;
  static std::unique_ptr<SimulatedWorld> world;
  MapToWorld map_to_world_;
  std::vector<PosePair> pairs_;
};
std::unique_ptr<simulate::Simulation> LandmarkTruth::simulation;
std::unique_ptr<SimulatedWorld> LandmarkTruth::world;

TEST_F(LandmarkTruth, PerfectLandmarksHaveNoError) {
  const std::vector<JudgedLandmark> judged =
      world->judge(landmarks_at(grid(), 1.0, 0.01F), 0, pairs_, map_to_world_).landmarks;
  ASSERT_EQ(judged.size(), grid().size());
  int surfaces = 0, skies = 0;
  for (const JudgedLandmark& l : judged) {
    skies += l.target == LandmarkTarget::kSky ? 1 : 0;
    if (l.target != LandmarkTarget::kSurface) continue;
    ++surfaces;
    EXPECT_NEAR(l.distance_m / l.true_distance_m, 1.0, 1e-5);
    EXPECT_NEAR(l.sigmas, 0.0, 1e-3);
    EXPECT_LT(l.position_error_m, 1e-3);
    EXPECT_NEAR(l.wait_s, 0.8, 1e-9);
    EXPECT_NEAR(l.wait_m, (simulation->body().pose_at(4.8).t - simulation->body().pose_at(4.0).t).norm(),
                0.05);
    // The camera drove on: what lies ahead came nearer by the way at most, and turned by an angle to match.
    EXPECT_LE(std::abs(l.born_at_m - l.true_distance_m), l.wait_m + 0.1);
    EXPECT_LE(l.true_distance_m * std::sin(l.parallax_rad), l.wait_m + 0.1);
    EXPECT_GT(l.parallax_rad, 0.0);
  }
  EXPECT_GT(surfaces, 200);
  EXPECT_GT(skies, 3);
}

TEST_F(LandmarkTruth, AnErrorOfDistanceComesOutInPercentAndInSigmas) {
  const std::vector<JudgedLandmark> judged =
      world->judge(landmarks_at(grid(), 1.1, 0.05F), 0, pairs_, map_to_world_).landmarks;
  for (const JudgedLandmark& l : judged) {
    if (l.target != LandmarkTarget::kSurface) continue;
    EXPECT_NEAR(l.distance_m / l.true_distance_m, 1.1, 1e-5);
    EXPECT_NEAR(l.sigmas, -2.0, 0.01) << "0.1 / 0.05, of inverse distance";
    EXPECT_NEAR(l.position_error_m, 0.1 * l.true_distance_m, 1e-3 * l.true_distance_m);
  }
  const LandmarkMetrics metrics = measure_landmarks(judged);
  for (const DistanceBin& bin : metrics.bins) {
    if (bin.count == 0) continue;
    EXPECT_NEAR(bin.error_p50_percent, 10.0, 0.01);
    EXPECT_NEAR(bin.error_p90_percent, 10.0, 0.01);
    EXPECT_NEAR(bin.bias_percent, 10.0, 0.01);
    EXPECT_NEAR(bin.claimed_percent, 5.0, 0.01);
    EXPECT_NEAR(bin.sigmas, 1.4826 * 2.0, 0.02);
  }
}

TEST_F(LandmarkTruth, TheScaleIsThatOfTheStretchWhereALandmarkWasSeen) {
  // The map's unit grows by a fifth after 7 s, as drift does.
  for (PosePair& pair : pairs_) {
    if (pair.time_s > 7.05)
      pair.T_map_body.t = pairs_[70].T_map_body.t + (pair.T_map_body.t - pairs_[70].T_map_body.t) / 1.2;
  }
  EXPECT_NEAR(local_scale(pairs_, 3.9, 99.0), kScale, 1e-6);
  EXPECT_NEAR(local_scale(pairs_, 10.0, 99.0), 1.2 * kScale, 1e-6);
  EXPECT_EQ(local_scale({}, 4.0, 99.0), 99.0) << "nothing there";
  std::vector<PosePair> standing = pairs_;
  for (PosePair& pair : standing) pair.T_world_body.t.setZero();
  EXPECT_EQ(local_scale(standing, 4.0, 99.0), 99.0) << "no way to measure";
}

TEST_F(LandmarkTruth, LandmarksOutsideTheRecordingAreCountedAndLeftOut) {
  constexpr std::int64_t kOutside_us[] = {-1, 10'000'000, INT64_MAX, INT64_MIN, 9'000'000'000'000'000};
  landmarks_t message = landmarks_at({{100.0, 40.0}}, 1.0, 0.01F);
  const landmark_t right = message.landmarks.front();
  std::vector<landmark_t> wrong;
  const auto add = [&](const std::function<void(landmark_t*)>& spoil) { spoil(&wrong.emplace_back(right)); };
  for (const int camera : {-1, 1, INT32_MIN, INT32_MAX})
    add([camera](landmark_t* l) { l->anchor_camera = camera; });
  for (const std::int64_t utime : kOutside_us) {
    add([utime](landmark_t* l) { l->anchor_utime = utime; });
    add([utime](landmark_t* l) { l->created_utime = utime; });
  }
  for (const float pixel : {-1.0F, 311.0F, 1e30F, std::nanf("")}) {
    add([pixel](landmark_t* l) { l->anchor_pixel[0] = pixel; });
    add([pixel](landmark_t* l) { l->anchor_pixel[1] = pixel; });
  }
  add([](landmark_t* l) { l->position[1] = NAN; });
  add([](landmark_t* l) { l->distance = INFINITY; });
  add([](landmark_t* l) { l->relative_sigma = NAN; });
  message.landmarks.insert(message.landmarks.end(), wrong.begin(), wrong.end());
  const JudgedLandmarks judged = world->judge(message, 0, pairs_, map_to_world_);
  EXPECT_EQ(judged.landmarks.size(), 1U);
  EXPECT_EQ(judged.refused, wrong.size());
}

TEST_F(LandmarkTruth, AMessageOfAnImpossibleSimulationIsRefused) {
  const simulation_t right = simulation->message();
  const auto expect_refused = [&](const std::function<void(simulation_t*)>& spoil, const std::string& what) {
    simulation_t message = right;
    spoil(&message);
    try {
      (void)simulate::Simulation::request_of(message);
      ADD_FAILURE() << what << ": accepted";
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(what), std::string::npos) << error.what();
    }
  };
  for (const double duration : {std::nan(""), -1.0, 0.0, 1e300})
    expect_refused([duration](simulation_t* m) { m->duration = duration; }, "SIMULATION: duration");
  for (const int side : {0, -94, 31, 4097, INT32_MAX}) {
    expect_refused([side](simulation_t* m) { m->width = side; }, "SIMULATION: images of");
    expect_refused([side](simulation_t* m) { m->height = side; }, "SIMULATION: images of");
  }
  EXPECT_NO_THROW((void)simulate::Simulation::request_of(right));
}

JudgedLandmark judged_at(double distance_m, LandmarkTarget target, bool through_vmp) {
  JudgedLandmark l;
  l.target = target;
  l.true_distance_m = l.distance_m = distance_m;
  l.relative_sigma = 0.1;
  l.through_vmp = through_vmp;
  return l;
}

TEST(LandmarkMetrics, CountsWhatStandsWhere) {
  using Target = LandmarkTarget;
  std::vector<JudgedLandmark> judged = {
      judged_at(5, Target::kSurface, false), judged_at(60, Target::kSurface, true),
      judged_at(150, Target::kSurface, true), judged_at(250, Target::kOutline, true),
      judged_at(30, Target::kMoving, false)};
  judged.push_back(judged_at(INFINITY, Target::kSky, false));
  const LandmarkMetrics metrics = measure_landmarks(judged);
  EXPECT_EQ(metrics.count, 6U);
  EXPECT_EQ(metrics.on_sky, 1U);
  EXPECT_EQ(metrics.on_moving, 1U);
  EXPECT_EQ(metrics.at_outlines, 1U);
  std::size_t in_bins = 0;
  for (const DistanceBin& bin : metrics.bins) in_bins += bin.count;
  EXPECT_EQ(in_bins, 3U) << "surfaces only";
  ASSERT_EQ(metrics.far.size(), 3U);
  EXPECT_EQ(metrics.far[0].count, 3U);
  EXPECT_NEAR(metrics.far[0].share_percent, 75.0, 1e-9) << "of surfaces and outlines";
  EXPECT_EQ(metrics.far[1].count, 2U);
  EXPECT_EQ(metrics.far[2].count, 1U);
  EXPECT_EQ(metrics.far[2].through_vmp, 1U);
  const Json json = to_json(metrics);
  ASSERT_NE(json.find("over_100_m.share_percent"), nullptr);
  EXPECT_NEAR(json.find("over_100_m.share_percent")->number(), 50.0, 1e-9);
  ASSERT_NE(json.find("from_50_to_100_m.n"), nullptr);
}

}  // namespace
}  // namespace farpoint::tools
