// verdict - terms of a verdict become uses of their records.
#include "host_sim/diagnose/verdict/verdict_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/files/files.hpp"

namespace armcal::verdict {

namespace {

bool IsAmong(const codegen::EffectUse& use, const std::vector<std::string>& effects) {
  const std::string word = EffectWord(use.effect, use.joints);
  return std::any_of(effects.begin(), effects.end(),
                     [&](const std::string& e) { return e == use.effect || e == word; });
}

}  // namespace

std::string JointNumbers(const std::vector<int>& joints) {
  std::string out;
  for (const int j : joints) out += fmt::format("{}{}", out.empty() ? "" : "-", j + 1);
  return out;
}

std::string EffectWord(const std::string& record, const std::vector<int>& joints) {
  return record + (joints.empty() ? "" : ":") + JointNumbers(joints);
}

std::vector<codegen::EffectUse> ReadFound(const std::string& path, const std::vector<std::string>& effects) {
  std::vector<codegen::EffectUse> out;
  if (path.empty()) return out;
  try {
    const auto verdict = nlohmann::json::parse(files::ReadWholeFile(path));
    for (const auto& term : verdict.at("terms")) {
      codegen::EffectUse use;
      use.effect = term.at("record").get<std::string>();
      for (const int joint : term.at("joints")) use.joints.push_back(joint - 1);
      use.nonlinear = term.at("unknowns").get<std::map<std::string, double>>();
      if (!use.nonlinear.empty() && IsAmong(use, effects)) out.push_back(use);
    }
  } catch (const nlohmann::json::exception&) {
    throw io::InputError(path + ": expected a verdict that armcal diagnose --json wrote");
  }
  if (out.empty())
    throw io::InputError(
        fmt::format("{}: expected a term with nonlinear parameters among {}", path, fmt::join(effects, ", ")));
  return out;
}

}  // namespace armcal::verdict
