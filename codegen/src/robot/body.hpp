// robot - a rigid body in any frame, and two bodies as one.
#pragma once

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cstdio>
#include <string>

#include "codegen/src/robot/frames.hpp"

namespace armcal::codegen {

// Longer ones are in millimetres: of a link or a centre of mass, and of a slide's travel.
inline constexpr double kLongest = 20, kLongestTravel = 100;  // m

struct Body {
  double mass = 0;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  // about the centre
};

inline Eigen::Matrix3d Symmetric(double xx, double xy, double xz, double yy, double yz, double zz) {
  Eigen::Matrix3d I;
  I << xx, xy, xz, xy, yy, yz, xz, yz, zz;
  return I;
}
inline Eigen::Matrix3d Symmetric(const std::array<double, 6>& i) {
  return Symmetric(i[0], i[1], i[2], i[3], i[4], i[5]);
}

// The same body in another frame. The pose is that of the body's present frame, seen from the other one.
inline Body Moved(const Eigen::Isometry3d& pose, const Body& body) {
  return {body.mass, pose * body.center, pose.linear() * body.inertia * pose.linear().transpose()};
}

inline void Merge(Body& into, const Body& other) {
  if (other.mass == 0) return;  // a frame, whatever inertia somebody wrote for it
  const double mass = into.mass + other.mass;
  if (mass <= 0) return;
  const Eigen::Vector3d center = (into.mass * into.center + other.mass * other.center) / mass;
  const auto steiner = [&](const Body& b) -> Eigen::Matrix3d {
    const Eigen::Vector3d r = b.center - center;
    return b.mass * (r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose());
  };
  into.inertia += other.inertia + steiner(into) + steiner(other);
  into.mass = mass, into.center = center;
}

// Published figures are rounded and measured: a moment of inertia may pass the sum of the others by this much of it.
inline constexpr double kPublished = 0.2;

// Empty, or what a body that can exist has and this one has not, in kg and kg m^2. slack: how far the largest moment of
// inertia may pass the sum of the others, as a share of it.
inline std::string Impossible(const Body& body, double slack = 0) {
  const auto number = [](double v) {
    char text[32];
    std::snprintf(text, sizeof text, "%.4g", v);
    return std::string(text);
  };
  constexpr double kRounding = 1e-9;
  if (!(body.mass > 0)) return "a mass above zero, not " + number(body.mass) + " kg";
  const Eigen::Vector3d moment =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(body.inertia, Eigen::EigenvaluesOnly).eigenvalues();
  const std::string found =
      ", not " + number(moment[0]) + ", " + number(moment[1]) + " and " + number(moment[2]) + " kg m^2";
  if (!(moment[0] > 0)) return "principal moments of inertia above zero" + found;
  if (!((1 + slack) * (moment[0] + moment[1]) - moment[2] > kRounding * moment[2]))
    return "principal moments of inertia of which none is as large as the sum of the other two" + found;
  return "";
}

// So little is missing that rounding explains it.
inline bool IsRounded(const Body& body) { return !Impossible(body).empty() && Impossible(body, kPublished).empty(); }

// An inertia that no frame can have, of a link without mass.
inline bool HasInertiaOnly(const Body& body) { return body.mass == 0 && !body.inertia.isZero(); }

// Near a body that cannot exist: the second moments of its mass are raised to a thousandth of their sum at least. For
// moments of inertia above zero.
inline Body NearestPossible(const Body& body) {
  constexpr double kLeast = 1e-3;
  const Eigen::Matrix3d unit = Eigen::Matrix3d::Identity();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(0.5 * body.inertia.trace() * unit - body.inertia);
  const Eigen::Vector3d second = axes.eigenvalues().cwiseMax(kLeast * axes.eigenvalues().sum());
  const Eigen::Matrix3d mended = axes.eigenvectors() * second.asDiagonal() * axes.eigenvectors().transpose();
  return {body.mass, body.center, mended.trace() * unit - mended};
}

inline Link ToLink(const Body& body) {
  const Eigen::Matrix3d& I = body.inertia;
  return {body.mass, Components(body.center), {I(0, 0), I(0, 1), I(0, 2), I(1, 1), I(1, 2), I(2, 2)}};
}

inline Body ToBody(const Link& link) {
  return {link.mass_kg, Eigen::Vector3d(link.center_m.data()), Symmetric(link.inertia_kgm2)};
}

}  // namespace armcal::codegen
