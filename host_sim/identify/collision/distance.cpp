// collision - distances by FCL's GJK.
#include "host_sim/identify/collision/distance.hpp"

#include <fcl/geometry/shape/box.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/geometry/shape/convex.h>
#include <fcl/geometry/shape/cylinder.h>
#include <fcl/geometry/shape/sphere.h>
#include <fcl/narrowphase/distance.h>

#include <exception>

namespace armcal::collision {
namespace {

struct FclSolid : Solid {
  explicit FclSolid(std::unique_ptr<fcl::CollisionGeometryd> g) : geometry(std::move(g)) {
    geometry->computeLocalAABB();
  }
  std::unique_ptr<fcl::CollisionGeometryd> geometry;
};

template <class Shape, class... Sizes>
SolidPtr MakeSolid(Sizes&&... sizes) {
  return std::make_shared<FclSolid>(std::make_unique<Shape>(std::forward<Sizes>(sizes)...));
}

}  // namespace

bool CanMeasure() { return true; }

SolidPtr Box(const Eigen::Vector3d& size) { return MakeSolid<fcl::Boxd>(size); }
SolidPtr Sphere(double radius) { return MakeSolid<fcl::Sphered>(radius); }
SolidPtr Cylinder(double radius, double length) { return MakeSolid<fcl::Cylinderd>(radius, length); }
SolidPtr Capsule(double radius, double length) { return MakeSolid<fcl::Capsuled>(radius, length); }

SolidPtr Polyhedron(const Hull& hull) {
  auto faces = std::make_shared<std::vector<int>>();
  for (const auto& face : hull.face) faces->insert(faces->end(), {3, face[0], face[1], face[2]});
  return MakeSolid<fcl::Convexd>(std::make_shared<const std::vector<Eigen::Vector3d>>(hull.corner),
                                 static_cast<int>(hull.face.size()), std::shared_ptr<const std::vector<int>>(faces));
}

Gap Between(const Solid& a, const Eigen::Isometry3d& pose_a, const Solid& b, const Eigen::Isometry3d& pose_b) {
  fcl::DistanceRequestd request(true);
  fcl::DistanceResultd result;
  double distance = 0;
  try {
    distance = fcl::distance(static_cast<const FclSolid&>(a).geometry.get(), pose_a,
                             static_cast<const FclSolid&>(b).geometry.get(), pose_b, request, result);
  } catch (const std::exception&) {
    return {};  // its GJK gives up where solids just touch
  }
  if (!(distance > 0)) return {};
  return {distance, result.nearest_points[0], result.nearest_points[1]};
}

}  // namespace armcal::collision
