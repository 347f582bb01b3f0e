// robot - rotations with exact quarter turns, and modified DH frames.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "codegen/src/robot/robot.hpp"

namespace armcal::codegen {

// Rotation about a unit axis; exact at multiples of 90 degrees about a coordinate axis.
inline Eigen::Matrix3d Turn(double angle_rad, const Eigen::Vector3d& axis) {
  const double quarter = angle_rad / (std::numbers::pi / 2);
  if (std::abs(quarter - std::round(quarter)) > 1e-12) return Eigen::AngleAxisd(angle_rad, axis).toRotationMatrix();
  const Eigen::Matrix3d R = Eigen::AngleAxisd(angle_rad, axis).toRotationMatrix();
  return R.unaryExpr([](double v) { return std::abs(v - std::round(v)) < 1e-12 ? std::round(v) + 0.0 : v; });
}

// The shortest turn that brings z to this direction; half a turn about x if that is -z.
inline Eigen::Matrix3d TurnFromZ(const Eigen::Vector3d& direction) {
  const Eigen::Vector3d across = Eigen::Vector3d::UnitZ().cross(direction);
  const double angle = std::atan2(across.norm(), direction.z());
  const Eigen::Vector3d axis = across.norm() > 0 ? Eigen::Vector3d(across.normalized()) : Eigen::Vector3d::UnitX();
  return Turn(angle, axis);
}

// Fixed-axis roll, pitch, yaw: Rz(yaw) Ry(pitch) Rx(roll).
inline Eigen::Matrix3d RollPitchYaw(const Eigen::Vector3d& rpy_rad) {
  return Turn(rpy_rad[2], Eigen::Vector3d::UnitZ()) * Turn(rpy_rad[1], Eigen::Vector3d::UnitY()) *
         Turn(rpy_rad[0], Eigen::Vector3d::UnitX());
}

// Rx(alpha) Tx(a) Rz(theta) Tz(d) at joint position q.
inline Eigen::Isometry3d ModifiedDh(const JointKinematics& k, double q = 0) {
  const bool revolute = k.type == JointType::kRevolute;
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() =
      Turn(k.alpha_rad, Eigen::Vector3d::UnitX()) * Turn(k.theta_rad + (revolute ? q : 0), Eigen::Vector3d::UnitZ());
  T.translation() = Turn(k.alpha_rad, Eigen::Vector3d::UnitX()) * Eigen::Vector3d(k.a_m, 0, k.d_m + (revolute ? 0 : q));
  return T;
}

inline std::array<double, 3> Components(const Eigen::Vector3d& v) { return {v[0], v[1], v[2]}; }
inline std::array<double, 9> RowMajor(const Eigen::Matrix3d& R) {
  return {R(0, 0), R(0, 1), R(0, 2), R(1, 0), R(1, 1), R(1, 2), R(2, 0), R(2, 1), R(2, 2)};
}

inline Eigen::Isometry3d ToPose(const std::array<double, 3>& xyz_m, const std::array<double, 9>& rotation) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.translation() = Eigen::Vector3d(xyz_m.data());
  T.linear() = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rotation.data());
  return T;
}

// The same shape where its pose is seen from another frame. frame: the present frame, seen from that one.
inline Shape Moved(const Eigen::Isometry3d& frame, Shape shape) {
  const Eigen::Isometry3d T = frame * ToPose(shape.xyz_m, shape.rotation);
  shape.xyz_m = Components(T.translation()), shape.rotation = RowMajor(T.linear());
  return shape;
}

}  // namespace armcal::codegen
