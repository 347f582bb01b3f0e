// bags - tells MATLAB files by their first bytes, or, for version 4, which has none, by the name.
#include <fstream>

#include "host_sim/data/bags/cursor.hpp"
#include "host_sim/data/bags/mat.hpp"

namespace armcal::bags {

bool IsMat(const std::filesystem::path& path) {
  char head[10] = {};
  std::ifstream in(path, std::ios::binary);
  in.read(head, sizeof head);
  const Bytes bytes(head, static_cast<std::size_t>(in.gcount()));
  return bytes == "MATLAB 5.0" || bytes == "MATLAB 7.3" || path.extension() == ".mat";
}

}  // namespace armcal::bags
