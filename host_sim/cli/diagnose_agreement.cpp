// cli - compares the terms of splits.
#include "host_sim/cli/diagnose_agreement.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>
#include <algorithm>
#include <optional>
#include <set>

namespace armcal::cli {

using nlohmann::ordered_json;
using Strings = std::vector<std::string>;

namespace {

constexpr double kFalls = 0.995;  // as much as a term may worsen a joint without being refuted

std::string JointText(const ordered_json& term) {
  const ordered_json& joint = term["joint"];
  return joint.is_string() ? joint.get<std::string>() : joint.dump();
}

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
      best = Occurrence{held_out, term["kind"], static_cast<int>(j), before, after, without, term};
  }
  return best;
}

// What both allow; none if they cannot be the same.
std::optional<Strings> Common(const Agreement& a, const ordered_json& term) {
  if (a.joint != JointText(term)) return {};
  const Strings kinds = Kinds(term);
  Strings both;
  for (const std::string& k : a.kinds)
    if (std::find(kinds.begin(), kinds.end(), k) != kinds.end()) both.push_back(k);
  const bool curve = a.kinds.empty() || kinds.empty();
  if (both.empty() && !(curve && term["signals"].get<Strings>() == a.signals)) return {};
  return both;
}

// Adds that of the terms which has most in common with the agreement. False: there is none.
bool Extend(Agreement& a, const std::string& held_out, const ordered_json& verdict, const ordered_json& terms) {
  std::optional<Occurrence> best;
  Strings best_kinds;
  for (const ordered_json& term : terms) {
    const auto kinds = Common(a, term);
    const auto occurrence = Helps(held_out, verdict, term);
    if (!kinds || !occurrence || (best && kinds->size() <= best_kinds.size())) continue;
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
  std::set<std::pair<std::string, std::string>> used;  // held-out run and record of a term in an agreement
  const auto key = [](const std::string& held_out, const ordered_json& term) {
    return std::pair{held_out, term["record"].get<std::string>() + JointText(term) + term["signals"].dump()};
  };
  for (const auto& [first, verdict] : splits)
    for (const ordered_json& term : verdict.value("terms", ordered_json::array())) {
      if (used.contains(key(first, term))) continue;
      Agreement a{Kinds(term), JointText(term), term["signals"].get<Strings>(), {}};
      Strings missing;
      for (const auto& [name, other] : splits) {
        const ordered_json terms =
            name == first ? ordered_json::array({term}) : other.value("terms", ordered_json::array());
        if (!Extend(a, name, other, terms)) missing.push_back(name);
      }
      if (missing.empty()) {
        for (const Occurrence& o : a.split) used.insert(key(o.held_out, o.term));
        out.holds.push_back(a);
        continue;
      }
      const bool here = Helps(first, verdict, term).has_value();
      out.does_not.push_back({first, term["kind"], a.joint,
                              !term["confirmed"].get<bool>() ? "refuted by the held-out run"
                              : !here                        ? "does not lower the held-out error"
                                      : fmt::format("not with {} held out", fmt::join(missing, ", "))});
    }
  return out;
}

std::string Name(const Agreement& a) {
  return a.kinds.empty() ? fmt::format("unknown over {}", fmt::join(a.signals, ", "))
                         : fmt::format("{}", fmt::join(a.kinds, " or "));
}

}  // namespace armcal::cli
