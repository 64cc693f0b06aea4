// SPDX-License-Identifier: Apache-2.0
#include "slam/tracking/constant_velocity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace farpoint::slam {
namespace {

constexpr std::int64_t kFrame_us = 100'000;

Vector6d vector6(double x, double y, double z, double roll, double pitch, double yaw) {
  return (Vector6d() << x, y, z, roll, pitch, yaw).finished();
}

const Vector6d kStep = vector6(0.8, -0.1, 0.05, 0.01, -0.02, 0.06);
const SE3 kStart{so3_exp({0.2, -0.1, 0.7}), {3, -2, 1}};

double difference(const SE3& a, const SE3& b) {
  return a.boxminus_to(b).norm();
}

// Two accepted frames, kFrame_us and kStep apart.
void move(ConstantVelocity* model) {
  model->start(kStart, kFrame_us);
  model->accept(kStart.boxplus(kStep), 2 * kFrame_us);
}

TEST(ConstantVelocity, PredictsTheStepOfTheLastTwoFramesAgain) {
  ConstantVelocity model;
  move(&model);
  const SE3 last = kStart.boxplus(kStep);
  EXPECT_LT(difference(model.predict(3 * kFrame_us).T_world_body, last.boxplus(kStep)), 1e-12);
  EXPECT_LT(difference(model.predict(2 * kFrame_us + kFrame_us / 2).T_world_body, last.boxplus(0.5 * kStep)),
            1e-12);
}

TEST(ConstantVelocity, IsAStartWithoutInformation) {
  ConstantVelocity model;
  move(&model);
  EXPECT_EQ(model.predict(3 * kFrame_us).information, Matrix6d::Zero());
}

TEST(ConstantVelocity, GivesItsVelocityASecondInBodyAxes) {
  ConstantVelocity model;
  move(&model);
  EXPECT_LT((model.velocity_body() - 10.0 * kStep).norm(), 1e-10);
}

TEST(ConstantVelocity, StaysAtTheStartUntilAFrameIsAccepted) {
  ConstantVelocity model;
  move(&model);
  model.start(kStart, 5 * kFrame_us);
  EXPECT_EQ(difference(model.predict(6 * kFrame_us).T_world_body, kStart), 0.0);
  EXPECT_EQ(model.velocity_body(), Vector6d::Zero());
}

TEST(ConstantVelocity, StaysAtTheLastPoseAfterMoreThanASecondAndBeforeIt) {
  ConstantVelocity model;
  move(&model);
  const SE3 last = kStart.boxplus(kStep);
  EXPECT_GT(difference(model.predict(2 * kFrame_us + 1'000'000).T_world_body, last), 1.0);
  EXPECT_EQ(difference(model.predict(2 * kFrame_us + 1'000'001).T_world_body, last), 0.0);
  EXPECT_EQ(difference(model.predict(kFrame_us).T_world_body, last), 0.0);
}

TEST(ConstantVelocity, HasNoVelocityOverASecondOfTrackingAndThreeOfAGap) {
  ConstantVelocity tracked;
  move(&tracked);
  tracked.accept(kStart, 2 * kFrame_us + 1'000'000);
  EXPECT_EQ(tracked.velocity_body(), Vector6d::Zero());
  ConstantVelocity found;
  move(&found);
  found.accept_on_trial(kStart, 2 * kFrame_us + 2'500'000);
  EXPECT_LT((found.velocity_body() - kStart.boxplus(kStep).boxminus_to(kStart) / 2.5).norm(), 1e-10);
  found.accept_on_trial(kStart, 2 * kFrame_us + 3'000'000);
  EXPECT_EQ(found.velocity_body(), Vector6d::Zero());
}

// --- on trial
// ------------------------------------------------------------------------------------------------------

TEST(ConstantVelocity, APoseOnTrialIsNewestAndNotConfirmed) {
  ConstantVelocity model;
  move(&model);
  const SE3 last = kStart.boxplus(kStep), trial{so3_exp({0, 0, 1}), {50, 0, 0}};
  model.accept_on_trial(trial, 3 * kFrame_us);
  EXPECT_EQ(difference(model.newest().T_world_body, trial), 0.0);
  EXPECT_EQ(difference(model.confirmed().T_world_body, last), 0.0);
  EXPECT_EQ(model.confirmed().utime, 2 * kFrame_us);
  EXPECT_LT((model.confirmed().velocity - 10.0 * kStep).norm(), 1e-10);
}

TEST(ConstantVelocity, ASecondTrialMeasuresItsVelocityFromTheConfirmedPose) {
  ConstantVelocity model;
  move(&model);
  model.accept_on_trial({so3_exp({0, 0, 1}), {50, 0, 0}}, 3 * kFrame_us);
  model.accept_on_trial(kStart.boxplus(kStep).boxplus(2.0 * kStep), 4 * kFrame_us);
  EXPECT_LT((model.velocity_body() - 10.0 * kStep).norm(), 1e-10);
}

TEST(ConstantVelocity, AnAcceptedFrameConfirmsTheTrialBeforeIt) {
  ConstantVelocity model;
  move(&model);
  const SE3 trial{so3_exp({0, 0, 1}), {50, 0, 0}};
  model.accept_on_trial(trial, 3 * kFrame_us);
  model.accept(trial.boxplus(kStep), 4 * kFrame_us);
  EXPECT_EQ(difference(model.confirmed().T_world_body, trial.boxplus(kStep)), 0.0);
  EXPECT_LT((model.confirmed().velocity - 10.0 * kStep).norm(), 1e-10);
}

// --- corrections
// ---------------------------------------------------------------------------------------------------

LocalView view_of(std::vector<ViewKeyframe> keyframes, std::int32_t map_id = 1) {
  LocalView view;
  view.map_id = map_id;
  view.keyframes = std::move(keyframes);
  return view;
}

const SE3 kOld{so3_exp({0, 0, 0.3}), {1, 1, 0}}, kNew{so3_exp({0, 0.1, 0.5}), {2, 1, -1}};

TEST(ConstantVelocity, PosesFollowTheNewestKeyframeThatBothViewsContain) {
  ConstantVelocity model;
  move(&model);
  const SE3 trial{so3_exp({0, 0, 1}), {5, 0, 0}};
  model.accept_on_trial(trial, 3 * kFrame_us);
  const SE3 confirmed = model.confirmed().T_world_body;
  const Vector6d velocity = model.velocity_body();
  model.correct(view_of({{1, {}}, {2, kOld}, {5, {so3_exp({0, 0, 2}), {9, 9, 9}}}}),
                view_of({{1, {so3_exp({0, 0, 1}), {7, 7, 7}}}, {2, kNew}, {6, {}}}));
  const SE3 correction = kNew * kOld.inverse();
  EXPECT_LT(difference(model.newest().T_world_body, correction * trial), 1e-12);
  EXPECT_LT(difference(model.confirmed().T_world_body, correction * confirmed), 1e-12);
  EXPECT_EQ(model.velocity_body(), velocity);  // body axes
}

// Each keyframe has a correction of its own, as after a closed loop.
TEST(ConstantVelocity, PosesAndVelocitiesTakeTheScaleOfTheNewestCommonKeyframe) {
  ConstantVelocity model;
  move(&model);
  const SE3 trial{so3_exp({0, 0, 1}), {5, 0, 0}};
  model.accept_on_trial(trial, 3 * kFrame_us);
  const Motion newest = model.newest(), confirmed = model.confirmed();
  const double scale = model.correct(view_of({{1, {}, 1.0}, {2, kOld, 1.5}, {5, {}, 1.0}}),
                                     view_of({{1, {}, 7.0}, {2, kNew, 3.0}, {6, {}, 9.0}}));
  EXPECT_EQ(scale, 2.0);
  const Sim3 correction = Sim3{3.0, kNew.q, kNew.t} * Sim3{1.5, kOld.q, kOld.t}.inverse();
  EXPECT_LT(difference(model.newest().T_world_body, correction * newest.T_world_body), 1e-12);
  EXPECT_LT(difference(model.confirmed().T_world_body, correction * confirmed.T_world_body), 1e-12);
  EXPECT_EQ(model.newest().velocity.head<3>(), 2.0 * newest.velocity.head<3>());
  EXPECT_EQ(model.newest().velocity.tail<3>(), newest.velocity.tail<3>());
  EXPECT_EQ(model.confirmed().velocity.head<3>(), 2.0 * confirmed.velocity.head<3>());
  EXPECT_EQ(model.confirmed().velocity.tail<3>(), confirmed.velocity.tail<3>());
}

TEST(ConstantVelocity, PredictsInTheNewUnit) {
  ConstantVelocity model;
  move(&model);
  const Sim3 S{2.0, so3_exp({0, 0, 0.7}), {1, -4, 0}};
  model.correct(view_of({{1, kOld, 1.0}}), view_of({{1, S * kOld, 2.0}}));
  const SE3 predicted = kStart.boxplus(kStep).boxplus(kStep);
  EXPECT_LT(difference(model.predict(3 * kFrame_us).T_world_body, S * predicted), 1e-12);
}

TEST(ConstantVelocity, UnitStaysWhereViewsShareNoKeyframeOrAreOfDifferentMaps) {
  ConstantVelocity model;
  move(&model);
  EXPECT_EQ(model.correct(view_of({{1, kOld, 1.0}}), view_of({{2, kNew, 2.0}})), 1.0);
  EXPECT_EQ(model.correct(view_of({{1, kOld, 1.0}}, 1), view_of({{1, kNew, 2.0}}, 2)), 1.0);
  EXPECT_LT((model.velocity_body() - 10.0 * kStep).norm(), 1e-10);
}

TEST(ConstantVelocity, PosesStayWhereViewsShareNoKeyframeOrAreOfDifferentMaps) {
  ConstantVelocity model;
  move(&model);
  model.correct(view_of({{1, kOld}}), view_of({{2, kNew}}));
  model.correct(view_of({{1, kOld}}, 1), view_of({{1, kNew}}, 2));
  EXPECT_EQ(difference(model.newest().T_world_body, kStart.boxplus(kStep)), 0.0);
}

// --- extrapolation
// -------------------------------------------------------------------------------------------------

TEST(Motion, ExtrapolatesAlongTheArcOfItsVelocity) {
  Motion motion{.T_world_body = kStart};
  motion.velocity = vector6(10, 0, 0, 0, 0, 0.4);
  const double radius = 10 / 0.4, angle_rad = 0.4 * 2.5;
  const SE3 arc{so3_exp({0, 0, angle_rad}),
                {radius * std::sin(angle_rad), radius * (1 - std::cos(angle_rad)), 0}};
  const SE3 end = motion.extrapolated(2.5);
  // The arc is made of chords of 0.1 s, each in the direction of its start.
  EXPECT_LT((kStart * arc).boxminus_to(end).head<3>().norm(), 0.6);
  EXPECT_LT((kStart * arc).boxminus_to(end).tail<3>().norm(), 1e-9);
  EXPECT_GT(kStart.boxplus(2.5 * motion.velocity).boxminus_to(end).head<3>().norm(), 5.0);
  EXPECT_EQ(difference(motion.extrapolated(0.0), kStart), 0.0);
}

}  // namespace
}  // namespace farpoint::slam
