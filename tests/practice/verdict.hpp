// practice - reads what a verdict says of an effect, and whether it is the truth.
#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

namespace armcal::practice {

using nlohmann::json;

inline constexpr int kMostNames = 3;      // a term with more names says nothing
inline constexpr double kAffected = 0.1;  // visible share of the noise from which a joint counts as affected

inline json Read(const std::filesystem::path& path) {
  std::ifstream in(path);
  if (!in) throw std::runtime_error(path.string() + ": cannot be read");
  return json::parse(in);
}

// 3, "5-6", [5, 6] as one spelling.
inline std::string Joints(const json& j) {
  if (j.is_number()) return std::to_string(j.get<int>());
  std::set<std::string> numbers;
  if (j.is_array()) {
    for (const json& one : j) numbers.insert(std::to_string(one.get<int>()));
  } else {
    const std::string text = j;
    const auto dash = text.find('-');
    if (dash == text.npos) return text;
    numbers = {text.substr(0, dash), text.substr(dash + 1)};
  }
  std::string out;
  for (const auto& n : numbers) out += (out.empty() ? "" : "-") + n;
  return out;
}

inline bool SameJoint(const json& term, const json& effect) {
  return Joints(term.at("joint")) == Joints(effect.at("joint"));
}

// The term names the effect, or says that it cannot be told from it.
inline bool Names(const json& term, const json& effect) {
  std::set<std::string> kinds{term.at("kind").get<std::string>()};
  for (const json& also : term.at("also_fits")) kinds.insert(also.get<std::string>());
  if (static_cast<int>(kinds.size()) > kMostNames || !SameJoint(term, effect)) return false;
  const json accept = effect.value("accept_kinds", json::array({effect.at("kind")}));
  return std::any_of(accept.begin(), accept.end(),
                     [&](const json& kind) { return kinds.contains(kind.get<std::string>()); });
}

inline std::vector<json> Confirmed(const json& verdict) {
  std::vector<json> terms;
  for (const json& t : verdict.at("terms"))
    if (t.at("confirmed").get<bool>()) terms.push_back(t);
  return terms;
}

// Each true effect is among as many first terms as there are effects; where there is none, nothing is said.
inline bool AllNamed(const json& verdict, const json& truth) {
  const json& effects = truth.at("effects");
  std::vector<json> terms = Confirmed(verdict);
  if (effects.empty()) return terms.empty();
  terms.resize(std::min(terms.size(), effects.size()));
  return std::all_of(effects.begin(), effects.end(), [&](const json& e) {
    return std::any_of(terms.begin(), terms.end(), [&](const json& t) { return Names(t, e); });
  });
}

}  // namespace armcal::practice
