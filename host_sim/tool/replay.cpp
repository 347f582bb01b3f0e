// tool - armcal replay: simulates a model from a log's torque in open loop, and refines its parameters for that.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/report/table.hpp"
#include "host_sim/diagnose/verdict/figures.hpp"
#include "host_sim/diagnose/verdict/json_values.hpp"
#include "host_sim/identify/calibration/log_check.hpp"
#include "host_sim/identify/replay/position_error.hpp"
#include "host_sim/identify/replay/refine.hpp"
#include "host_sim/identify/search/parallel.hpp"
#include "host_sim/tool/command_line.hpp"
#include "host_sim/tool/given.hpp"
#include "host_sim/tool/logs.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {
namespace {

struct ReplayOptions {
  GivenOptions given;
  std::string json;
  LogFormat format;
  std::vector<std::string> logs, refine;
  int start_samples = 20, refits = 0;
  double step_s = 1e-3, cutoff_Hz = 0;
  replay::RefineSettings refinement;
};

// A position error in the unit that a person reads: mm or mrad.
constexpr double kMilli = 1e3;
const char* UnitOf(const codegen::Joint& joint) {
  return joint.kinematics.type == codegen::JointType::kPrismatic ? "mm" : "mrad";
}

nlohmann::ordered_json ToJson(const replay::PositionError& e, const std::string& log) {
  nlohmann::ordered_json json{{"log", log}, {"start_s", e.start_s}, {"length_s", e.length_s}};
  for (const auto& after : e.after)
    json["after"].push_back({{"seconds", after.seconds}, {"error", verdict::ToList(after.error)}});
  json["rms"] = verdict::ToList(e.rms), json["most"] = verdict::ToList(e.most);
  if (e.ran_away_s > 0) json["ran_away_s"] = e.ran_away_s;
  if (e.left_limits_s > 0) json["left_limits_s"] = e.left_limits_s;
  return json;
}

void Print(const codegen::Model& model, const replay::PositionError& e, const std::string& log) {
  report::Table t{{"joint", "unit", "rms", "largest"}, {}, "free run: " + log};
  for (const auto& after : e.after) t.header.push_back(fmt::format("after {:.4g} s", after.seconds));
  for (int j = 0; j < model.joints(); ++j) {
    t.rows.push_back({std::to_string(j + 1), UnitOf(model.robot().joint[static_cast<std::size_t>(j)]),
                      fmt::format("{:.3f}", kMilli * e.rms[j]), fmt::format("{:.3f}", kMilli * e.most[j])});
    for (const auto& after : e.after) t.rows.back().push_back(fmt::format("{:.3f}", kMilli * after.error[j]));
  }
  fmt::print("{}", report::Text(t));
  if (e.ran_away_s > 0)
    fmt::print("ran away {:.3g} s after the start: without a controller this arm does not keep to the path\n",
               e.ran_away_s);
  else if (e.left_limits_s > 0)
    fmt::print("a joint leaves its position limits {:.3g} s after the start; the model has no end stops\n",
               e.left_limits_s);
}

replay::Parameters ParametersOf(const codegen::Model& model, const Eigen::VectorXd& x, const std::vector<double>& eta) {
  Eigen::VectorXd z(model.columns() + model.nonlinear());
  z << x.head(model.columns()), Eigen::VectorXd::Map(eta.data(), model.nonlinear());
  return {z, x.tail(model.joints())};
}

replay::Record ReadRecord(const LogReader& read, const codegen::Model& model, const std::string& path) {
  const logs::Log log = read.Raw(path);
  if (log.joints != model.joints())
    throw io::InputError(fmt::format("{}: {} joints, expected {} (robot {})", log.source, log.joints, model.joints(),
                                     model.robot().name));
  const calibration::SignalCheck check = calibration::CheckSignals(model.robot(), log);
  if (!check.lack.empty()) throw io::InputError(log.source + ": " + check.lack);
  for (const std::string& note : check.notes) fmt::print(stderr, "{}: {}\n", log.source, note);
  return replay::MakeRecord(log);
}

// Names and values as identify's JSON has them, so that --table takes this JSON, too.
void PutParameters(const codegen::Model& model, const replay::Refined& r, nlohmann::ordered_json& json) {
  for (int c = 0; c < model.columns(); ++c)
    json["columns"].push_back({{"name", model.column_name(c)}, {"unit", model.column_unit(c)}, {"value", r.x[c]}});
  for (int k = 0; k < model.nonlinear(); ++k)
    json["nonlinear"].push_back({{"name", model.unknowns()[k].name}, {"value", r.eta[static_cast<std::size_t>(k)]}});
  for (int j = 0; j < model.joints(); ++j) json["torque_gain"].push_back(1 + r.x[model.columns() + j]);
}

void PrintRefined(const codegen::Model& model, const replay::Refined& r, const calibration::Fit& fit) {
  report::Table lengths{
      {"segment s", "left-out error"}, {}, "segment lengths, by blocks that were left out of the fit"};
  for (const auto& l : r.lengths)
    lengths.rows.push_back(
        {fmt::format("{:.3g}", l.segment_s), std::isfinite(l.error) ? fmt::format("{:.4f}", l.error) : "runs away"});
  if (!r.lengths.empty()) fmt::print("{}", report::Text(lengths));
  fmt::print("refined on {} segments of {:.3g} s, {} starting points, {} of them end at the same sum of squares\n",
             r.segments, r.segment_s, r.tries, r.agree);
  report::Table t{{"parameter", "unit", "identified", "refined"}, {}};
  for (const int c : fit.active) {
    if (c >= model.columns()) continue;
    t.rows.push_back({model.column_name(c),
                      verdict::ColumnUnit(model.robot(), model.column_name(c), model.column_unit(c)),
                      fmt::format("{:.5g}", fit.x[c]), fmt::format("{:.5g}", r.x[c])});
  }
  fmt::print("{}", report::Text(t));
}

double Quantile(std::vector<double> v, double share) {
  std::sort(v.begin(), v.end());
  const double at = share * static_cast<double>(v.size() - 1);
  const auto k = static_cast<std::size_t>(at);
  const double share_of_next = at - static_cast<double>(k);
  return share_of_next > 0 ? v[k] + share_of_next * (v[k + 1] - v[k]) : v[k];  // the next one may be infinite
}

// Refits on blocks drawn anew: how much of the free run's error is luck of the training record.
void Refits(const ReplayOptions& o, const codegen::Model& model, const std::vector<replay::Training>& training,
            const calibration::Fit& fit, const replay::Refined& refined, const std::vector<replay::Record>& logs,
            nlohmann::ordered_json& json) {
  std::vector<std::vector<Eigen::VectorXd>> rms(static_cast<std::size_t>(o.refits));
  search::InParallel(o.refits, 0, [&](int k) {
    replay::RefineSettings settings = o.refinement;
    settings.resample = true, settings.segment_s = refined.segment_s;
    settings.seed += static_cast<std::uint64_t>(k) + 1;
    const replay::Refined again = replay::Refine(model, training, fit, settings);
    for (const replay::Record& log : logs) {
      const replay::PositionError e =
          replay::Replay(model, log, ParametersOf(model, again.x, again.eta), o.start_samples, o.step_s);
      const bool ran_away = again.agree == 0 || e.ran_away_s > 0;
      rms[static_cast<std::size_t>(k)].push_back(
          ran_away ? Eigen::VectorXd::Constant(e.rms.size(), std::numeric_limits<double>::infinity()) : e.rms);
    }
  });
  for (std::size_t l = 0; l < logs.size(); ++l) {
    report::Table t{{"joint", "unit", "median rms", "90 %", "largest"},
                    {},
                    fmt::format("free run of {}, {} refits on resampled blocks", logs[l].source, o.refits)};
    nlohmann::ordered_json row{{"log", logs[l].source}};
    for (int j = 0; j < model.joints(); ++j) {
      std::vector<double> values;
      for (const auto& refit : rms) values.push_back(refit[l][j]);
      t.rows.push_back({std::to_string(j + 1), UnitOf(model.robot().joint[static_cast<std::size_t>(j)])});
      for (const double share : {0.5, 0.9, 1.0})
        t.rows.back().push_back(fmt::format("{:.3f}", kMilli * Quantile(values, share)));
      row["rms"].push_back(values);
    }
    fmt::print("{}", report::Text(t));
    const auto ran_away =
        std::count_if(rms.begin(), rms.end(), [l](const auto& refit) { return std::isinf(refit[l][0]); });
    row["ran_away"] = ran_away;
    if (ran_away > 0) fmt::print("{} of them ran away; they count as an infinite error\n", ran_away);
    json["refits"].push_back(row);
  }
}

int RunReplay(const ReplayOptions& o) {
  const codegen::Model model = GivenModel(o.given);
  const LogReader read(model, o.format, o.cutoff_Hz);
  std::vector<replay::Record> logs;
  for (const std::string& path : o.logs) logs.push_back(ReadRecord(read, model, path));
  nlohmann::ordered_json json = ToJson(o.given, model);
  json["start_samples"] = o.start_samples, json["step_s"] = o.step_s;
  calibration::Given given;
  if (o.refine.empty()) {
    if (o.cutoff_Hz > 0)
      throw io::InputError("--cutoff: expected --refine LOG beside it; a simulation needs no derived speeds");
    given = ReadGiven(o.given, model);
  } else {
    if (!o.given.table.empty() || !o.given.payload.empty())
      throw io::InputError(
          "--refine: expected no --table or --payload beside it; it begins at the fit to its own logs");
    const std::vector<calibration::Dataset> data = read.All(o.refine);
    const calibration::Fit fit = calibration::WeightedFit(model, calibration::Pointers(data));
    std::vector<replay::Training> training;
    for (const calibration::Dataset& log : data)  // without those that are too short
      training.push_back(replay::MakeTraining(read.Raw(log.source), log));
    const replay::Refined refined = replay::Refine(model, training, fit, o.refinement);
    PrintRefined(model, refined, fit);
    json["refine"] = {{"train", calibration::Sources(data)},
                      {"segment_s", refined.segment_s},
                      {"segments", refined.segments},
                      {"tries", refined.tries},
                      {"agree", refined.agree},
                      {"rms", verdict::ToList(refined.rms)},
                      {"seed", o.refinement.seed}};
    for (const auto& l : refined.lengths)
      json["refine"]["lengths"].push_back({{"segment_s", l.segment_s}, {"left_out_error", l.error}});
    PutParameters(model, refined, json);
    given.x = refined.x, given.eta = refined.eta;
    for (const replay::Record& log : logs)  // what identification alone gives
      json["identified"].push_back(ToJson(
          replay::Replay(model, log, ParametersOf(model, fit.x, fit.eta), o.start_samples, o.step_s), log.source));
    if (o.refits > 0) Refits(o, model, training, fit, refined, logs, json);
  }
  for (const replay::Record& log : logs) {
    const replay::PositionError e =
        replay::Replay(model, log, ParametersOf(model, given.x, given.eta), o.start_samples, o.step_s);
    Print(model, e, log.source);
    json["logs"].push_back(ToJson(e, log.source));
  }
  WriteJson(o.json, json);
  return kOk;
}

}  // namespace

