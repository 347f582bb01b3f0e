// collision - reads meshes by Assimp. Faces do not count, for only the hull is used.
#include "host_sim/identify/collision/mesh.hpp"

#include <assimp/config.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <string>

#include "codegen/src/io/require_file.hpp"

namespace armcal::collision {
namespace {

std::string OneLine(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  while (!text.empty() && (text.back() == ' ' || text.back() == '.')) text.pop_back();
  return text;
}

// A node has a pose in its parent, and names meshes; nodes without parents are the file's.
std::vector<Eigen::Vector3d> CornersOf(const aiScene& scene) {
  std::vector<Eigen::Vector3d> corners;
  std::vector<std::pair<const aiNode*, aiMatrix4x4>> open{{scene.mRootNode, scene.mRootNode->mTransformation}};
  while (!open.empty()) {
    const auto [node, pose] = open.back();
    open.pop_back();
    for (unsigned k = 0; k < node->mNumMeshes; ++k) {
      const aiMesh& mesh = *scene.mMeshes[node->mMeshes[k]];
      for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
        const aiVector3D p = pose * mesh.mVertices[i];
        corners.emplace_back(p.x, p.y, p.z);
      }
    }
    for (unsigned k = 0; k < node->mNumChildren; ++k)
      open.emplace_back(node->mChildren[k], pose * node->mChildren[k]->mTransformation);
  }
  return corners;
}

}  // namespace

std::vector<Eigen::Vector3d> ReadMesh(const std::filesystem::path& path) {
  io::RequireFile(path);
  Assimp::Importer importer;
  // A URDF takes a COLLADA file's axes as they are; its unit counts.
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  const aiScene* const scene = importer.ReadFile(path.string(), 0);
  if (!scene || !scene->mRootNode)
    throw io::InputError(path.string() + ": expected a mesh as STL, OBJ or COLLADA (" +
                         OneLine(importer.GetErrorString()) +
                         "); convert it, or give the link a [[capsule]] in the robot file");
  std::vector<Eigen::Vector3d> corners = CornersOf(*scene);
  if (corners.empty()) throw io::InputError(path.string() + ": expected a mesh with corners, this one has none");
  for (const Eigen::Vector3d& corner : corners)
    if (!corner.allFinite()) throw io::InputError(path.string() + ": expected three finite numbers a corner");
  const auto before = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
  };
  std::sort(corners.begin(), corners.end(), before);
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
  return corners;
}

}  // namespace armcal::collision
