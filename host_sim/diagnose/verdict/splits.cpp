// verdict - compares the terms of splits, and says which hold on every split.
#include "host_sim/diagnose/verdict/splits.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>
#include <set>

namespace armcal::verdict {

using nlohmann::ordered_json;
using Strings = std::vector<std::string>;

namespace {

constexpr double kFalls = 0.995;   // as much as a term may worsen a joint without being refuted
constexpr double kSameForm = 0.5;  // of the longer trace: two fits of one effect lie closer together
constexpr double kUncertain = 2;   // standard deviations
constexpr std::size_t kCompared =
    6;  // parameters: those of a longer list are a curve's, and hang on where its knots lie

// "6-5" and "5-6" are one pair.
std::string Canonical(const std::string& joints) {
  std::vector<std::string> part;
  for (std::size_t at = 0, end; at <= joints.size(); at = end + 1) {
    end = std::min(joints.find('-', at), joints.size());
    part.push_back(joints.substr(at, end - at));
  }
  std::sort(part.begin(), part.end(), [](const auto& a, const auto& b) {
    return std::pair(a.size(), a) < std::pair(b.size(), b);  // 9 before 10
  });
  return fmt::format("{}", fmt::join(part, "-"));
}

// Kinds that the split cannot tell from one another; empty for a curve, which names none.
Strings Kinds(const ordered_json& term) {
  if (term["kind"] == "unknown") return {};
  Strings kinds = term["also_fits"].get<Strings>();
  kinds.insert(kinds.begin(), term["kind"].get<std::string>());
  return kinds;
}

// The joint that the term helps most; none if it helps none.
std::optional<Occurrence> Helps(const std::string& held_out, const ordered_json& verdict, std::size_t place) {
  const ordered_json& term = verdict["terms"][place];
  if (!term["confirmed"].get<bool>() || !term.contains("without_moving")) return {};
  std::optional<Occurrence> best;
  // By the rows that terms are fitted to: motion above the band would hide what a term does below it.
  const std::string rows =
      verdict.contains("after_in_band") && term.contains("without_in_band") ? "_in_band" : "_moving";
  for (std::size_t j = 0; j < verdict["after_moving"].size(); ++j) {
    const double before = verdict["before" + rows][j], after = verdict["after" + rows][j],
                 without = term["without" + rows][j];
    if (after >= kFalls * before || after >= kFalls * without) continue;
    if (!best || after / without < best->after / best->without)
      best = Occurrence{held_out, place, term["kind"], static_cast<int>(j), before, after, without, -1, -1, term};
  }
  for (std::size_t j = 0; best && j < verdict["after_moving"].size(); ++j) {
    const double change = verdict["after_moving"][j].get<double>() / verdict["before_moving"][j].get<double>() - 1;
    if (static_cast<int>(j) != best->joint && change > best->change)
      best->other_joint = static_cast<int>(j), best->change = change;
  }
  return best;
}

// The kinds that both allow; nothing if they cannot be the same term.
std::optional<Strings> Common(const Agreement& a, const ordered_json& term) {
  if (a.joint != Canonical(JointText(term["joint"]))) return {};
  const Strings kinds = Kinds(term);
  Strings both;
  for (const std::string& k : a.kinds)
    if (std::find(kinds.begin(), kinds.end(), k) != kinds.end()) both.push_back(k);
  const bool curve = a.kinds.empty() || kinds.empty();
  if (both.empty() && !(curve && term["signals"].get<Strings>() == a.signals)) return {};
  return both;
}

// Whether two occurrences are the same torque on the same samples. A state of a run has no trace: its shape is that
// run's own. other: what to say of the worst pair that is not.
bool SameForm(const Occurrence& a, const Occurrence& b, const Traces& traces, Distance& worst) {
  if (a.term["class"] == "run_state" && b.term["class"] == "run_state") return true;
  const auto one = traces.find({a.held_out, a.place}), other = traces.find({b.held_out, b.place});
  const Distance apart =
      one == traces.end() || other == traces.end() ? Distance{1, 0} : Compare(one->second, other->second);
  if (apart.share > worst.share) worst = apart;
  return apart.share < kSameForm;
}

std::string OtherForm(const Distance& apart) {
  return fmt::format("{} (on the same samples {:.0f} % of the larger apart, uncertainty {:.0f} %)",
                     apart.share < kUncertain * apart.uncertainty ? "too uncertain to compare" : "of another form",
                     100 * apart.share, 100 * apart.uncertainty);
}

// Adds that term of the verdict which lies closest to those of the agreement. False: there is none. other: how far the
// closest of a fitting name lies apart.
bool Extend(Agreement& a, const std::string& held_out, const ordered_json& verdict, const Traces& traces,
            std::optional<Distance>& other) {
  std::optional<Occurrence> best;
  Strings best_kinds;
  Distance best_apart;
  for (std::size_t k = 0; k < verdict.value("terms", ordered_json::array()).size(); ++k) {
    const auto kinds = Common(a, verdict["terms"][k]);
    const auto occurrence = Helps(held_out, verdict, k);
    if (!kinds || !occurrence) continue;
    Distance worst;
    bool same = true;
    for (const Occurrence& o : a.split) same = SameForm(o, *occurrence, traces, worst) && same;
    if (!same && (!other || worst.share < other->share)) other = worst;
    if (!same || (best && worst.share >= best_apart.share)) continue;
    best = occurrence, best_kinds = *kinds, best_apart = worst;
  }
  if (!best) return false;
  a.kinds = best_kinds;
  a.apart = std::max(a.apart, best_apart.share);
  a.split.push_back(*best);
  return true;
}

// One value a group of runs that are held out together: their training runs, and so their fits, are the same.
template <class Value>
std::vector<double> OfGroups(const Agreement& a, const std::map<std::string, int>& group, const Value& value) {
  std::map<int, std::pair<double, int>> sum;
  for (std::size_t k = 0; k < a.split.size(); ++k) {
    const auto own = group.find(a.split[k].held_out);
    auto& [total, count] = sum[own == group.end() ? -1 - static_cast<int>(k) : own->second];
    total += value(a.split[k]), ++count;
  }
  std::vector<double> out;
  for (const auto& [g, s] : sum) out.push_back(s.first / s.second);
  return out;
}

// The term's parameters over the splits, where all of them have the same record with as many uses.
void AddSpreads(Agreement& a, const Comparison& comparison) {
  const ordered_json& first = a.split[0].term;
  const bool same = std::all_of(a.split.begin(), a.split.end(), [&](const Occurrence& o) {
    return o.term["record"] == first["record"] && o.term["parameters"].size() == first["parameters"].size();
  });
  const auto sd_of = [](const Occurrence& o, const std::string& name) {
    const ordered_json& sd = o.term["parameter_sd"];
    return sd.contains(name) && sd[name].is_number() ? sd[name].get<double>() : 0.0;
  };
  if (same && first["parameters"].size() <= kCompared)
    for (const auto& [key, unused] : first["parameters"].items()) {
      const std::string name = key;
      const auto value = OfGroups(a, comparison.group, [&](const Occurrence& o) {
        const ordered_json& p = o.term["parameters"];
        return p.contains(name) && p[name].is_number() ? p[name].template get<double>() : 0.0;
      });
      if (value.size() > 1)
        a.parameters.push_back({name, SpreadOf(value, OfGroups(a, comparison.group,
                                                               [&](const Occurrence& o) { return sd_of(o, name); }))});
    }
  const int joint = a.split[0].joint;
  const auto size = [&](const Occurrence& o) {
    const auto own = comparison.traces.find({o.held_out, o.place});
    return own == comparison.traces.end() ? 0 : own->second.rms_Nm[joint];
  };
  const auto size_sd = [&](const Occurrence& o) {
    const auto own = comparison.traces.find({o.held_out, o.place});
    return own == comparison.traces.end()
               ? 0
               : size(o) * own->second.uncertainty / std::max(own->second.left.norm(), 1e-300);
  };
  const std::vector<double> rms = OfGroups(a, comparison.group, size);
  if (rms.size() > 1 && *std::max_element(rms.begin(), rms.end()) > 0)
    a.size = {fmt::format("torque of joint {}", joint + 1), SpreadOf(rms, OfGroups(a, comparison.group, size_sd))};
}

}  // namespace

Agreed Agree(const Verdicts& splits, const Comparison& comparison) {
  Agreed out;
  std::set<std::pair<std::string, std::size_t>> used;  // terms of an agreement
  for (const auto& [held_out, verdict] : splits)
    for (std::size_t k = 0; k < verdict.value("terms", ordered_json::array()).size(); ++k) {
      if (used.contains({held_out, k})) continue;
      const ordered_json& term = verdict["terms"][k];
      const std::string joint = Canonical(JointText(term["joint"]));
      const auto here = Helps(held_out, verdict, k);
      if (!here) {
        const bool confirmed = term["confirmed"].get<bool>();
        out.does_not.push_back({held_out, term["kind"], joint,
                                term.value("training_only", false)
                                    ? "an event of the training log, which the held-out log cannot show"
                                : confirmed ? "does not lower the held-out error"
                                            : term.value("unconfirmed", std::string("refuted by the held-out run"))});
        continue;
      }
      Agreement a{Kinds(term), joint, term["signals"].get<Strings>(), {*here}, 0, {}, {}};
      Strings missing;
      for (const auto& [name, other] : splits) {
        std::optional<Distance> apart;
        if (name == held_out || Extend(a, name, other, comparison.traces, apart)) continue;
        missing.push_back(fmt::format("{} with {} held out",
                                      apart           ? OtherForm(*apart)
                                      : Failed(other) ? "no verdict"
                                                      : "not found",
                                      name));
      }
      if (!missing.empty()) {
        out.does_not.push_back({held_out, term["kind"], a.joint, fmt::format("{}", fmt::join(missing, "; "))});
        continue;
      }
      for (const Occurrence& o : a.split) used.insert({o.held_out, o.place});
      std::sort(a.split.begin(), a.split.end(), [](auto& x, auto& y) { return x.held_out < y.held_out; });
      AddSpreads(a, comparison);
      out.holds.push_back(a);
    }
  return out;
}

std::string Name(const Agreement& a) {
  return a.kinds.empty() ? fmt::format("unknown over {}", fmt::join(a.signals, ", "))
                         : fmt::format("{}", fmt::join(a.kinds, " or "));
}

}  // namespace armcal::verdict