void AddReplay(CLI::App& app, Action& action) {
  auto* verb = app.add_subcommand(
      "replay",
      "simulate a model in open loop from a log's torque, and compare the positions\nexample: armcal replay --robot "
      "er20_like --table table.toml test.csv.gz\nexample: armcal replay --robot emps --channels "
      "host_sim/data/channels/emps.toml --refine train.csv.gz test.csv.gz");
  auto o = std::make_shared<ReplayOptions>();
  AddGivenOptions(*verb, o->given);
  verb->add_option("logs", o->logs, "log(s) whose torque is the input")->required();
  AddLogFormat(*verb, o->format);
  verb->add_option("--start-samples", o->start_samples,
                   "initial position and speed come from a parabola through this many samples")
      ->check(Between(3, 1000000));
  verb->add_option("--step", o->step_s, "longest step of the simulation (s)")->check(Between(1e-6, 1.0));
  auto* refine = verb->add_option(
      "--refine", o->refine, "log(s) to fit the parameters to, by output error of many short runs (multiple shooting)");
  verb->add_option("--period", o->refinement.block_s,
                   "length of the blocks that are left out or drawn (s): the period of the training motion; default: "
                   "a quarter of each log")
      ->check(AboveZero())
      ->needs(refine);
  verb->add_option("--segment", o->refinement.segment_s,
                   "length of a run (s); default: chosen by blocks of the training logs that are left out in turn")
      ->check(AboveZero())
      ->needs(refine);
  verb->add_option("--tries", o->refinement.tries, "starting points")->check(Between(1, 1000))->needs(refine);
  verb->add_option("--seed", o->refinement.seed, "of the random draws")->needs(refine);
  verb->add_option("--refits", o->refits, "refit that often on blocks drawn anew, each time from drawn starting points")
      ->check(Between(0, 1000))
      ->needs(refine);
  AddCutoff(*verb, o->cutoff_Hz);
  verb->add_option("--json", o->json, "write everything here; --table takes it as parameters");
  verb->callback([o, &action] { action = [o] { return RunReplay(*o); }; });
}

}  // namespace armcal::tool
