// SPDX-License-Identifier: Apache-2.0
// Which axis of the truth points up, on made-up drives and flights.
#include "tools/report/upright.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/tools/made_run.h"
#include "tests/tools/tool_support.h"
#include "tools/report/report.h"

namespace farpoint::tools::report {
namespace {

// Camera axes in a body's: it looks ahead, or down with the front of the body on top of its images.
slam::SE3 looking_ahead() {
  Eigen::Matrix3d R;
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return {Eigen::Quaterniond(R), Eigen::Vector3d::Zero()};
}
slam::SE3 looking_down() {
  Eigen::Matrix3d R;
  R << 0, -1, 0, -1, 0, 0, 0, 0, -1;
  return {Eigen::Quaterniond(R), Eigen::Vector3d::Zero()};
}

// 200 m ahead, then in a curve to the left, 10 m up all the way. x ahead, z up.
Truth drive() {
  Truth truth;
  truth.T_body_camera0 = looking_ahead();
  for (int i = 0; i < 300; ++i) {
    const double yaw_rad = i < 200 ? 0.0 : 0.01 * (i - 200);
    slam::SE3 pose{Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ())),
                   Eigen::Vector3d::Zero()};
    if (i > 0) pose.t = truth.body.poses.back().pose * Eigen::Vector3d(1, 0, 0);
    pose.t.z() = i / 30.0;
    truth.body.poses.push_back({0.1 * i, pose, 0});
    truth.frame_utimes.push_back(100'000 * i);
  }
  return truth;
}

// The same in the axes of the first camera, as KITTI odometry has it.
Truth in_camera_axes(Truth truth) {
  for (TimedPose& p : truth.body.poses) p.pose = looking_ahead().inverse() * p.pose;
  return truth;
}

bool same(const Truth& a, const Truth& b) {
  for (std::size_t i = 0; i < a.body.poses.size(); ++i) {
    const slam::SE3 &p = a.body.poses[i].pose, &q = b.body.poses[i].pose;
    if (!(p.t - q.t).isZero(1e-9) || p.q.angularDistance(q.q) > 1e-9) return false;
  }
  return true;
}

TEST(Upright, TruthInCameraAxesIsTurnedUntilZPointsUp) {
  Truth truth = in_camera_axes(drive());
  ASSERT_FALSE(same(truth, drive()));
  EXPECT_EQ(turn_upright(&truth), "Its axis -y points up; x, y, z are here its z, -x, -y.");
  EXPECT_TRUE(same(truth, drive()));
}

TEST(Upright, TruthWhoseZPointsUpStays) {
  Truth truth = drive();
  EXPECT_EQ(turn_upright(&truth), "");
  EXPECT_TRUE(same(truth, drive()));
}

// The front of the vehicle is on top of the images, and the path leads there.
TEST(Upright, ACameraThatLooksDownTurnsNothing) {
  Truth truth = drive();
  truth.T_body_camera0 = looking_down();
  EXPECT_EQ(turn_upright(&truth), "");
  EXPECT_TRUE(same(truth, drive()));
}

TEST(Upright, WithoutACameraOrOrientationNothingIsTurned) {
  Truth text = in_camera_axes(drive()), positions = text;
  text.frame_utimes.clear();  // a text file
  positions.body.has_orientation = false;
  EXPECT_EQ(turn_upright(&text), "");
  EXPECT_EQ(turn_upright(&positions), "");
  Truth none;
  none.frame_utimes = {1, 2};
  EXPECT_EQ(turn_upright(&none), "");
}

TEST(Upright, PageTellsThatItTurnedTheTruth) {
  const ScratchFolder folder;
  const Trajectory truth = in_camera_axes(drive()).body;
  std::mt19937_64 random(3);
  MadeRun run;
  run.final_trajectory = disturbed(truth, 0.5, 0.02, &random);
  write_recording_log(folder / "recording.lcm", truth, "", Eigen::Vector3d::Zero());
  write_run_log(folder / "run.lcm", run);
  const Report report = make_report({{folder / "run.lcm"}, folder / "recording.lcm"});
  EXPECT_NE(report.page.find("Truth: recording.lcm. Its axis -y points up;"), std::string::npos);
  // The truth's height after 20 s; in the file it is -y.
  ASSERT_EQ(report.tables.size(), 1U);
  EXPECT_NE(report.tables[0].csv.find(",6.6667,"), std::string::npos);
  EXPECT_EQ(report.tables[0].csv.find(",-6.6667,"), std::string::npos);
}

}  // namespace
}  // namespace farpoint::tools::report
