// judged set - counts shares and gives their 95 % intervals.
#pragma once

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "tests/practice/verdict.hpp"

namespace armcal::judged {

using nlohmann::json;

// P(at most k of n) with probability p each.
inline double AtMost(int k, int n, double p) {
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

inline double Quantile(std::vector<double> v, double p) {
  if (v.empty()) return std::nan("");
  std::sort(v.begin(), v.end());
  return v[std::min(v.size() - 1, static_cast<std::size_t>(p * static_cast<double>(v.size())))];
}

// What all cases say together.
struct Tally {
  std::map<std::string, Share> shares;
  std::vector<double> over;           // RMS after over the plant's floor, of each affected joint
  std::vector<std::string> failures;  // a line each
  int judged = 0, spurious = 0;       // cases; confirmed terms that touch nothing of the truth
  int missing = 0;
};

// The term reads one of the signals that the truth reads (sgn(qd3) counts as qd3, and so does qd[j]3).
inline bool SameSignal(const json& term, const json& effect) {
  const auto plain = [](std::string text) {
    const std::size_t from = text.find('['), to = text.find(']');
    return to == text.npos || from == text.npos ? text : text.erase(from, to - from + 1);
  };
  for (const json& signal : effect.at("depends_on"))
    for (const json& said : term.at("signals")) {
      const std::string a = signal.get<std::string>(), b = plain(said.get<std::string>());
      if (a.find(b) != a.npos || b.find(a) != b.npos) return true;
    }
  return false;
}

// Intervals of 95 % that the verdict gives for parameters which the truth states.
inline void Cover(const json& term, const json& effect, Share& share) {
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

// One case of set II. said: what the diagnosis printed; verdict: null where it refused the logs.
void JudgeSetTwo(const std::string& name, const json& truth, const json& verdict, const std::string& said,
                 Tally& tally);

}  // namespace armcal::judged
