// verdict - writes the page of an identified model.
#include "host_sim/diagnose/verdict/identification_page.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "host_sim/data/report/axis.hpp"
#include "host_sim/data/report/page.hpp"
#include "host_sim/diagnose/verdict/curve_charts.hpp"
#include "host_sim/diagnose/verdict/json_values.hpp"

namespace armcal::verdict {

using nlohmann::ordered_json;

namespace {

constexpr int kPredictedColour = 0;

bool IsHeldOut(const ordered_json& json) { return json.contains("test"); }

const ordered_json& ErrorOf(const ordered_json& json) { return json.at(IsHeldOut(json) ? "held_out" : "on_training"); }

// NaN: the joint rests.
std::vector<double> Percent(const ordered_json& json) {
  std::vector<double> out = Numbers(ErrorOf(json).at("relative_moving"));
  for (double& v : out) v *= 100;
  return out;
}

void AddFit(report::Page& page, const ordered_json& json) {
  std::vector<double> percent;
  std::string rest;  // a joint that does not move has no error there
  int joint = 0;
  for (const double v : Percent(json)) {
    ++joint;
    if (!(v > 0)) rest += fmt::format("{}{}", rest.empty() ? "" : ", ", joint);
    else percent.push_back(v);
  }
  if (percent.empty()) percent = {0};
  const auto [least, most] = std::minmax_element(percent.begin(), percent.end());
  const bool physical = !json.contains("physical") || json["physical"] == true;
  const bool sound = physical && IsHeldOut(json) && json.at("exogeneity").at("passed") == true;
  page.Box(sound ? report::Tone::kGood : report::Tone::kNeutral,
           fmt::format("The model leaves {} to {} % of a joint's torque {}", report::Number(*least, 2),
                       report::Number(*most, 2), IsHeldOut(json) ? "on the held-out log" : "on a training log"),
           fmt::format("RMS of measured minus predicted torque over RMS of the torque, where the joint moves.{}{}",
                       rest.empty() ? "" : " Not judged, because they do not move: joints " + rest + ".",
                       physical ? "" : " Some of the bodies cannot exist."));
  page.Section("What to do next");
  std::vector<std::string> steps;
  if (!IsHeldOut(json))
    steps.push_back("Hold a log of another motion out (--test): its error says how well the model predicts.");
  if (json.contains("table_file"))
    steps.push_back(fmt::format("Flash the table: armcal flash --table {}.", json["table_file"].get<std::string>()));
  steps.push_back("Ask what the model lacks: armcal diagnose with the same logs.");
  if (json.at("exogeneity").at("passed") == false)
    steps.push_back("Read what the section Exogeneity says: on some joints least squares is biased.");
  page.List(steps);
}

void AddErrors(report::Page& page, const ordered_json& json) {
  page.Section("Error of each joint");
  const ordered_json& error = ErrorOf(json);
  report::Table table{{"joint", "unit", "RMS", "RMS, moving", "over torque %", "NRMSE", "R2"},
                      {},
                      "Measured minus predicted torque. NRMSE: RMS over the torque's standard deviation, all samples."};
  const std::vector<double> percent = Percent(json);
  for (std::size_t j = 0; j < percent.size(); ++j) {
    std::vector<std::string> row{JointTitle(json, static_cast<int>(j) + 1).substr(6), json.at("torque_units").at(j)};
    for (const double v : {NumberOf(error.at("rms").at(j)), NumberOf(error.at("rms_moving").at(j)), percent[j],
                           NumberOf(error.at("nrmse").at(j)), NumberOf(error.at("r2").at(j))})
      row.push_back(report::Number(v, 4));
    table.rows.push_back(row);
  }
  page.Add(table);
}

// Those that the logs determine stand open.
void AddColumns(report::Page& page, const ordered_json& json) {
  constexpr double kMostlyPrior = 0.7;  // posterior over prior deviation
  const std::vector<std::string> header{"parameter", "unit", "value", "95 % interval", "posterior / prior"};
  report::Table told{header, {}}, prior{header, {}};
  for (const ordered_json& row : json.at("columns")) {
    const double value = NumberOf(row.at("value")), sd = NumberOf(row.at("sd"));
    if (!(sd > 0)) continue;
    const double ratio = row.contains("posterior_over_prior") ? NumberOf(row["posterior_over_prior"]) : std::nan("");
    (ratio > kMostlyPrior ? prior : told)
        .rows.push_back({row.at("name"), ColumnUnit(json, row.at("name"), row.at("unit")), report::Number(value, 4),
                         Interval95(value, sd), report::Number(ratio)});
  }
  page.Section("Parameters");
  page.Add(told);
  if (!prior.rows.empty())
    page.Fold(fmt::format("{} parameters that rest mostly on the prior", prior.rows.size()), prior);
}

}  // namespace

void WriteIdentificationPage(const std::filesystem::path& path, const ordered_json& json) {
  report::Page page("The identified model of " + json.at("robot").get<std::string>(),
                    "The declared model fitted to the training logs, weighted, with the prior.");
  std::vector<double> drawn = Percent(json);
  std::replace_if(
      drawn.begin(), drawn.end(), [](double v) { return std::isnan(v); }, 0.0);
  page.Columns([&](report::Page& left) { AddFit(left, json); },
               [&](report::Page& right) {
                 report::Bars bars{{"error over torque", "joint", "%", 460, 300}, {}, {""}, {drawn}};
                 bars.categories = BarNames(json);
                 right.Add(bars, "Where the joint moves.");
               });
  const int worst = static_cast<int>(std::max_element(drawn.begin(), drawn.end()) - drawn.begin()) + 1;
  const std::string log = IsHeldOut(json) ? json["test"] : json.at("train").at(0);
  const std::vector<ShownPrediction> predicted{
      {"predicted", "predicted", "left", report::Style::kLine, kPredictedColour}};
  page.Section("Measured against predicted torque");
  page.Add(TorqueCharts(json, predicted, {worst}),
           log +
               ". Predictions have gaps where a joint rests or turns: there friction holds any torque up to its "
               "breakaway level.");
  page.Section("Spectrum of what is left");
  page.Add(SpectrumCharts(json, predicted, {worst}), log + "; samples without a prediction count as zero.");
  AddErrors(page, json);
  AddColumns(page, json);
  if (json.contains("held_to_ceilings") && !json["held_to_ceilings"].empty()) {
    page.Section("Held within what a drive takes");
    page.List(json["held_to_ceilings"].get<std::vector<std::string>>());
  }
  if (json.contains("held_out_text") && !json["held_out_text"].empty()) {
    page.Section("What the held-out log cannot tell");
    page.List(json["held_out_text"].get<std::vector<std::string>>());
  }
  page.Section("Exogeneity");
  page.Text("A Durbin-Wu-Hausman test on the training logs.");
  page.Code(json.at("exogeneity_text").get<std::string>());
  page.Section("Provenance");
  page.Facts({{"robot", json.at("robot_title")},
              {"training", fmt::format("{}", fmt::join(json.at("train").get<std::vector<std::string>>(), ", "))},
              {"held out", IsHeldOut(json) ? json["test"].get<std::string>() : "nothing"}});
  page.Write(path);
}

}  // namespace armcal::verdict
