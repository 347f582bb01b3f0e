// collision - reads STL and OBJ. Faces do not count, for only the hull is used.
#include "host_sim/identify/collision/mesh.hpp"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>

#include "codegen/src/io/require_file.hpp"

namespace armcal::collision {
namespace {

constexpr std::size_t kStlHead = 84, kStlTriangle = 50;

// A binary STL says in its head how many triangles it has. A text that begins with "solid" may be either.
bool IsBinaryStl(const std::string& bytes) {
  if (bytes.size() < kStlHead) return false;
  std::uint32_t triangles = 0;
  std::memcpy(&triangles, bytes.data() + kStlHead - 4, 4);
  return bytes.size() == kStlHead + kStlTriangle * std::size_t{triangles};
}

std::vector<Eigen::Vector3d> BinaryStl(const std::string& bytes) {
  std::vector<Eigen::Vector3d> corners;
  for (std::size_t at = kStlHead; at < bytes.size(); at += kStlTriangle)
    for (int corner = 1; corner <= 3; ++corner) {  // 0 is the normal
      float xyz[3];
      std::memcpy(xyz, bytes.data() + at + 12 * static_cast<std::size_t>(corner), sizeof xyz);
      corners.emplace_back(xyz[0], xyz[1], xyz[2]);
    }
  return corners;
}

// Lines that begin with this word and three numbers.
std::vector<Eigen::Vector3d> TextCorners(const std::string& text, const std::string& word) {
  std::vector<Eigen::Vector3d> corners;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string first;
    if (!(words >> first) || first != word) continue;
    Eigen::Vector3d corner = Eigen::Vector3d::Constant(NAN);
    words >> corner[0] >> corner[1] >> corner[2];
    if (!words) corner.setConstant(NAN);
    corners.push_back(corner);
  }
  return corners;
}

std::string LowerExtension(const std::filesystem::path& path) {
  std::string out = path.extension().string();
  for (char& c : out) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

}  // namespace

std::vector<Eigen::Vector3d> ReadMesh(const std::filesystem::path& path) {
  io::RequireFile(path);
  const std::string kind = LowerExtension(path);
  if (kind != ".stl" && kind != ".obj")
    throw io::InputError(
        path.string() +
        ": expected a mesh as STL or OBJ; convert it, or give the link a [[capsule]] in the robot file");
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  std::vector<Eigen::Vector3d> corners = kind == ".obj"       ? TextCorners(bytes, "v")
                                         : IsBinaryStl(bytes) ? BinaryStl(bytes)
                                                              : TextCorners(bytes, "vertex");
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
