// SPDX-License-Identifier: Apache-2.0
// Rigid motions and similarities.
//
// Names: T_A_B maps coordinates of frame B into frame A, so T_A_C = T_A_B * T_B_C and p_A = T_A_B * p_B.
// Perturbation, used by every Jacobian of the project: right and decoupled, in the axes of B,
//     T_A_B [+] (dt, dphi) = { R_A_B * Exp(dphi), t_A_B + R_A_B * dt }        dt in units of A, dphi in rad.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace farpoint::slam {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Matrix23d = Eigen::Matrix<double, 2, 3>;

// [v]x, with skew(a) * b = a x b.
inline Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

// Exponential map of SO(3); exact to double precision near zero too. phi in rad.
Eigen::Quaterniond so3_exp(const Eigen::Vector3d& phi_rad);
// Inverse of so3_exp, |result| <= pi.
Eigen::Vector3d so3_log(const Eigen::Quaterniond& q);

// A rigid motion T_A_B: unit quaternion and translation, both double.
struct SE3 {
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  Eigen::Vector3d t = Eigen::Vector3d::Zero();

  [[nodiscard]] Eigen::Matrix3d rotation() const { return q.toRotationMatrix(); }
  [[nodiscard]] SE3 inverse() const {
    const Eigen::Quaterniond qi = q.conjugate();
    return {qi, -(qi * t)};
  }
  [[nodiscard]] SE3 operator*(const SE3& other) const {
    return {(q * other.q).normalized(), q * other.t + t};
  }
  [[nodiscard]] Eigen::Vector3d operator*(const Eigen::Vector3d& p) const { return q * p + t; }
  // This pose moved by delta = (dt, dphi) as defined at the top of this file.
  [[nodiscard]] SE3 boxplus(const Vector6d& delta) const {
    return {(q * so3_exp(delta.tail<3>())).normalized(), t + q * delta.head<3>()};
  }
  // delta with (*this).boxplus(delta) == other.
  [[nodiscard]] Vector6d boxminus_to(const SE3& other) const {
    Vector6d delta;
    delta.head<3>() = q.conjugate() * (other.t - t);
    delta.tail<3>() = so3_log(q.conjugate() * other.q);
    return delta;
  }
  [[nodiscard]] bool is_finite() const { return q.coeffs().allFinite() && t.allFinite(); }
};

// A similarity S_A_B: p_A = scale * R * p_B + t.
struct Sim3 {
  double scale = 1.0;
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  Eigen::Vector3d t = Eigen::Vector3d::Zero();

  [[nodiscard]] Eigen::Vector3d operator*(const Eigen::Vector3d& p) const { return scale * (q * p) + t; }
  [[nodiscard]] Sim3 operator*(const Sim3& o) const {
    return {scale * o.scale, (q * o.q).normalized(), scale * (q * o.t) + t};
  }
  // The pose of B' in A when T_B_B' is rigid: the rotation composes, the translation is scaled.
  [[nodiscard]] SE3 operator*(const SE3& pose) const { return {(q * pose.q).normalized(), (*this) * pose.t}; }
  [[nodiscard]] Sim3 inverse() const {
    const Eigen::Quaterniond qi = q.conjugate();
    return {1.0 / scale, qi, -(qi * t) / scale};
  }
};

}  // namespace farpoint::slam
