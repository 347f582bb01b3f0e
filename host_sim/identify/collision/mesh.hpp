// collision - the corners of a mesh file.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <vector>

namespace armcal::collision {

// STL, binary or text, and Wavefront OBJ; each corner once. Throws io::InputError: another kind of file, a mesh without
// corners, a number that is none.
std::vector<Eigen::Vector3d> ReadMesh(const std::filesystem::path& path);

}  // namespace armcal::collision
