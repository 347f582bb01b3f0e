// collision - replaces distance.cpp and mesh.cpp where the program is built without FCL or without Assimp.
#include <cstdlib>

#include "host_sim/identify/collision/distance.hpp"
#include "host_sim/identify/collision/mesh.hpp"

namespace armcal::collision {

bool CanMeasure() { return false; }

SolidPtr Box(const Eigen::Vector3d&) { std::abort(); }
SolidPtr Sphere(double) { std::abort(); }
SolidPtr Cylinder(double, double) { std::abort(); }
SolidPtr Capsule(double, double) { std::abort(); }
SolidPtr Polyhedron(const Hull&) { std::abort(); }
Gap Between(const Solid&, const Eigen::Isometry3d&, const Solid&, const Eigen::Isometry3d&) { std::abort(); }
std::vector<Eigen::Vector3d> ReadMesh(const std::filesystem::path&) { std::abort(); }

}  // namespace armcal::collision
