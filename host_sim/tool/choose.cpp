// tool - armcal choose: which friction law each joint has.
#include <fmt/core.h>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/report/progress.hpp"
#include "host_sim/data/report/table.hpp"
#include "host_sim/identify/choice/choose.hpp"
#include "host_sim/tool/logs.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {
namespace {

using nlohmann::ordered_json;

struct ChooseOptions {
  std::string robot, json;
  LogFormat format;
  std::vector<std::string> train, test;
  double cutoff_Hz = 0;
};

std::string Percent(const choice::Ratio& ratio) {
  if (std::isnan(ratio.value)) return "-";
  return fmt::format("{:+.1f} [{:+.1f}, {:+.1f}]", 100 * ratio.value, 100 * ratio.low, 100 * ratio.high);
}

std::string Title(const choice::FrictionLaw& law) {
  return law.equation.empty() ? law.name : law.name + " " + law.equation;
}

ordered_json ToJson(const choice::Ratio& ratio) {
  return {{"value", ratio.value}, {"interval_95", {ratio.low, ratio.high}}};
}

std::string Sentence(const choice::Choice& choice, std::size_t j) {
  const choice::JointChoice& joint = choice.joint[j];
  const std::string name = choice.laws[joint.chosen].name;
  if (!joint.failed.empty()) return fmt::format("joint {}: no law can be fitted: {}", j + 1, joint.failed);
  if (!joint.differ)
    return fmt::format("joint {}: the laws do not differ on these logs; {} has the fewest parameters", j + 1, name);
  if (joint.chosen == joint.best) return fmt::format("joint {}: {} has the smallest error", j + 1, name);
  return fmt::format("joint {}: {} has the fewest parameters of the laws that are as good as the best one, {}", j + 1,
                     name, choice.laws[joint.best].name);
}

void PrintChoice(const choice::Choice& choice, ordered_json& json) {
  report::Table t{{"joint", "law", "parameters", "error / N m", "over the best, %", "beaten"}, {}};
  json["laws"] = ordered_json::array();
  for (const choice::FrictionLaw& law : choice.laws)
    json["laws"].push_back(
        {{"name", law.name}, {"equation", law.equation}, {"title", law.title}, {"parameters", law.parameters}});
  json["joints"] = ordered_json::array();
  for (std::size_t j = 0; j < choice.joint.size(); ++j) {
    const choice::JointChoice& joint = choice.joint[j];
    ordered_json errors = ordered_json::array();
    for (std::size_t l = 0; l < joint.law.size(); ++l) {
      const choice::LawError& e = joint.law[l];
      ordered_json one{{"law", choice.laws[l].name}};
      if (e.failed.empty()) {
        t.rows.push_back({std::to_string(j + 1), Title(choice.laws[l]), std::to_string(choice.laws[l].parameters),
                          fmt::format("{:.4g}", e.rms_Nm), l == joint.best ? "-" : Percent(e.over_best),
                          e.beaten ? "yes" : "no"});
        one.update({{"rms_Nm", e.rms_Nm}, {"over_best", ToJson(e.over_best)}, {"beaten", e.beaten}});
      } else {
        t.rows.push_back({std::to_string(j + 1), Title(choice.laws[l]), std::to_string(choice.laws[l].parameters), "-",
                          "-", "not fitted"});
        one["failed"] = e.failed;
      }
      errors.push_back(one);
    }
    json["joints"].push_back({{"joint", j + 1},
                              {"law", choice.laws[joint.chosen].name},
                              {"best", choice.laws[joint.best].name},
                              {"differ", joint.differ},
                              {"sentence", Sentence(choice, j)},
                              {"errors", errors}});
    if (!joint.failed.empty()) json["joints"].back()["failed"] = joint.failed;
  }
  fmt::print("on stretches of the training logs that the fit has not seen\n{}\n", report::Text(t));
  for (std::size_t j = 0; j < choice.joint.size(); ++j)
    for (std::size_t l = 0; l < choice.laws.size() && choice.joint[j].failed.empty(); ++l)
      if (const std::string& why = choice.joint[j].law[l].failed; !why.empty())
        fmt::print("joint {}: {} was not fitted: {}\n", j + 1, choice.laws[l].name, why);
  for (std::size_t j = 0; j < choice.joint.size(); ++j) fmt::print("{}\n", Sentence(choice, j));
}

// What the robot file needs for the chosen laws.
void PrintEffects(const choice::Choice& choice) {
  std::string text;
  for (std::size_t l = 1; l < choice.laws.size(); ++l) {
    std::string joints;
    for (std::size_t j = 0; j < choice.joint.size(); ++j)
      if (choice.joint[j].chosen == l) joints += (joints.empty() ? "" : ", ") + std::to_string(j + 1);
    if (!joints.empty()) text += fmt::format("[[effect]]\nname = \"{}\"\njoints = [{}]\n", choice.laws[l].name, joints);
  }
  if (!text.empty()) fmt::print("\nadd to the robot file:\n{}", text);
}

void PrintTests(const std::vector<std::vector<choice::HeldOut>>& tests, const std::vector<calibration::Dataset>& logs,
                ordered_json& json) {
  json["tests"] = ordered_json::array();
  for (std::size_t log = 0; log < tests.size(); ++log) {
    report::Table t{{"joint", "torque / N m", "coulomb_viscous / N m", "chosen / N m", "difference, %"}, {}};
    ordered_json joints = ordered_json::array();
    for (std::size_t j = 0; j < tests[log].size(); ++j) {
      const choice::HeldOut& e = tests[log][j];
      t.rows.push_back({std::to_string(j + 1), report::Number(e.torque_Nm, 4), report::Number(e.plain_Nm, 4),
                        report::Number(e.chosen_Nm, 4), Percent(e.over_plain)});
      joints.push_back({{"joint", j + 1},
                        {"torque_Nm", e.torque_Nm},
                        {"coulomb_viscous_Nm", e.plain_Nm},
                        {"chosen_Nm", e.chosen_Nm},
                        {"over_coulomb_viscous", ToJson(e.over_plain)}});
    }
    fmt::print("\nheld out: {}\n{}", logs[log].source, report::Text(t));
    json["tests"].push_back({{"log", logs[log].source}, {"joints", joints}});
  }
}

int RunChoose(const ChooseOptions& o) {
  const codegen::Robot robot = codegen::ReadRobot(RobotPath(o.robot));
  const codegen::Catalogue records = LoadCatalogue();
  const codegen::Model model(robot, records);
  const LogReader read(model, o.format, o.cutoff_Hz);
  const std::vector<calibration::Dataset> train = read.All(o.train);
  choice::ChooseSettings settings;
  report::Progress progress("laws");
  settings.progress = [&](double share) { progress.Set(share); };
  const choice::Choice choice = choice::Choose(robot, records, train, settings);
  ordered_json json{{"robot", o.robot}, {"train", calibration::Sources(train)}};
  PrintChoice(choice, json);
  PrintEffects(choice);
  if (!o.test.empty()) {
    const std::vector<calibration::Dataset> tests = read.All(o.test);
    PrintTests(choice::Judge(choice, robot, records, train, tests), tests, json);
  }
  WriteJson(o.json, json);
  return kOk;
}

}  // namespace

void AddChoose(CLI::App& app, Action& action) {
  auto* verb =
      app.add_subcommand("choose",
                         "which friction law each joint has, by stretches of the training logs that a fit has not "
                         "seen\nexample: armcal choose --robot er20_like --train train.csv.gz --test test.csv.gz");
  auto o = std::make_shared<ChooseOptions>();
  verb->add_option("--robot", o->robot, "robot file or name")->required();
  verb->add_option("--train", o->train, "log(s) on which the laws are compared")->required();
  verb->add_option("--test", o->test, "held-out log(s): read after the choice, to judge it");
  AddLogFormat(*verb, o->format);
  AddCutoff(*verb, o->cutoff_Hz);
  verb->add_option("--json", o->json, "write everything here");
  verb->callback([o, &action] { action = [o] { return RunChoose(*o); }; });
}

}  // namespace armcal::tool
