// judged set - compares verdicts with the truth, and gives shares with their intervals.
//   judged_score CASES VERDICTS [OUT.json [NAME=PERCENT...]]: CASES/<case>/truth.json against VERDICTS/<case>.json;
// beside OUT.json, failures.md lists the cases of set II that are not right, and what was said of them.
// Exit code 1: a case without a verdict, or a share of that name below the percentage.
#include <fmt/core.h>

#include <sstream>

#include "tests/judged/shares.hpp"

namespace {

namespace fs = std::filesystem;
using namespace armcal::practice;
using namespace armcal::judged;

bool Localised(const json& term, const json& effect) { return SameJoint(term, effect) && SameSignal(term, effect); }

std::string SizeBin(double size) {
  return size < 0.2 ? "size 0.1-0.2" : size < 0.5 ? "size 0.2-0.5" : size < 1 ? "size 0.5-1" : "size 1-2";
}

void JudgeSetOne(const std::string& name, const json& truth, const json& verdict, Tally& tally) {
  auto& shares = tally.shares;
  const std::vector<json> terms = Confirmed(verdict);
  const json& effects = truth.at("effects");
  const std::string noise = "noise " + truth.at("noise_class").get<std::string>();
  for (std::size_t j = 0; j < verdict.at("noise_floor").size(); ++j) {
    const double ratio = verdict.at("noise_floor")[j].get<double>() / truth.at("test_floor_derived")[j].get<double>();
    shares["noise floor within 5 %"].Add(std::abs(ratio - 1) < 0.05);
  }
  if (effects.empty()) {
    shares["controls: silent"].Add(terms.empty());
    shares["controls, " + noise].Add(terms.empty());
    return;
  }
  const bool detection = name.starts_with("detection"), unknown = effects[0].at("kind") == "unknown";
  if (effects.size() == 2) {
    shares["pairs: both named"].Add(AllNamed(verdict, truth));
  } else if (unknown) {
    shares["unknown: joint and signal"].Add(!terms.empty() && Localised(terms[0], effects[0]));
  } else {
    const json& e = effects[0];
    const bool joint = !terms.empty() && SameJoint(terms[0], e), right = joint && Names(terms[0], e);
    const std::string kind = e.at("kind");
    if (detection) {
      shares[e.at("run_state").get<bool>() ? "detection: joint, of one run" : "detection: joint, static"].Add(joint);
      shares["detection, " + kind].Add(joint);
    } else {
      shares["single: kind or class, and joint"].Add(right);
      shares["single: joint"].Add(joint);
      shares["single, " + kind].Add(right);
      shares["single, " + SizeBin(e.at("size"))].Add(right);
      shares["single, " + noise].Add(right);
      shares[e.at("held_by_a_record").get<bool>() ? "single, form of a record" : "single, form of no record"].Add(
          right);
    }
  }
  for (const json& e : effects)
    for (const json& t : terms)
      if (SameJoint(t, e)) Cover(t, e, shares["parameters: 95 % interval holds the truth"]);
  for (std::size_t j = 0; j < verdict.at("after").size() && !detection; ++j) {
    bool affected = false, run_state = false;
    for (const json& e : effects) {
      affected = affected || e.at("visible_ratio")[j].get<double>() > kAffected;
      run_state = run_state || e.at("run_state").get<bool>();
    }
    if (affected && !run_state)
      tally.over.push_back(verdict.at("after")[j].get<double>() / truth.at("test_floor_derived")[j].get<double>());
  }
}

std::string Text(const fs::path& path) {
  std::ostringstream out;
  out << std::ifstream(path).rdbuf();
  return out.str();
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 3) throw std::runtime_error("usage: judged_score CASES VERDICTS [OUT.json [NAME=PERCENT...]]");
  Tally tally;
  std::vector<double> seconds;
  std::vector<fs::path> cases;
  for (const auto& entry : fs::directory_iterator(argv[1]))
    if (fs::exists(entry.path() / "truth.json")) cases.push_back(entry.path());
  std::sort(cases.begin(), cases.end());
  for (const fs::path& one : cases) {
    const std::string name = one.filename();
    const fs::path verdict = fs::path(argv[2]) / (name + ".json"), said = fs::path(argv[2]) / (name + ".txt");
    const json truth = Read(one / "truth.json"), v = fs::exists(verdict) ? Read(verdict) : json();
    if (!v.is_null()) seconds.push_back(v.at("seconds"));
    if (truth.value("set", 1) == 2) {
      if (fs::exists(said)) JudgeSetTwo(name, truth, v, Text(said), tally);
    } else if (v.is_null()) {
      ++tally.missing;
    } else {
      JudgeSetOne(name, truth, v, tally);
    }
  }
  json out;
  for (const auto& [name, share] : tally.shares) {
    fmt::print("{:<52} {}\n", name, share.Text());
    out["shares"][name] = share.Json();
  }
  if (tally.judged) {
    const double per_case = static_cast<double>(tally.spurious) / tally.judged;
    fmt::print("II confirmed terms that touch no effect: {} in {} cases, {:.3f} a case\n", tally.spurious, tally.judged,
               per_case);
    out["spurious_a_case"] = per_case;
  }
  fmt::print("after / floor on affected joints: median {:.4f}, 90 % {:.4f} ({} joints)\n", Quantile(tally.over, 0.5),
             Quantile(tally.over, 0.9), tally.over.size());
  fmt::print("seconds a case: median {:.2f}, longest {:.2f}\n", Quantile(seconds, 0.5), Quantile(seconds, 1));
  if (tally.missing) fmt::print("{} cases have no verdict: the diagnosis failed on them\n", tally.missing);
  if (argc >= 4) {
    out["after_over_floor"] = {
        {"median", Quantile(tally.over, 0.5)}, {"p90", Quantile(tally.over, 0.9)}, {"joints", tally.over.size()}};
    out["missing"] = tally.missing;
    std::ofstream(argv[3]) << out.dump(1) << "\n";
    std::ofstream failures(fs::path(argv[3]).replace_filename("failures.md"));
    for (const std::string& line : tally.failures) failures << "- " << line << "\n";
  }
  bool good = tally.missing == 0;
  for (int k = 4; k < argc; ++k) {
    const std::string text = argv[k], name = text.substr(0, text.rfind('='));
    if (100 * tally.shares[name].value() >= std::stod(text.substr(name.size() + 1))) continue;
    fmt::print("below what is asked for: {}\n", text);
    good = false;
  }
  return good ? 0 : 1;
} catch (const std::exception& e) {
  fmt::print(stderr, "judged_score: {}\n", e.what());
  return 2;
}
