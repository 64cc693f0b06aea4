// SPDX-License-Identifier: Apache-2.0
#include "slam/fusion/wheel_fusion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "slam/fusion/wheel_motion_model.h"
#include "slam/solver/normal_equations.h"
#include "tests/map/map_fixture.h"

namespace farpoint::slam {
namespace {

constexpr double kSpeed_mps = 5.0;
constexpr double kKeyframe_s = 0.2, kSample_s = 0.02;

// A drive along an arc with keyframes at their true places, in units of the map, and samples of its wheels.
class Drive {
 public:
  explicit Drive(const WheelConfig& config, const Eigen::Vector3d& point_m = {0, 0, 0})
      : fusion(config, point_m),
        map(CapacityConfig{.keyframes = 300, .landmarks = 10}, two_camera_rig()),
        point_m_(point_m) {}

  double metres_per_unit = 2.5;
  double yaw_rate_radps = 0.05;
  // What the wheels say of the true speed and yaw rate at a time.
  std::function<double(double)> wheel_factor = [](double) { return 1.0; };
  std::function<double(double)> yaw_gain = [](double) { return 1.0; };

  // Drives on, and adds a keyframe every kKeyframe_s; mapping judges after each.
  void drive(double seconds) {
    const double until = time_s_ + seconds;
    while (time_s_ < until - 1e-9) {
      const double speed = true_point_speed();
      for (double t = time_s_; t < time_s_ + kKeyframe_s - 1e-9; t += kSample_s) sample(t, speed);
      time_s_ += kKeyframe_s;
      add_keyframe();
    }
  }

  WheelFusion fusion;
  Map map;
  MapJudgement judgement{.steady = true};
  MotionVerdict verdict;
  KeyframeHandle newest;
  int unit_changes = 0;

  [[nodiscard]] int slipped() const {
    int count = 0;
    map.keyframes().for_each([&](KeyframeHandle h, const Keyframe&) {
      const ChainLink* link = map.chain().link_to(h);
      count += link != nullptr && link->wheels_slipped ? 1 : 0;
    });
    return count;
  }

 private:
  // The body turns about a point on its left: one ahead of it moves faster, and sideways.
  [[nodiscard]] double true_point_speed() const { return kSpeed_mps - yaw_rate_radps * point_m_.y(); }
  void sample(double t, double speed) {
    const auto utime = static_cast<std::int64_t>(std::llround(1e6 * t));
    const WheelSample s{utime, speed * wheel_factor(t), yaw_rate_radps * yaw_gain(t), 0, 0};
    fusion.add(std::span(&s, 1));
  }
  void add_keyframe() {
    Keyframe k = map.new_keyframe();
    k.utime = static_cast<std::int64_t>(std::llround(1e6 * time_s_));
    k.map_id = 1;
    const double yaw = yaw_rate_radps * time_s_;
    k.T_world_body.q = so3_exp({0, 0, yaw});
    const double radius = kSpeed_mps / yaw_rate_radps / metres_per_unit;
    k.T_world_body.t = radius * Eigen::Vector3d(std::sin(yaw), 1.0 - std::cos(yaw), 0.0);
    newest = map.add_keyframe(std::move(k));
    ASSERT_FALSE(newest.is_null());
    judge();
  }
  void judge() {
    verdict = fusion.judge(&map, newest, judgement);
    judgement.wheels = verdict.trust;
    judgement.wheel_factor = verdict.wheel_factor;
    judgement.unit_sigma = verdict.unit_sigma;
    if (!verdict.metres_per_unit) return;
    ++unit_changes;
    map.transform(1, {*verdict.metres_per_unit, Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero()});
    metres_per_unit /= *verdict.metres_per_unit;
    judgement.metric = true;
  }

