// judged set - compares verdicts with the truth, and gives shares with their intervals.
//   judged_score CASES VERDICTS [OUT.json [NAME=PERCENT...]]: CASES/<case>/truth.json against VERDICTS/<case>.json
// Exit code 1: a case without a verdict, or a share of that name below the percentage.
#include <fmt/core.h>

#include <cmath>
#include <map>

#include "tests/practice/verdict.hpp"

namespace {

namespace fs = std::filesystem;
using namespace armcal::practice;

// The joint, and one of the signals that the truth reads (sgn(qd3) counts as qd3).
bool Localised(const json& term, const json& effect) {
  if (!SameJoint(term, effect)) return false;
  for (const json& signal : effect.at("depends_on"))
    for (const json& said : term.at("signals")) {
      const std::string a = signal.get<std::string>(), b = said.get<std::string>();
      if (a.find(b) != a.npos || b.find(a) != b.npos) return true;
    }
  return false;
}

// P(at most k of n) with probability p each.
double AtMost(int k, int n, double p) {
  if (k >= n) return 1;
  double sum = 0;
  for (int i = 0; i <= k; ++i)
    sum += std::exp(std::lgamma(n + 1.0) - std::lgamma(i + 1.0) - std::lgamma(n - i + 1.0) + i * std::log(p) +
                    (n - i) * std::log1p(-p));
  return sum;
}

struct Share {
  int good = 0, all = 0;
  void Add(bool ok) { good += ok, ++all; }
  double value() const { return all ? static_cast<double>(good) / all : 0; }
  // Clopper and Pearson: 95 %.
  double Limit(bool upper) const {
    if (all == 0 || (upper && good == all)) return all == 0 ? 0 : 1;
    if (!upper && good == 0) return 0;
    double low = 1e-12, high = 1 - 1e-12;
    for (int i = 0; i < 60; ++i) {
      const double p = (low + high) / 2, tail = upper ? AtMost(good, all, p) : 1 - AtMost(good - 1, all, p);
      ((tail > 0.025) == upper ? low : high) = p;
    }
    return low;
  }
  std::string Text() const {
    return fmt::format("{:4d} of {:4d}  {:5.1f} %  [{:5.1f}, {:5.1f}]", good, all, 100 * value(), 100 * Limit(false),
                       100 * Limit(true));
  }
  json Json() const { return {{"good", good}, {"all", all}, {"low", Limit(false)}, {"high", Limit(true)}}; }
};

using Shares = std::map<std::string, Share>;

// Intervals of 95 % that the verdict gives for parameters which the truth states.
void Cover(const json& term, const json& effect, Share& share) {
  if (term.at("kind") != effect.at("kind") || !effect.contains("parameters")) return;
  for (const auto& [name, value] : effect.at("parameters").items())
    for (const auto& [said, sd] : term.at("parameter_sd").items()) {
      const std::string of = said.substr(said.find('.') + 1);  // the name, then the joints
      if (!of.starts_with(name) || of.substr(name.size()).find_first_not_of("0123456789_") != of.npos) continue;
      const double error = term.at("parameters").at(said).get<double>() - value.get<double>();
      share.Add(std::abs(error) < 1.96 * sd.get<double>());
      break;
    }
}

std::string SizeBin(double size) {
  return size < 0.2 ? "size 0.1-0.2" : size < 0.5 ? "size 0.2-0.5" : size < 1 ? "size 0.5-1" : "size 1-2";
}

void Judge(const std::string& name, const json& truth, const json& verdict, Shares& shares, std::vector<double>& over) {
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
      over.push_back(verdict.at("after")[j].get<double>() / truth.at("test_floor_derived")[j].get<double>());
  }
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 3) throw std::runtime_error("usage: judged_score CASES VERDICTS [OUT.json [NAME=PERCENT...]]");
  Shares shares;
  std::vector<double> over, seconds;
  int missing = 0;
  for (const auto& entry : fs::directory_iterator(argv[1])) {
    const fs::path truth = entry.path() / "truth.json",
                   verdict = fs::path(argv[2]) / (entry.path().filename() += ".json");
    if (!fs::exists(truth)) continue;
    if (!fs::exists(verdict)) {
      ++missing;
      continue;
    }
    const json v = Read(verdict);
    Judge(entry.path().filename(), Read(truth), v, shares, over);
    seconds.push_back(v.at("seconds"));
  }
  json out;
  for (const auto& [name, share] : shares) {
    fmt::print("{:<44} {}\n", name, share.Text());
    out["shares"][name] = share.Json();
  }
  const auto quantile = [](std::vector<double> v, double p) {
    if (v.empty()) return std::nan("");
    std::sort(v.begin(), v.end());
    return v[std::min(v.size() - 1, static_cast<std::size_t>(p * static_cast<double>(v.size())))];
  };
  fmt::print("after / floor on affected joints: median {:.4f}, 90 % {:.4f} ({} joints)\n", quantile(over, 0.5),
             quantile(over, 0.9), over.size());
  fmt::print("seconds a case: median {:.2f}, longest {:.2f}\n", quantile(seconds, 0.5), quantile(seconds, 1));
  if (missing) fmt::print("{} cases have no verdict: the diagnosis failed on them\n", missing);
  if (argc >= 4) {
    out["after_over_floor"] = {{"median", quantile(over, 0.5)}, {"p90", quantile(over, 0.9)}, {"joints", over.size()}};
    out["missing"] = missing;
    std::ofstream(argv[3]) << out.dump(1) << "\n";
  }
  bool good = missing == 0;
  for (int k = 4; k < argc; ++k) {
    const std::string text = argv[k], name = text.substr(0, text.rfind('='));
    if (100 * shares[name].value() >= std::stod(text.substr(name.size() + 1))) continue;
    fmt::print("below what is asked for: {}\n", text);
    good = false;
  }
  return good ? 0 : 1;
} catch (const std::exception& e) {
  fmt::print(stderr, "judged_score: {}\n", e.what());
  return 2;
}
