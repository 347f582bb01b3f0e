// verdict - shows what the terms of splits have in common: text, JSON, pictures, page.
#include <fmt/core.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "host_sim/data/files/files.hpp"
#include "host_sim/data/report/axis.hpp"
#include "host_sim/data/report/page.hpp"
#include "host_sim/data/report/style.hpp"
#include "host_sim/diagnose/verdict/splits.hpp"

namespace armcal::verdict {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

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

const char* const kSpreadCaption =
    "sd and interval hold the spread between runs. Splits share training runs, so they are a jackknife's over the "
    "groups of runs that are held out together.";

report::Table SpreadTable(const Agreement& a) {
  report::Table t{{"parameter", "mean", "sd", "between runs", "95 % from", "to"}, {}};
  const auto add = [&](const std::string& name, const Spread& s) {
    t.rows.push_back({name, fmt::format("{:.4g}", s.mean), fmt::format("{:.2g}", s.sd),
                      fmt::format("{:.2g}", s.between), fmt::format("{:.4g}", s.lower),
                      fmt::format("{:.4g}", s.upper)});
  };
  for (const auto& [name, spread] : a.parameters) add(name, spread);
  if (!a.size.first.empty()) add(a.size.first + ", RMS beside the declared model", a.size.second);
  return t;
}

ordered_json SpreadJson(const Spread& s) {
  return {{"mean", s.mean}, {"sd", s.sd}, {"between_runs_sd", s.between}, {"interval_95", {s.lower, s.upper}}};
}

report::Table DoesNotTable(const Agreed& agreed) {
  report::Table t{{"held out", "term", "joint", "why not"}, {}};
  for (const Disagreement& d : agreed.does_not) t.rows.push_back({d.held_out, d.kind, d.joint, d.why});
  return t;
}

// One row a run and joint that moves.
report::Table ErrorTable(const Verdicts& splits) {
  report::Table t{{"held out", "joint", "unit", "before", "after", "before / torque %", "after / torque %"}, {}};
  for (const auto& [name, v] : splits) {
    if (Failed(v)) {
      t.rows.push_back({name + ": " + v["error"].get<std::string>(), "-", "-", "-", "-", "-", "-"});
      continue;
    }
    for (std::size_t j = 0; j < v["before_moving"].size(); ++j) {
      const double before = v["before_moving"][j], after = v["after_moving"][j], torque = v["torque_moving"][j];
      t.rows.push_back({name, std::to_string(j + 1), v["torque_units"][j], report::Number(before, 4),
                        report::Number(after, 4), fmt::format("{:.1f}", 100 * before / torque),
                        fmt::format("{:.1f}", 100 * after / torque)});
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
    if (Failed(v)) continue;
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

std::string Headline(const Verdicts& splits, const Agreed& agreed) {
  const auto failed = std::count_if(splits.begin(), splits.end(), [](const auto& v) { return Failed(v.second); });
  if (failed > 0) return fmt::format("no term can be claimed: {} of {} splits have no verdict", failed, splits.size());
  if (agreed.holds.empty()) return "no term holds on every split";
  return fmt::format("{} on every split", agreed.holds.size() == 1 ? "one term holds" : "terms that hold");
}

}  // namespace

std::string SplitsText(const Verdicts& splits, const Agreed& agreed) {
  std::string text = report::Text(ErrorTable(splits)) + "\n" + Headline(splits, agreed) + "\n";
  for (const Agreement& a : agreed.holds)
    text += "\n" + Title(a) + "\n" + report::Text(HoldsTable(a)) + "\n" + report::Text(SpreadTable(a));
  if (!agreed.holds.empty()) text += std::string("\n") + kSpreadCaption + "\n";
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
    json["holds"].back()["apart"] = a.apart;
    for (const auto& [name, spread] : a.parameters) json["holds"].back()["parameters"][name] = SpreadJson(spread);
    if (!a.size.first.empty()) json["holds"].back()["rms_Nm"] = SpreadJson(a.size.second);
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
  page.Box(agreed.holds.empty() ? report::Tone::kNeutral : report::Tone::kWarning, Headline(splits, agreed));
  for (const Agreement& a : agreed.holds) {
    page.Section(Title(a));
    page.Add(HoldsTable(a));
    report::Table spread = SpreadTable(a);
    spread.caption = kSpreadCaption;
    page.Add(spread);
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
