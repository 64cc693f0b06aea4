// SPDX-License-Identifier: Apache-2.0
#include "tools/trajectory/trajectory.h"

#include <cmath>
#include <cstdio>

#include "tools/common/errors.h"
#include "tools/common/text_file.h"

namespace farpoint::tools {
namespace {

constexpr std::string_view kTumLayout = "seconds tx ty tz qx qy qz qw";

// A rounded text form keeps the norm to a few parts in a thousand; more is another layout.
constexpr double kQuaternionNormTolerance = 0.05;

Eigen::Quaterniond read_quaternion(const FieldLine& line, bool* is_identity) {
  const Eigen::Quaterniond q(line.number_at(7, "qw"), line.number_at(4, "qx"), line.number_at(5, "qy"),
                             line.number_at(6, "qz"));
  const bool no_rotation_part = q.vec().isZero(0.0);
  *is_identity = no_rotation_part && (q.w() == 1.0 || q.w() == 0.0);
  if (*is_identity) return Eigen::Quaterniond::Identity();
  if (std::abs(q.norm() - 1.0) > kQuaternionNormTolerance) {
    line.fail("expected a unit quaternion qx qy qz qw, found one of length " + std::to_string(q.norm()));
  }
  return q.normalized();
}

}  // namespace

Trajectory read_tum(const std::filesystem::path& file) {
  const FieldFile text(file, kCommaAndBlanks);
  if (text.lines().empty())
    throw InputError(file.string() + ": no poses, expected lines '" + std::string(kTumLayout) + "'");
  Trajectory trajectory;
  trajectory.has_orientation = false;
  for (const FieldLine& line : text.lines()) {
    line.require_fields(8, kTumLayout);
    TimedPose pose;
    pose.time_s = line.seconds_at(0, "seconds");
    pose.pose.t = {line.number_at(1, "tx"), line.number_at(2, "ty"), line.number_at(3, "tz")};
    bool is_identity = false;
    pose.pose.q = read_quaternion(line, &is_identity);
    if (!is_identity) trajectory.has_orientation = true;
    if (!trajectory.poses.empty() && pose.time_s < trajectory.poses.back().time_s) {
      line.fail("time " + std::string(line.text(0)) +
                " lies before the line above, expected ascending times");
    }
    trajectory.poses.push_back(pose);
  }
  return trajectory;
}

std::string to_tum(const Trajectory& trajectory) {
  std::string text = "# seconds tx ty tz qx qy qz qw\n";
  char line[256];
  for (const TimedPose& p : trajectory.poses) {
    const int size =
        std::snprintf(line, sizeof line, "%.6f %.9f %.9f %.9f %.9f %.9f %.9f %.9f\n", p.time_s, p.pose.t.x(),
                      p.pose.t.y(), p.pose.t.z(), p.pose.q.x(), p.pose.q.y(), p.pose.q.z(), p.pose.q.w());
    text.append(line, std::min(static_cast<std::size_t>(size), sizeof line - 1));
  }
  return text;
}

void move_reference_point(const slam::SE3& T_body_point, Trajectory* trajectory) {
  for (TimedPose& p : trajectory->poses) p.pose = p.pose * T_body_point;
}

void start_at_origin(Trajectory* trajectory) {
  const slam::SE3 T_first_world = trajectory->poses.front().pose.inverse();
  for (TimedPose& p : trajectory->poses) p.pose = T_first_world * p.pose;
}

}  // namespace farpoint::tools
