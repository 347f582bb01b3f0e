// tool - JSON files.
#include "host_sim/tool/verb.hpp"

#include "host_sim/data/files/files.hpp"

namespace armcal::tool {

void WriteJson(const std::string& path, const nlohmann::ordered_json& j) {
  if (!path.empty()) files::WriteWholeFile(path, j.dump(1) + "\n");
}

}  // namespace armcal::tool
