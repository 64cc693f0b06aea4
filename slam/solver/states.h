// SPDX-License-Identifier: Apache-2.0
// The states that a bundle problem solves for beside inverse depths: poses, motions, globals.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

#include "slam/geometry/body_state.h"
#include "slam/geometry/se3.h"

namespace farpoint::slam {

using Vector9d = Eigen::Matrix<double, 9, 1>;

// Where the body stood. Perturbation of 6: SE3::boxplus.
struct PoseState {
  static constexpr int kSize = 6;

  SE3 T_world_body;
  bool fixed = false;
};

// How the body moved at one pose, and the biases of its IMU then. Perturbation of 9: added entry by entry, in
// the order and the units of BodyState.
struct MotionState {
  static constexpr int kSize = 9;

  Eigen::Vector3d velocity_world = Eigen::Vector3d::Zero();
  Eigen::Vector3d gyroscope_bias_rad_per_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d accelerometer_bias_m_per_s2 = Eigen::Vector3d::Zero();
  bool fixed = false;

  void move(const Vector9d& delta) {
    velocity_world += delta.head<3>();
    gyroscope_bias_rad_per_s += delta.segment<3>(3);
    accelerometer_bias_m_per_s2 += delta.tail<3>();
  }
};

// A value that the whole problem shares: a direction of gravity, a scale, a wheel factor.
struct GlobalState {
  enum class Kind : std::uint8_t {
    kReal,       // value.x(); a perturbation adds to it
    kPositive,   // value.x() > 0; a perturbation d multiplies it by exp(d)
    kDirection,  // value, a unit vector; a perturbation of 2 turns it about the axes of tangent()
  };

  Kind kind = Kind::kReal;
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  bool fixed = false;

  [[nodiscard]] static GlobalState real(double value) { return {Kind::kReal, {value, 0.0, 0.0}}; }
  // Precondition: value > 0.
  [[nodiscard]] static GlobalState positive(double value) { return {Kind::kPositive, {value, 0.0, 0.0}}; }
  [[nodiscard]] static GlobalState direction(const Eigen::Vector3d& value) {
    return {Kind::kDirection, value.normalized()};
  }

  [[nodiscard]] int size() const { return kind == Kind::kDirection ? 2 : 1; }
  // Two unit axes across the direction; each column is the axis of one entry of the perturbation.
  [[nodiscard]] Eigen::Matrix<double, 3, 2> tangent() const {
    Eigen::Index smallest = 0;
    value.cwiseAbs().minCoeff(&smallest);
    Eigen::Matrix<double, 3, 2> axes;
    axes.col(0) = value.cross(Eigen::Vector3d::Unit(smallest)).normalized();
    axes.col(1) = value.cross(axes.col(0));
    return axes;
  }
  // Only the first size() entries of the perturbation count.
  void move(const Eigen::Vector2d& delta) {
    switch (kind) {
      case Kind::kReal:
        value.x() += delta.x();
        break;
      case Kind::kPositive:
        value.x() *= std::exp(delta.x());
        break;
      case Kind::kDirection:
        value = (so3_exp(tangent() * delta) * value).normalized();
        break;
    }
  }
};

// Names one state of a problem.
struct StateBlock {
  enum class Kind : std::uint8_t { kPose, kMotion, kGlobal };

  Kind kind = Kind::kPose;
  int index = 0;  // in the problem's list of that kind

  [[nodiscard]] static StateBlock pose(int index) { return {Kind::kPose, index}; }
  [[nodiscard]] static StateBlock motion(int index) { return {Kind::kMotion, index}; }
  [[nodiscard]] static StateBlock global(int index) { return {Kind::kGlobal, index}; }
};

// The states of one problem as factors read them. Owns nothing.
struct StateWindow {
  std::span<const PoseState> poses;
  std::span<const MotionState> motions;
  std::span<const GlobalState> globals;

  [[nodiscard]] const SE3& T_world_body(int pose) const {
    return poses[static_cast<std::size_t>(pose)].T_world_body;
  }
  [[nodiscard]] const MotionState& motion(int index) const {
    return motions[static_cast<std::size_t>(index)];
  }
  [[nodiscard]] const GlobalState& global(int index) const {
    return globals[static_cast<std::size_t>(index)];
  }
  // A pose and a motion together, as inertial factors use them.
  [[nodiscard]] BodyState body(int pose, int motion_index) const {
    const MotionState& m = motion(motion_index);
    return {T_world_body(pose), m.velocity_world, m.gyroscope_bias_rad_per_s, m.accelerometer_bias_m_per_s2};
  }

  [[nodiscard]] bool is_fixed(StateBlock block) const {
    switch (block.kind) {
      case StateBlock::Kind::kPose:
        return poses[static_cast<std::size_t>(block.index)].fixed;
      case StateBlock::Kind::kMotion:
        return motion(block.index).fixed;
      case StateBlock::Kind::kGlobal:
        break;
    }
    return global(block.index).fixed;
  }
  // Entries of the block's perturbation.
  [[nodiscard]] int size(StateBlock block) const {
    switch (block.kind) {
      case StateBlock::Kind::kPose:
        return PoseState::kSize;
      case StateBlock::Kind::kMotion:
        return MotionState::kSize;
      case StateBlock::Kind::kGlobal:
        break;
    }
    return global(block.index).size();
  }
};

}  // namespace farpoint::slam
