// collision - the corners of a mesh file.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <vector>

namespace armcal::collision {

// STL, OBJ, COLLADA, and what else Assimp reads; each corner once. A COLLADA file's unit counts, its up axis does not.
// Throws io::InputError: another kind of file, a mesh without corners, a number that is none. CanMeasure() must hold.
std::vector<Eigen::Vector3d> ReadMesh(const std::filesystem::path& path);

}  // namespace armcal::collision
