// verdict - writes the page of one diagnosis.
#include "host_sim/diagnose/verdict/diagnosis_page.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "host_sim/data/report/axis.hpp"
#include "host_sim/diagnose/verdict/curve_charts.hpp"
#include "host_sim/diagnose/verdict/json_values.hpp"

namespace armcal::verdict {

using nlohmann::ordered_json;

namespace {

constexpr int kAfterColour = 0, kBeforeColour = 1, kRemainsColour = 6;
constexpr std::size_t kMostJointsFirst = 3;  // panels that a reader sees before any click

std::vector<std::string> Lines(const ordered_json& array) { return array.get<std::vector<std::string>>(); }

const std::string& Words(const ordered_json& term, const char* key) {
  return term.at("words").at(key).get_ref<const std::string&>();
}

bool Holds(const ordered_json& json, const char* key, bool value) { return json.contains(key) && json[key] == value; }

bool InModel(const ordered_json& term) { return Holds(term, "in_model", true); }

// 100 times error over torque of each joint where it moves; NaN where it never moves.
std::vector<double> Relative(const ordered_json& json, const char* error) {
  std::vector<double> out = Numbers(json.at(error));
  const std::vector<double> torque = Numbers(json.at("torque_moving"));
  for (std::size_t j = 0; j < out.size(); ++j) out[j] = torque.at(j) > 0 ? 100 * out[j] / torque[j] : std::nan("");
  return out;
}

// The joints that a reader sees first: those whose torque gave a cause away; else the one with the largest share left.
std::vector<int> JointsToShow(const ordered_json& json) {
  std::set<int> joints;
  for (const ordered_json& term : json.at("terms"))
    if (term.contains("dependence") && joints.size() < kMostJointsFirst)
      joints.insert(term["dependence"].at("of_joint").get<int>());
  if (joints.empty()) {
    const std::vector<double> left = Relative(json, "after_moving");
    std::size_t worst = 0;
    for (std::size_t j = 0; j < left.size(); ++j)
      if (left[j] > left[worst] || std::isnan(left[worst])) worst = j;
    joints.insert(static_cast<int>(worst) + 1);
  }
  return {joints.begin(), joints.end()};
}

// A page made again from a file of an older armcal has no such key.
bool Differs(const ordered_json& json) { return !json.value("held_out_differs_text", ordered_json::array()).empty(); }

void AddVerdict(report::Page& page, const ordered_json& json) {
  const std::string& headline = json.at("headline").get_ref<const std::string&>();
  std::vector<std::string> causes;
  for (const ordered_json& term : json.at("terms"))
    causes.push_back(Words(term, "cause") + Words(term, "remark") + ". " + Words(term, "title") + ".");
  // What is in the training log only says nothing about the arm.
  const auto sure = std::count_if(json.at("terms").begin(), json["terms"].end(), [](const ordered_json& term) {
    return Holds(term, "confirmed", true) && !Holds(term, "training_only", true);
  });
  if (sure > 0) {
    page.Box(report::Tone::kWarning, fmt::format("The model lacks {} effect{}", sure, sure == 1 ? "" : "s"), causes);
  } else if (causes.empty() && json.at("too_short").empty() && !Differs(json)) {
    std::string words =
        "No effect of the catalogue improves the declared model by more than chance would. What these logs would "
        "have shown is in the table of errors: smallest detectable effect.";
    // A page made again from a file of an older armcal has no such key.
    const ordered_json rested = json.value("at_rest", ordered_json::array());
    if (!rested.empty())
      words += fmt::format(" Not judged, because they were at rest in the training logs: joints {}.",
                           fmt::join(rested.get<std::vector<int>>(), ", "));
    const bool biased = Holds(json.at("exogeneity"), "passed", false);
    if (biased) words += " On some joints least squares is biased, so an effect may be hidden: see Exogeneity.";
    page.Box(rested.empty() && !biased ? report::Tone::kGood : report::Tone::kNeutral,
             "No missing effect was found in these logs", words);
  } else {
    page.Box(report::Tone::kNeutral, "Verdict: " + headline, causes);
  }
  if (Differs(json))
    page.Box(report::Tone::kWarning, "The held-out log differs from the training logs",
             Lines(json["held_out_differs_text"]));
  if (json.at("payload").is_object())
    page.Box(report::Tone::kNeutral, "A payload of the held-out log", Lines(json["payload"].at("sentences")));
}

void AddNextSteps(report::Page& page, const ordered_json& json) {
  page.Section("What to do next");
  std::vector<std::string> steps, commands, left_out;
  const bool new_model = json.contains("model") && std::any_of(json.at("terms").begin(), json["terms"].end(), InModel);
  if (new_model)
    steps.push_back(fmt::format("The new model is {}. {}", json["model"].at("file").get<std::string>(),
                                Holds(json["model"], "by_table", true)
                                    ? "A table switches its terms on: identify the new model, and flash its table."
                                    : "Fit it: armcal identify --robot takes the file, and --table-out writes the "
                                      "table. For a drive, build its firmware from the file (armcal generate, or "
                                      "armcal_add_model in CMake); then flash the table."));
  for (const ordered_json& term : json.at("terms")) {
    if (!Holds(term, "confirmed", true)) left_out.push_back(Words(term, "name"));
    else if (!(new_model && InModel(term))) steps.push_back(Words(term, "name") + ": " + Words(term, "to_do") + ".");
    if (term.contains("refuted")) continue;  // nothing more is to be known of it
    for (const ordered_json& apart : term.at("separate")) {
      steps.push_back(fmt::format("To tell {} from {}: {}.", Words(term, "name"), apart.at("from").get<std::string>(),
                                  apart.at("how").get<std::string>()));
      if (apart.at("command") != "") commands.push_back(apart["command"]);
    }
  }
  if (!left_out.empty())
    steps.push_back(fmt::format("Leave out what is not confirmed: {}.", fmt::join(left_out, "; ")));
  if (!json.at("too_short").empty())
    steps.push_back(fmt::format("Record longer training logs: too few rows are left to search effects on joint {}.",
                                fmt::join(json["too_short"].get<std::vector<int>>(), ", ")));
  else if (json.at("terms").empty())
    steps.push_back("Keep the declared model. armcal identify --table-out makes the table that a drive takes.");
  if (!json.at("held_out_text").empty())
    steps.push_back("Record another held-out log: what this one cannot tell is listed below.");
  if (Holds(json.at("exogeneity"), "passed", false))
    steps.push_back("Read what the section Exogeneity says: on some joints least squares is biased.");
  page.List(steps);
  for (const std::string& command : commands) page.Code(command);
}

report::Bars BarsOfErrors(const ordered_json& json) {
  report::Bars bars{{"error over torque, held-out log", "joint", "%", 460, 300}, {}, {"before", "after"}, {}, {}};
  bars.value = {Relative(json, "before_moving"), Relative(json, "after_moving")};
  bars.colours = {kBeforeColour, kAfterColour};
  if (json.at("terms").empty())
    bars.series = {""}, bars.value.resize(1), bars.colours = {kAfterColour};  // both are one
  bars.categories = BarNames(json);
  return bars;
}

void AddErrorTable(report::Page& page, const ordered_json& json) {
  page.Section("Error on the held-out log");
  report::Table table{
      {"joint", "unit"},
      {},
      "RMS of measured minus predicted torque. Before: the declared model fitted on the training logs; "
      "after: the same with the terms. Smallest effect seen: RMS of an effect that these logs would just "
      "have shown."};
  std::vector<std::vector<double>> columns;
  for (const auto& [key, title] : {std::pair{"before", "before"},
                                   {"after", "after"},
                                   {"before_moving", "before, moving"},
                                   {"after_moving", "after, moving"},
                                   {"noise_floor", "noise floor (estimate)"},
                                   {"smallest_detectable", "smallest detectable effect"}})
    table.header.emplace_back(title), columns.push_back(Numbers(json.at(key)));
  for (std::size_t j = 0; j < columns[0].size(); ++j) {
    std::vector<std::string> row{JointTitle(json, static_cast<int>(j) + 1).substr(6), json.at("torque_units").at(j)};
    for (const auto& column : columns) row.push_back(report::Number(column.at(j)));
    table.rows.push_back(row);
  }
  page.Add(table);
  if (json.contains("tracking")) page.Text(json["tracking"].get<std::string>() + ".");
}

void AddTerm(report::Page& page, const ordered_json& json, const ordered_json& term) {
  page.Subsection(Words(term, "name") + Words(term, "remark"));
  page.Text(Words(term, "what_it_is"));
  if (Holds(term, "training_only", true))
    page.Text("Explained in the training log, no property of the arm: it is left out of the comparison above.");
  if (term.contains("dependence")) {
    const ordered_json& d = term["dependence"];
    const std::vector<double> x = Numbers(d.at("x"));
    const int joint = d.at("of_joint");
    report::Panel panel{fmt::format("joint {}", joint)};
    panel.plot.text = {JointTitle(json, joint), d.at("over"), d.at("torque"), 620, 280};
    panel.plot.series = {{"without the term", x, Numbers(d.at("without")), report::Style::kDashes, kBeforeColour},
                         {"the term", x, Numbers(d.at("term")), report::Style::kLine, kAfterColour},
                         {"what remains", x, Numbers(d.at("remains")), report::Style::kLine, kRemainsColour}};
    page.Add(report::Live{{panel}},
             "What gave it away: measured minus predicted torque over this signal, mean over bins. Held-out log, where "
             "the joint moves.");
  }
  page.Facts({{"in the new model", Words(term, "new_model")},
              {"score", Words(term, "score")},
              {"folds", Words(term, "folds")},
              {"runner-up", Words(term, "runner_up")},
              {"fits equally", Words(term, "fits_equally")}});
}

void AddParameters(report::Page& page, const ordered_json& json) {
  page.Section("Parameters");
  report::Table found{{"cause", "parameter", "unit", "value", "95 % interval", ""}, {}};
  for (const ordered_json& term : json.at("terms")) {
    if (Holds(term, "in_fit", false)) continue;
    std::string name = Words(term, "name");
    for (const auto& [parameter, value] : term.at("parameters").items()) {
      const double sd = term.at("parameter_sd").contains(parameter) ? NumberOf(term["parameter_sd"][parameter]) : 0;
      found.rows.push_back({name, parameter, UnitOn(json, term.at("joints"), term.at("parameter_unit").at(parameter)),
                            report::Number(NumberOf(value), 4), Interval95(NumberOf(value), sd),
                            term.at("marks").value(parameter, "")});
      name.clear();
    }
  }
  if (!found.rows.empty()) {
    page.Add(found);
    if (std::any_of(found.rows.begin(), found.rows.end(), [](const auto& row) { return !row[5].empty(); }))
      page.Text("A parameter with a remark should not be used alone.");
  }
  report::Table declared{{"parameter", "unit", "value", "95 % interval"}, {}};
  for (const ordered_json& row : json.at("declared_parameters")) {
    const double value = NumberOf(row.at("value"));
    declared.rows.push_back({row.at("name"), ColumnUnit(json, row.at("name"), row.at("unit")), report::Number(value, 4),
                             Interval95(value, NumberOf(row.at("sd")))});
  }
  page.Fold(fmt::format("{} parameters of the declared model, fitted to the training logs", declared.rows.size()),
            declared);
}

}  // namespace

void AddDiagnosis(report::Page& page, const ordered_json& json) {
  const bool terms = !json.at("terms").empty();
  page.Columns(
      [&](report::Page& left) {
        AddVerdict(left, json);
        AddNextSteps(left, json);
      },
      [&](report::Page& right) {
        right.Add(BarsOfErrors(json),
                  std::string("RMS of measured minus predicted torque over RMS of the torque, where the joint moves.") +
                      (terms ? " Before: the declared model; after: with the terms." : ""));
      });

  std::vector<ShownPrediction> predicted;
  if (terms) predicted.push_back({"before", "predicted before", "left before", report::Style::kDashes, kBeforeColour});
  predicted.push_back({"after", terms ? "predicted after" : "predicted", terms ? "left after" : "left",
                       report::Style::kLine, kAfterColour});
  const std::vector<int> joints = JointsToShow(json);
  page.Section("Measured against predicted torque");
  page.Add(
      TorqueCharts(json, predicted, joints),
      "Held-out log. Predictions have gaps where a joint rests or turns: there friction holds any torque up to its "
      "breakaway level.");
  if (terms) {
    page.Section(json["terms"].size() == 1 ? "The cause" : "The causes");
    for (const ordered_json& term : json["terms"]) AddTerm(page, json, term);
  }
  page.Section("Spectrum of what is left");
  page.Add(SpectrumCharts(json, predicted, joints),
           "Held-out log; samples without a prediction count as zero. In the grey part no effect was looked for: there "
           "the derived speeds and accelerations are filtered or mostly noise.");
  AddErrorTable(page, json);
  AddParameters(page, json);
  if (!json.at("held_out_text").empty()) {
    page.Section("What the held-out log cannot tell");
    page.List(Lines(json["held_out_text"]));
  }
  if (!json.at("not_looked_at").empty()) {
    page.Section("Not looked at");
    page.List(Lines(json["not_looked_at"]));
  }
  page.Section("Exogeneity");
  page.Text("A Durbin-Wu-Hausman test on the training logs, with the terms in the model.");
  page.Code(json.at("exogeneity_text").get<std::string>());
}

void WriteDiagnosisPage(const std::filesystem::path& path, const ordered_json& json) {
  report::Page page("What the model of " + json.at("robot").get<std::string>() + " lacks",
                    "Declared model fitted to the training logs, terms chosen there, error on a held-out log.");
  AddDiagnosis(page, json);
  page.Section("Provenance");
  page.Facts({{"robot", json.at("robot_title")},
              {"training", json.at("provenance")},
              {"held out", json.at("test")},
              {"search", fmt::format("{:.1f} s", json.at("seconds").get<double>())}});
  page.Write(path);
}

}  // namespace armcal::verdict
