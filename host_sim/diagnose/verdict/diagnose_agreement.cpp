// verdict - compares the terms of splits.
#include "host_sim/diagnose/verdict/diagnose_agreement.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>
#include <Eigen/QR>
#include <algorithm>
#include <optional>
#include <set>

namespace armcal::verdict {

using nlohmann::ordered_json;
using Strings = std::vector<std::string>;

namespace {

constexpr double kFalls = 0.995;   // as much as a term may worsen a joint without being refuted
constexpr double kSameForm = 0.5;  // of the larger one's spread: two fits of one effect differ by less

// Kinds that the split cannot tell from one another; empty for a curve, which names none.
Strings Kinds(const ordered_json& term) {
  if (term["kind"] == "unknown") return {};
  Strings kinds = term["also_fits"].get<Strings>();
  kinds.insert(kinds.begin(), term["kind"].get<std::string>());
  return kinds;
}

// The joint that the term helps most; none if it helps none.
std::optional<Occurrence> Helps(const std::string& held_out, const ordered_json& verdict, const ordered_json& term) {
  if (!term["confirmed"].get<bool>() || !term.contains("without_moving")) return {};
  std::optional<Occurrence> best;
  for (std::size_t j = 0; j < verdict["after_moving"].size(); ++j) {
    const double before = verdict["before_moving"][j], after = verdict["after_moving"][j],
                 without = term["without_moving"][j];
    if (after >= kFalls * before || after >= kFalls * without) continue;
    if (!best || after / without < best->after / best->without)
      best = Occurrence{held_out, term["kind"], static_cast<int>(j), before, after, without, -1, -1, term};
  }
  for (std::size_t j = 0; best && j < verdict["after_moving"].size(); ++j) {
    const double change = verdict["after_moving"][j].get<double>() / verdict["before_moving"][j].get<double>() - 1;
    if (static_cast<int>(j) != best->joint && change > best->change)
      best->other_joint = static_cast<int>(j), best->change = change;
  }
  return best;
}

// What both allow; none if they cannot be the same.
std::optional<Strings> Common(const Agreement& a, const ordered_json& term) {
  if (a.joint != JointText(term["joint"])) return {};
  const Strings kinds = Kinds(term);
  Strings both;
  for (const std::string& k : a.kinds)
    if (std::find(kinds.begin(), kinds.end(), k) != kinds.end()) both.push_back(k);
  const bool curve = a.kinds.empty() || kinds.empty();
  if (both.empty() && !(curve && term["signals"].get<Strings>() == a.signals)) return {};
  return both;
}

// The curve at x, linear between its points; nothing outside of them.
std::optional<double> At(const std::vector<double>& xs, const std::vector<double>& ys, double x) {
  const auto right = std::lower_bound(xs.begin(), xs.end(), x);
  if (right == xs.end() || (right == xs.begin() && x < xs[0])) return {};
  const std::size_t k = static_cast<std::size_t>(right - xs.begin());
  if (k == 0) return ys[0];
  return ys[k - 1] + (ys[k] - ys[k - 1]) * (x - xs[k - 1]) / (xs[k] - xs[k - 1]);
}

// Over the range that both held-out runs show: as it is, or but for what the declared model takes itself (a constant,
// and over speed Coulomb and viscous friction). What has memory, or acts on the measurement, has no form over a signal.
bool SameForm(const ordered_json& one, const ordered_json& other) {
  if (one["class"] != "static" || other["class"] != "static") return true;
  const ordered_json &a = one["dependence"], &b = other["dependence"];
  if (a["over"] != b["over"]) return false;
  const std::vector<double> xa = a["x"], ya = a["term"], xb = b["x"], yb = b["term"];
  std::vector<double> x, first, second;
  for (std::size_t k = 0; k < xa.size(); ++k)
    if (const auto y = At(xb, yb, xa[k])) x.push_back(xa[k]), first.push_back(ya[k]), second.push_back(*y);
  if (x.size() < 4) return false;
  const auto map = [](const std::vector<double>& v) {
    return Eigen::Map<const Eigen::VectorXd>(v.data(), static_cast<Eigen::Index>(v.size()));
  };
  const bool over_speed = !one["signals"].empty() && one["signals"][0].get<std::string>().starts_with("qd");
  Eigen::MatrixXd own = Eigen::MatrixXd::Ones(map(x).size(), over_speed ? 3 : 1);
  if (over_speed) own.rightCols(2) << map(x), map(x).cwiseSign();
  const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver(own);
  const auto left = [&](const Eigen::VectorXd& v) { return (v - own * solver.solve(v)).norm(); };
  const Eigen::VectorXd y1 = map(first), y2 = map(second);
  return (y1 - y2).norm() < kSameForm * std::max(y1.norm(), y2.norm()) ||
         left(y1 - y2) < kSameForm * std::max(left(y1), left(y2));
}

// Adds that term of the verdict which has most in common with the agreement. False: there is none. other_form: one of a
// fitting name has another form.
bool Extend(Agreement& a, const std::string& held_out, const ordered_json& verdict, bool& other_form) {
  std::optional<Occurrence> best;
  Strings best_kinds;
  for (const ordered_json& term : verdict.value("terms", ordered_json::array())) {
    const auto kinds = Common(a, term);
    const auto occurrence = Helps(held_out, verdict, term);
    if (!kinds || !occurrence || (best && kinds->size() <= best_kinds.size())) continue;
    if (!std::all_of(a.split.begin(), a.split.end(), [&](const Occurrence& o) { return SameForm(o.term, term); })) {
      other_form = true;
      continue;
    }
    best = occurrence, best_kinds = *kinds;
  }
  if (!best) return false;
  a.kinds = best_kinds;
  a.split.push_back(*best);
  return true;
}

}  // namespace

Agreed Agree(const Verdicts& splits) {
  Agreed out;
  std::set<std::string> used;  // terms of an agreement
  const auto key = [](const std::string& held_out, const ordered_json& term) {
    return held_out + term["record"].get<std::string>() + JointText(term["joint"]) + term["signals"].dump();
  };
  for (const auto& [held_out, verdict] : splits)
    for (const ordered_json& term : verdict.value("terms", ordered_json::array())) {
      if (used.contains(key(held_out, term))) continue;
      const auto here = Helps(held_out, verdict, term);
      if (!here) {
        const bool refuted = !term["confirmed"].get<bool>();
        out.does_not.push_back({held_out, term["kind"], JointText(term["joint"]),
                                refuted ? "refuted by the held-out run" : "does not lower the held-out error"});
        continue;
      }
      Agreement a{Kinds(term), JointText(term["joint"]), term["signals"].get<Strings>(), {*here}};
      Strings missing;
      bool other_form = false;
      for (const auto& [name, other] : splits)
        if (name != held_out && !Extend(a, name, other, other_form)) missing.push_back(name);
      if (!missing.empty()) {
        out.does_not.push_back({held_out, term["kind"], a.joint,
                                fmt::format("{} with {} held out", other_form ? "of another form" : "not found",
                                            fmt::join(missing, ", "))});
        continue;
      }
      for (const Occurrence& o : a.split) used.insert(key(o.held_out, o.term));
      std::sort(a.split.begin(), a.split.end(), [](auto& x, auto& y) { return x.held_out < y.held_out; });
      out.holds.push_back(a);
    }
  return out;
}

std::string Name(const Agreement& a) {
  return a.kinds.empty() ? fmt::format("unknown over {}", fmt::join(a.signals, ", "))
                         : fmt::format("{}", fmt::join(a.kinds, " or "));
}

}  // namespace armcal::verdict
