// practice - compares verdicts with the truth that lies beside each case.
//   practice_score CASES_DIR VERDICTS_DIR: one line a case, one total; VERDICTS_DIR holds <case>.json
#include <fmt/core.h>

#include <iostream>

#include "tests/practice/verdict.hpp"

namespace {

namespace fs = std::filesystem;
using namespace armcal::practice;

constexpr double kAllowed = 1.03;  // after over the RMS that the perfect model leaves

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
    const bool ok = AllNamed(verdict, truth);
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