  const Eigen::Vector3d point_m_;
  double time_s_ = 0;
};

TEST(WheelFusion, GivesTheMetreWithinTwoSecondsOfDrivingOnce) {
  Drive d({});
  d.drive(2.0);
  EXPECT_EQ(d.unit_changes, 1);
  EXPECT_NEAR(d.metres_per_unit, 1.0, 1e-3);
  EXPECT_LE(d.judgement.unit_sigma, WheelFusion::kMetricSigma);
  EXPECT_GE(d.judgement.unit_sigma, WheelConfig{}.scale_sigma);
  EXPECT_EQ(d.judgement.wheels, WheelTrust::kTrusted);
  d.drive(20.0);
  EXPECT_EQ(d.unit_changes, 1);
}

TEST(WheelFusion, AYoungMapIsNotCalledMetric) {
  Drive d({});
  d.judgement.steady = false;
  d.drive(5.0);
  EXPECT_EQ(d.unit_changes, 0);
  EXPECT_FALSE(d.judgement.metric);
}

TEST(WheelFusion, AScaleThatTheConfigurationCallsUncertainIsNotCalledMetric) {
  WheelConfig config;
  config.scale_sigma = 0.06;
  Drive d(config);
  d.drive(10.0);
  EXPECT_EQ(d.unit_changes, 0);
}

// In a bend a point beside the body drives another way than the body does.
TEST(WheelFusion, TheMetreIsThatOfTheBodyWhereverTheWheelsMeasure) {
  Drive d({}, {-1.0, 0.8, -0.7});
  d.yaw_rate_radps = 0.5;
  d.drive(2.0);
  EXPECT_EQ(d.unit_changes, 1);
  EXPECT_NEAR(d.metres_per_unit, 1.0, 0.01);
}

TEST(WheelFusion, ASlipIsLeftOutAndTheUnitStays) {
  Drive d({});
  d.wheel_factor = [](double t) { return t > 8.0 && t < 11.0 ? 1.2 : 1.0; };
  d.drive(20.0);
  EXPECT_GE(d.slipped(), 14);
  EXPECT_LE(d.slipped(), 17);
  EXPECT_EQ(d.unit_changes, 1);
  EXPECT_NEAR(d.metres_per_unit, 1.0, 1e-3);
}

TEST(WheelFusion, WithoutAGateNothingIsLeftOut) {
  WheelConfig config;
  config.gate_sigmas = 0.0;
  Drive d(config);
  d.wheel_factor = [](double t) { return t > 8.0 && t < 11.0 ? 1.2 : 1.0; };
  d.drive(20.0);
  EXPECT_EQ(d.slipped(), 0);
}

TEST(WheelFusion, AUnitTakenFromASlipIsCorrectedOnceTheWheelsHaveHeldForLonger) {
  Drive d({});
  d.wheel_factor = [](double t) { return t < 3.0 ? 1.3 : 1.0; };
  d.drive(3.0);
  EXPECT_NEAR(d.metres_per_unit, 1.0 / 1.3, 0.01);
  d.drive(12.0);
  EXPECT_EQ(d.unit_changes, 2);
  EXPECT_NEAR(d.metres_per_unit, 1.0, 0.01);
}

TEST(WheelFusion, FactorsActOnceTheMapIsMetricAndNotAcrossASlip) {
  Drive d({});
  d.wheel_factor = [](double t) { return t > 8.0 && t < 9.0 ? 1.2 : 1.0; };
  d.drive(10.0);
  BundleProblem problem;
  std::vector<int> pose_index(d.map.keyframes().capacity(), -1);
  int links = 0;
  for (KeyframeHandle h = d.newest; !h.is_null(); h = d.map.chain().before(h)) {
    pose_index[h.index] = static_cast<int>(problem.poses.size());
    problem.poses.push_back({d.map.keyframes()[h].T_world_body, false});
    const ChainLink* link = std::as_const(d.map).chain().link_to(h);
    links += link != nullptr && link->wheels ? 1 : 0;
  }
  d.fusion.add_to(d.map, pose_index, d.judgement, &problem);
  EXPECT_EQ(static_cast<int>(problem.factors.size()), links - d.slipped());
  EXPECT_GE(d.slipped(), 4);
  // Within a sigma, also where an interval touches the slip.
  for (const StateFactor* factor : problem.factors) EXPECT_LT(cost(*factor, problem.states()), 0.5);
  MapJudgement unknown = d.judgement;
  unknown.metric = false;
  problem.factors.clear();
  d.fusion.add_to(d.map, pose_index, unknown, &problem);
  EXPECT_TRUE(problem.factors.empty());
}

TEST(WheelFusion, TheNewestIntervalWaitsForALaterSample) {
  Drive d({});
  d.drive(2.0);
  const ChainLink* link = std::as_const(d.map).chain().link_to(d.newest);
  ASSERT_NE(link, nullptr);
  EXPECT_FALSE(link->wheels.has_value());
  const ChainLink* before = std::as_const(d.map).chain().link_to(d.map.chain().before(d.newest));
  ASSERT_NE(before, nullptr);
  EXPECT_TRUE(before->wheels.has_value());
}

// Two cameras give the metre.
void start_metric(Drive* d) {
  d->metres_per_unit = 1.0;
  d->judgement.metric = true;
}

TEST(WheelFusion, ATyreOfAnotherSizeIsEstimatedByTheCamerasMetre) {
  Drive d({});
  start_metric(&d);
  d.wheel_factor = [](double) { return 1.03; };
  d.drive(20.0);
  EXPECT_EQ(d.judgement.wheels, WheelTrust::kTrusted);
  EXPECT_NEAR(d.judgement.wheel_factor, 1.0 / 1.03, 0.005);
  EXPECT_EQ(d.unit_changes, 0);
}

class WrongWheels : public testing::TestWithParam<double> {};

TEST_P(WrongWheels, AreLeftOutWithinTwentySecondsOfDriving) {
  Drive d({});
  start_metric(&d);
  d.wheel_factor = [](double) { return GetParam(); };
  d.drive(20.0);
  EXPECT_EQ(d.judgement.wheels, WheelTrust::kContradicted);
}

INSTANTIATE_TEST_SUITE_P(Factors, WrongWheels, testing::Values(0.9, 1.1, 3.6, 1.0 / 3.6));

TEST(WheelFusion, AYawRateOfTheWrongSignIsLeftOutInTheFirstBend) {
  for (const bool by_cameras : {true, false}) {
    Drive d({});
    if (by_cameras) start_metric(&d);
    d.yaw_rate_radps = 0.2;
    d.yaw_gain = [](double) { return -1.0; };
    d.drive(4.0);
    EXPECT_EQ(d.judgement.wheels, WheelTrust::kContradicted);
  }
}

TEST(WheelFusion, AnUnknownYawRateIsNoContradictionAndLeadsNowhereBlind) {
  constexpr double kUnknown = std::numeric_limits<double>::infinity();
  WheelMotionModel model({}, Eigen::Vector3d::Zero()), turning({}, Eigen::Vector3d::Zero());
  for (int i = 0; i <= 50; ++i) {
    model.add({20'000 * i, 5.0, 0.0, 0.0, kUnknown});
    turning.add({20'000 * i, 5.0, 0.2, 0.0, 0.0});
  }
  EXPECT_FALSE(model.motion(500'000, 900'000).has_value());
  ASSERT_TRUE(turning.motion(500'000, 900'000).has_value());
  EXPECT_NEAR(turning.motion(500'000, 900'000)->t.norm(), 2.0, 0.01);
  EXPECT_FALSE(usable_sample({1, 0.0, 0.1, kUnknown, 0.0}, {}).has_value()) << "no speed";
}

TEST(WheelMotion, IsThatOfTheBodyWhereverTheWheelsMeasure) {
  const Eigen::Vector3d point_m(-1.5, 0.5, -0.3);
  WheelMotionModel model({}, point_m);
  for (int i = 0; i <= 50; ++i) model.add({20'000 * i, 5.0, 0.4, 0.0, 0.0});
  const std::optional<SE3> T = model.motion(0, 1'000'000);
  ASSERT_TRUE(T.has_value());
  const double yaw = 0.4, radius = 5.0 / 0.4;
  const Eigen::Vector3d arc(radius * std::sin(yaw), radius * (1.0 - std::cos(yaw)), 0.0);
  EXPECT_LT((*T * point_m - point_m - arc).norm(), 1e-3);
  EXPECT_NEAR(so3_log(T->q).z(), yaw, 1e-9);
}

TEST(WheelMotion, StandsOnlyAfterATimeOfZeros) {
  WheelMotionModel model({}, Eigen::Vector3d::Zero());
  const auto utime = [](int i) { return std::int64_t{20'000} * i; };
  for (int i = 0; i <= 50; ++i) model.add({utime(i), i < 40 ? 1.0 : 0.0, 0.0, 0.0, 0.0});
  EXPECT_FALSE(model.stands(utime(50)));
  for (int i = 51; i <= 60; ++i) model.add({utime(i), 0.0, 0.0, 0.0, 0.0});
  EXPECT_TRUE(model.stands(utime(60)));
  EXPECT_FALSE(model.stands(utime(60) + 500'000)) << "silent wheels";
  model.trust(WheelTrust::kContradicted, 1.0);
  EXPECT_FALSE(model.stands(utime(60)));
}

TEST(WheelMotion, ALateSampleIsOfTheTimeOfItsMotion) {
  WheelConfig config;
  config.delay_ms = 40.0;
  const std::optional<WheelSample> usable = usable_sample({1'000'000, 1.0, 0.0, 0.0, 0.0}, config);
  ASSERT_TRUE(usable.has_value());
  EXPECT_EQ(usable->utime, 960'000);
}

TEST(WheelLink, JoinsTwoMotionsAsOneAndNoneWhereEitherSlipped) {
  const auto link = [](int from, int to, bool slipped) {
    ChainLink l{.from_utime = from, .to_utime = to};
    l.wheels = WheelMotion{from, to, {2.0, 0.0}, 0.5, Eigen::Matrix3d::Identity()};
    l.wheels_slipped = slipped;
    return l;
  };
  ChainLink joined = link(0, 1, false);
  joined.append(link(1, 2, false));
  ASSERT_TRUE(joined.wheels.has_value());
  EXPECT_NEAR(joined.wheels->displacement_m.x(), 2.0 + 2.0 * std::cos(0.5), 1e-12);
  EXPECT_NEAR(joined.wheels->displacement_m.y(), 2.0 * std::sin(0.5), 1e-12);
  EXPECT_NEAR(joined.wheels->yaw_rad, 1.0, 1e-12);
  EXPECT_EQ(joined.wheels->to_utime, 2);
  for (const bool first : {true, false}) {
    ChainLink slipped = link(0, 1, first);
    slipped.append(link(1, 2, !first));
    EXPECT_FALSE(slipped.wheels.has_value());
    EXPECT_FALSE(slipped.wheels_slipped);
  }
}

}  // namespace
}  // namespace farpoint::slam
