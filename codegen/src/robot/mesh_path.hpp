// robot - finds the file that a URDF means by the name of a mesh.
#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace armcal::codegen {

// name: a path seen from the URDF, an absolute one, file://.., or package://NAME/... A package lies where `packages`
// says; else in a folder of ROS_PACKAGE_PATH or of AMENT_PREFIX_PATH; else it is a folder above the URDF, or beside
// one of those. Empty: there is no such file.
std::filesystem::path MeshFile(const std::string& name, const std::filesystem::path& urdf,
                               const std::map<std::string, std::filesystem::path>& packages);

}  // namespace armcal::codegen
