// collision - how far two convex solids are from each other. distance.cpp is the only file that sees FCL.
#pragma once

#include <Eigen/Geometry>
#include <memory>

#include "host_sim/identify/collision/hull.hpp"

namespace armcal::collision {

// A solid in its own axes; cylinders and capsules lie along z, their middle at zero.
class Solid {
 public:
  virtual ~Solid() = default;
};
using SolidPtr = std::shared_ptr<const Solid>;

bool CanMeasure();  // false: the program was built without FCL; then nothing below may be called

SolidPtr Box(const Eigen::Vector3d& size);
SolidPtr Sphere(double radius);
SolidPtr Cylinder(double radius, double length);
SolidPtr Capsule(double radius, double length);  // length: without the round ends
SolidPtr Polyhedron(const Hull& hull);

// The nearest points, seen from where the poses are seen. Solids that touch or overlap: distance 0, no points.
struct Gap {
  double distance = 0;
  Eigen::Vector3d on_a = Eigen::Vector3d::Zero(), on_b = Eigen::Vector3d::Zero();
};
Gap Between(const Solid& a, const Eigen::Isometry3d& pose_a, const Solid& b, const Eigen::Isometry3d& pose_b);

}  // namespace armcal::collision
