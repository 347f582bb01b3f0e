// verdict - compares the terms of splits, and shows those that every split has.
#include "host_sim/diagnose/verdict/splits.hpp"

#include <fmt/core.h>
#include <fmt/ranges.h>
#include <Eigen/QR>

#include <algorithm>
#include <optional>
#include <set>

#include "host_sim/data/files/files.hpp"
#include "host_sim/data/report/axis.hpp"
#include "host_sim/data/report/page.hpp"
#include "host_sim/data/report/style.hpp"

namespace armcal::verdict {

namespace fs = std::filesystem;
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

// The kinds that both allow; nothing if they cannot be the same term.
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

// Compares two terms over the range that both held-out runs show: as they are, or without what the declared model can
// take itself (a constant, and over speed Coulomb and viscous friction). A term that has memory or acts on the
// measurement has no form over a signal.
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

namespace {

constexpr int kWidth_px = 1000;  // six legend entries beside the title

std::string Title(const Agreement& a) { return fmt::format("{}, joint {}", Name(a), a.joint); }

int FoldsThatImprove(const ordered_json& term) {
  const auto folds = term["folds"].get<std::vector<double>>();
  return static_cast<int>(std::count_if(folds.begin(), folds.end(), [](double f) { return f > 0; }));
}

report::Table HoldsTable(const Agreement& a) {
  report::Table t{{"held out", "named", "torque of joint", "before", "after", "without it", "score", "folds",
                   "another joint at worst"},
                  {}};
  for (const Occurrence& o : a.split)
    t.rows.push_back({o.held_out, o.kind, std::to_string(o.joint + 1), report::Number(o.before, 4),
                      report::Number(o.after, 4), report::Number(o.without, 4),
                      fmt::format("{:.0f}", o.term["score"].get<double>()),
                      fmt::format("{} of {}", FoldsThatImprove(o.term), o.term["folds"].size()),
                      o.other_joint < 0 ? "-" : fmt::format("joint {}: {:+.1f} %", o.other_joint + 1, 100 * o.change)});
  return t;
}

report::Table DoesNotTable(const Agreed& agreed) {
  report::Table t{{"held out", "term", "joint", "why not"}, {}};
  for (const Disagreement& d : agreed.does_not) t.rows.push_back({d.held_out, d.kind, d.joint, d.why});
  return t;
}

// One row a run and joint that moves.
report::Table ErrorTable(const Verdicts& splits) {
  report::Table t{{"held out", "joint", "before", "after", "before / torque %", "after / torque %"}, {}};
  for (const auto& [name, v] : splits) {
    if (v["verdict"] == "failed") {
      t.rows.push_back({name + ": " + v["error"].get<std::string>(), "-", "-", "-", "-", "-"});
      continue;
    }
    for (std::size_t j = 0; j < v["before_moving"].size(); ++j) {
      const double before = v["before_moving"][j], after = v["after_moving"][j], torque = v["torque_moving"][j];
      t.rows.push_back({name, std::to_string(j + 1), report::Number(before, 4), report::Number(after, 4),
                        fmt::format("{:.1f}", 100 * before / torque), fmt::format("{:.1f}", 100 * after / torque)});
    }
  }
  return t;
}

// How much of the runs' names is the same in all: a legend is short.
std::size_t CommonPrefix(const Verdicts& splits) {
  const std::string &first = splits.begin()->first, &last = splits.rbegin()->first;  // in alphabetical order
  const auto same = std::mismatch(first.begin(), first.end(), last.begin(), last.end()).first;
  return same == first.end() ? 0 : static_cast<std::size_t>(same - first.begin());
}

report::Bars ErrorBars(const Verdicts& splits) {
  report::Bars bars{{"error, held out", "", "RMS error / RMS torque, %", kWidth_px}, {}, {}, {}};
  for (const auto& [name, v] : splits) {
    if (v["verdict"] == "failed") continue;
    for (const char* when : {"before", "after"}) {
      bars.series.push_back(fmt::format("{}: {}", name.substr(CommonPrefix(splits)), when));
      bars.value.emplace_back();
      const ordered_json &error = v[std::string(when) + "_moving"], &torque = v["torque_moving"];
      for (std::size_t j = 0; j < error.size(); ++j)
        bars.value.back().push_back(100 * error[j].get<double>() / torque[j].get<double>());
    }
    bars.categories.clear();
    for (std::size_t j = 0; j < v["torque_moving"].size(); ++j)
      bars.categories.push_back("joint " + std::to_string(j + 1));
  }
  return bars;
}

report::Plot TermPlot(const Verdicts& splits, const Agreement& a) {
  const ordered_json& first = a.split[0].term["dependence"];
  report::Plot plot{{Title(a), first["over"], first["torque"], kWidth_px}, {}};
  for (const Occurrence& o : a.split) {
    const ordered_json& d = o.term["dependence"];
    const std::string run = o.held_out.substr(CommonPrefix(splits));
    plot.series.push_back({run + ": residual", d["x"], d["without"], report::Style::kPoints});
    plot.series.push_back({run + ": term", d["x"], d["term"], report::Style::kLine});
  }
  return plot;
}

const char* const kTermCaption =
    "Means over bins of the held-out run: what the rest of the model leaves, and the term as the other runs gave it.";

std::string Headline(const Agreed& agreed) {
  if (agreed.holds.empty()) return "no term holds on every split";
  return fmt::format("{} on every split", agreed.holds.size() == 1 ? "one term holds" : "terms that hold");
}

}  // namespace

std::string SplitsText(const Verdicts& splits, const Agreed& agreed) {
  std::string text = report::Text(ErrorTable(splits)) + "\n" + Headline(agreed) + "\n";
  for (const Agreement& a : agreed.holds) text += "\n" + Title(a) + "\n" + report::Text(HoldsTable(a));
  if (!agreed.does_not.empty()) text += "\nnot claimed\n" + report::Text(DoesNotTable(agreed));
  return text;
}

ordered_json SplitsJson(const Verdicts& splits, const Agreed& agreed) {
  ordered_json json{{"verdict", agreed.holds.empty() ? "none" : "effect"}};
  json["holds"] = json["does_not_hold"] = ordered_json::array();
  for (const Agreement& a : agreed.holds) {
    ordered_json of_run;
    for (const Occurrence& o : a.split)
      of_run[o.held_out] = {{"kind", o.kind},           {"torque_of", o.joint + 1},
                            {"before", o.before},       {"after", o.after},
                            {"without", o.without},     {"other_joint", o.other_joint + 1},
                            {"other_change", o.change}, {"parameters", o.term["parameters"]},
                            {"score", o.term["score"]}, {"folds", o.term["folds"]}};
    json["holds"].push_back({{"kinds", a.kinds}, {"joint", a.joint}, {"signals", a.signals}, {"splits", of_run}});
  }
  for (const Disagreement& d : agreed.does_not)
    json["does_not_hold"].push_back({{"held_out", d.held_out}, {"kind", d.kind}, {"joint", d.joint}, {"why", d.why}});
  for (const auto& [name, v] : splits)
    for (const char* key : {"before_moving", "after_moving", "torque_moving", "error"})
      if (v.contains(key)) json["splits"][name][key] = v[key];
  return json;
}

void WritePictures(const fs::path& folder, const Verdicts& splits, const Agreed& agreed) {
  files::WriteWholeFile(folder / "errors.svg", report::SvgFile(report::Svg(ErrorBars(splits))));
  for (std::size_t k = 0; k < agreed.holds.size(); ++k)
    files::WriteWholeFile(folder / fmt::format("term_{}.svg", k + 1),
                          report::SvgFile(report::Svg(TermPlot(splits, agreed.holds[k]))));
}

void WriteSplitsPage(const fs::path& path, const std::string& robot, const Verdicts& splits, const Agreed& agreed) {
  report::Page page("What holds whatever run is held out: " + robot,
                    "Each run held out once; terms found on the others, the model fitted to them.");
  page.Box(agreed.holds.empty() ? report::Tone::kNeutral : report::Tone::kWarning, Headline(agreed));
  for (const Agreement& a : agreed.holds) {
    page.Section(Title(a));
    page.Add(HoldsTable(a));
    page.Add(TermPlot(splits, a), kTermCaption);
  }
  if (!agreed.does_not.empty()) {
    page.Section("Not claimed");
    page.Add(DoesNotTable(agreed));
  }
  page.Section("Error");
  page.Add(ErrorBars(splits),
           "Before: the declared model; after: with the terms that this split's training runs gave.");
  page.Fold("in figures", ErrorTable(splits));
  page.Write(path);
}

}  // namespace armcal::verdict
