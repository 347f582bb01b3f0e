// verdict - reads files that should hold a verdict.
#include "host_sim/diagnose/verdict/verdict_file.hpp"

#include <algorithm>

#include "codegen/src/io/input_error.hpp"
#include "codegen/src/io/json.hpp"
#include "host_sim/data/files/files.hpp"

namespace armcal::verdict {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

namespace {

bool IsTerm(const ordered_json& t) {
  if (!t.is_object() || !t.contains("kind") || !t.contains("joint") || !t.contains("parameters")) return false;
  return t.at("kind").is_string() && (t.at("joint").is_string() || t.at("joint").is_number()) &&
         t.at("parameters").is_object() && (!t.contains("confirmed") || t.at("confirmed").is_boolean());
}

// Errors of the joints; null: not finite.
bool IsListOfErrors(const ordered_json& j, std::size_t joints) {
  return j.is_array() && j.size() == joints &&
         std::all_of(j.begin(), j.end(), [](const auto& error) { return error.is_number() || error.is_null(); });
}

// It has what summaries and the fleet's database read.
bool IsVerdict(const ordered_json& j) {
  if (!j.is_object() || !j.contains("verdict")) return false;
  if (Failed(j)) return j.contains("error") && j.at("error").is_string();
  const bool known = j.at("verdict") == "none" || j.at("verdict") == "effect";
  if (!known || !j.contains("terms") || !j.contains("before_moving") || !j.contains("after_moving")) return false;
  const ordered_json& terms = j.at("terms");
  const std::size_t joints = j.at("before_moving").size();
  return terms.is_array() && std::all_of(terms.begin(), terms.end(), IsTerm) &&
         IsListOfErrors(j.at("before_moving"), joints) && IsListOfErrors(j.at("after_moving"), joints);
}

}  // namespace

std::string JointText(const ordered_json& joint) {
  return joint.is_string() ? joint.get<std::string>() : io::JsonText(joint);
}

ordered_json FailedVerdict(const std::string& why) { return {{"verdict", "failed"}, {"error", why}}; }
bool Failed(const ordered_json& verdict) { return verdict.at("verdict") == "failed"; }

ordered_json ReadVerdict(const fs::path& path) {
  ordered_json j = files::ReadJsonFile(path);
  return IsVerdict(j) ? j : FailedVerdict(path.filename().string() + " holds no verdict");
}

Verdicts ReadVerdicts(const std::vector<std::string>& paths) {
  Verdicts out;
  const auto add = [&](const fs::path& path) {
    const std::string name = path.stem().string();
    if (!out.emplace(name, ReadVerdict(path)).second)
      throw io::InputError(path.string() + ": expected one verdict of the name " + name);
  };
  for (const std::string& p : paths) {
    if (!fs::is_directory(p)) {
      add(p);
      continue;
    }
    for (const auto& e : fs::directory_iterator(p))
      if (e.path().extension() == ".json") add(e.path());
  }
  return out;
}

}  // namespace armcal::verdict
