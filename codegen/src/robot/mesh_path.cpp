// robot - looks for a mesh where ROS would, and then near the URDF.
#include "codegen/src/robot/mesh_path.hpp"

#include <cstdlib>
#include <sstream>
#include <string_view>
#include <vector>

namespace armcal::codegen {
namespace {

namespace fs = std::filesystem;

// The folders of a variable such as ROS_PACKAGE_PATH.
std::vector<fs::path> FoldersOf(const char* variable) {
  std::vector<fs::path> folders;
  const char* const value = std::getenv(variable);
  std::istringstream list(value ? value : "");
  for (std::string folder; std::getline(list, folder, ':');)
    if (!folder.empty()) folders.emplace_back(folder);
  return folders;
}

// The places where a package may lie, the likeliest first.
std::vector<fs::path> PlacesOf(const std::string& package, const fs::path& urdf,
                               const std::map<std::string, fs::path>& packages) {
  if (const auto given = packages.find(package); given != packages.end()) return {given->second};
  std::vector<fs::path> places;
  const auto folder = [&](const fs::path& one) {
    if (one.filename() == package) places.push_back(one);
    places.push_back(one / package);
  };
  for (const fs::path& one : FoldersOf("ROS_PACKAGE_PATH")) folder(one);
  for (const fs::path& one : FoldersOf("AMENT_PREFIX_PATH")) folder(one / "share");
  for (fs::path above = fs::absolute(urdf).parent_path(); above.has_relative_path(); above = above.parent_path())
    folder(above);
  return places;
}

}  // namespace

fs::path MeshFile(const std::string& name, const fs::path& urdf, const std::map<std::string, fs::path>& packages) {
  constexpr std::string_view kPackage = "package://", kFile = "file://";
  std::vector<fs::path> candidates;
  if (name.starts_with(kPackage)) {
    const std::string rest = name.substr(kPackage.size());
    const auto slash = std::min(rest.find('/'), rest.size());
    for (const fs::path& place : PlacesOf(rest.substr(0, slash), urdf, packages))
      candidates.push_back(place / rest.substr(std::min(slash + 1, rest.size())));
  } else {
    candidates.push_back(urdf.parent_path() / (name.starts_with(kFile) ? name.substr(kFile.size()) : name));
  }
  std::error_code error;
  for (const fs::path& candidate : candidates)
    if (fs::is_regular_file(candidate, error)) return candidate.lexically_normal();
  return {};
}

}  // namespace armcal::codegen
