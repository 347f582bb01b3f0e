// practice - compares verdicts with the truth that lies beside each case; knows no model.
//   practice_score CASES_DIR VERDICTS_DIR: one line a case, one total; VERDICTS_DIR holds <case>.json
#include <fmt/core.h>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <set>

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double kAllowed = 1.03;  // after over the RMS that the perfect model leaves
constexpr double kAffected = 0.1;  // visible share of the noise from which a joint counts as affected

json Read(const fs::path& path) {
  std::ifstream in(path);
  if (!in) throw std::runtime_error(path.string() + ": cannot be read");
  return json::parse(in);
}

// 3, "5-6", [5, 6] as one spelling.
std::string Joints(const json& j) {
  std::set<std::string> numbers;
  if (j.is_number()) return std::to_string(j.get<int>());
  if (j.is_array())
    for (const json& one : j) numbers.insert(std::to_string(one.get<int>()));
  else {
    const std::string text = j;
    const auto dash = text.find('-');
    if (dash == text.npos) return text;
    numbers = {text.substr(0, dash), text.substr(dash + 1)};
  }
  std::string out;
  for (const auto& n : numbers) out += (out.empty() ? "" : "-") + n;
  return out;
}

// The term names the truth, or says that it cannot be told from it.
bool Names(const json& term, const json& truth) {
  std::set<std::string> kinds{term["kind"].get<std::string>()};
  for (const json& also : term["also_fits"]) kinds.insert(also.get<std::string>());
  const auto accepted = [&](const json& kind) { return kinds.contains(kind.get<std::string>()); };
  const json& accept = truth.contains("accept_kinds") ? truth["accept_kinds"] : json::array({truth["kind"]});
  return std::any_of(accept.begin(), accept.end(), accepted) && Joints(term["joint"]) == Joints(truth["joint"]);
}

// Each true effect is among as many first terms as there are effects.
bool Right(const json& verdict, const json& truth) {
  const auto& effects = truth["effects"];
  if (effects.empty()) return verdict["verdict"] == "none";
  std::vector<json> first;
  for (const json& t : verdict["terms"])
    if (t["confirmed"].get<bool>() && first.size() < effects.size()) first.push_back(t);
  return std::all_of(effects.begin(), effects.end(), [&](const json& e) {
    return std::any_of(first.begin(), first.end(), [&](const json& t) { return Names(t, e); });
  });
}

double WorstRatio(const json& verdict, const json& truth) {
  double worst = 0;
  for (std::size_t j = 0; j < verdict["after"].size(); ++j) {
    double visible = truth["effects"].empty() ? 1 : 0;
    for (const json& e : truth["effects"]) visible = std::max(visible, e["visible_ratio"][j].get<double>());
    if (visible < kAffected) continue;
    worst = std::max(worst, verdict["after"][j].get<double>() / truth["test_floor_derived"][j].get<double>());
  }
  return worst;
}

std::string Said(const json& list) {
  std::string out;
  for (const json& t : list) {
    out += (out.empty() ? "" : ", ") + t["kind"].get<std::string>() + " " + Joints(t["joint"]);
    for (const json& also : t.value("also_fits", json::array())) out += "|" + also.get<std::string>();
    if (t.contains("confirmed") && !t["confirmed"].get<bool>()) out += " (not confirmed)";
  }
  return out.empty() ? "none" : out;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 3) throw std::runtime_error("usage: practice_score CASES_DIR VERDICTS_DIR");
  std::vector<fs::path> cases;
  for (const auto& entry : fs::directory_iterator(argv[1]))
    if (fs::exists(entry.path() / "truth.json")) cases.push_back(entry.path());
  std::sort(cases.begin(), cases.end());
  int right = 0, near_floor = 0, both = 0;
  double slowest_s = 0;
  for (const fs::path& c : cases) {
    const std::string name = c.filename().string();
    const json truth = Read(c / "truth.json");
    const fs::path file = fs::path(argv[2]) / (name + ".json");
    if (!fs::exists(file)) {
      fmt::print("{}  no verdict; truth: {}\n", name, Said(truth["effects"]));
      continue;
    }
    const json verdict = Read(file);
    const bool ok = Right(verdict, truth);
    const double ratio = WorstRatio(verdict, truth), seconds = verdict["seconds"];
    right += ok, near_floor += ratio <= kAllowed, both += ok && ratio <= kAllowed;
    slowest_s = std::max(slowest_s, seconds);
    fmt::print("{}  {:5}  after/floor {:.3f}  {:4.1f} s  truth: {}  found: {}\n", name, ok ? "ok" : "WRONG", ratio,
               seconds, Said(truth["effects"]), Said(verdict["terms"]));
  }
  fmt::print("{} cases: {} named, {} with after <= {:.2f} x floor, {} both; slowest {:.1f} s\n", cases.size(), right,
             near_floor, kAllowed, both, slowest_s);
  return both == static_cast<int>(cases.size()) ? 0 : 1;
} catch (const std::exception& e) {
  std::cerr << e.what() << "\n";
  return 2;
}
