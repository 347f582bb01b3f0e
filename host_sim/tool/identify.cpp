// tool - armcal identify: logs -> parameters with their standard deviations -> a table file.
#include <fmt/core.h>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/report/table.hpp"
#include "host_sim/diagnose/verdict/figures.hpp"
#include "host_sim/identify/calibration/table_file.hpp"
#include "host_sim/tool/identify_method.hpp"
#include "host_sim/tool/identify_payload.hpp"
#include "host_sim/tool/logs.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {
namespace {

struct IdentifyOptions {
  std::string robot, channels, table, json, test, method;
  std::vector<std::string> train;
  bool force = false;
  double band_Hz = 0, cutoff_Hz = 0;
  PayloadOptions payload;
};

std::string Significant(double v) { return fmt::format("{:.5g}", v); }

nlohmann::ordered_json Columns(const codegen::Model& model, const calibration::Fit& fit) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (int c = 0; c < model.columns(); ++c) {
    nlohmann::ordered_json row{
        {"name", model.column_name(c)}, {"unit", model.column_unit(c)}, {"value", fit.x[c]}, {"sd", fit.sd[c]}};
    if (model.robot().has_prior) row["posterior_over_prior"] = fit.ratio(c);
    out.push_back(row);
  }
  return out;
}

Eigen::VectorXd Unknowns(const codegen::Model& model, const calibration::Fit& fit) {
  Eigen::VectorXd z(model.columns() + model.nonlinear());
  z << fit.x.head(model.columns()), Eigen::VectorXd::Map(fit.eta.data(), model.nonlinear());
  return z;
}

void PrintColumns(const codegen::Model& model, const calibration::Fit& fit) {
  report::Table t{{"parameter", "unit", "value", "sd", "posterior / prior", ""}, {}};
  for (const int c : fit.active) {
    if (c >= model.columns()) continue;
    const double ratio = fit.ratio(c);
    t.rows.push_back({model.column_name(c), model.column_unit(c), Significant(fit.x[c]), Significant(fit.sd[c]),
                      model.robot().has_prior ? fmt::format("{:.3f}", ratio) : "-",
                      ratio > calibration::kFromPrior ? "prior" : ""});
  }
  fmt::print("{}", report::Text(t));
}

int RunIdentify(const IdentifyOptions& o) {
  if (o.payload.asked()) {
    if (!o.train.empty() || !o.test.empty() || !o.method.empty())
      throw io::InputError("--with, --without: expected no --train, --test or --method beside them");
    PayloadOptions payload = o.payload;
    payload.robot = o.robot, payload.channels = o.channels, payload.table = o.table, payload.json = o.json;
    payload.cutoff_Hz = o.cutoff_Hz;
    return RunPayload(payload);
  }
  if (o.train.empty()) throw io::InputError("--train: expected log(s) to fit");
  if (!o.method.empty() && !o.table.empty())
    throw io::InputError("--table-out: expected no --method; a table comes from the weighted fit");
  MethodOptions method{o.robot, o.method, o.channels, o.test, o.json, o.train, o.band_Hz, o.cutoff_Hz, {}};
  if (!o.method.empty() && o.method != "auto") return RunMethod(method);
  const codegen::Model model = LoadModel(o.robot);
  const LogReader read(model, o.channels, o.cutoff_Hz);
  std::vector<calibration::Dataset> train = read.All(o.train);
  const calibration::Fit all = calibration::WeightedFit(model, calibration::Pointers(train));
  PrintColumns(model, all);
  nlohmann::ordered_json json{{"robot", model.robot().name}, {"train", o.train}, {"columns", Columns(model, all)}};
  for (int j = 0; j < model.joints(); ++j) {
    json["sigma_Nm"].push_back(all.sigma[j]);
    json["torque_gain"].push_back(1 + all.x[model.columns() + j]);
  }
  const calibration::Exogeneity exogeneity =
      calibration::CheckExogeneity(model, train, Unknowns(model, all), calibration::Instruments::kSimulated);
  fmt::print("{}", verdict::ExogeneityText(exogeneity, "the model lacks a term: armcal diagnose"));
  json["exogeneity"] = verdict::ToJson(exogeneity);
  if (o.method == "auto" && !exogeneity.passed() && exogeneity.instruments == calibration::kSimulatedLoop) {
    method.method = "instrumental_variable", method.exogeneity = json["exogeneity"];
    return RunMethod(method);
  }
  calibration::Fit used = all;
  Eigen::VectorXd x = all.x;
  if (model.robot().has_prior) {
    used = calibration::WeightedFit(model, calibration::Pointers(train),
                                    o.force ? std::vector<int>{} : calibration::HardlyDetermined(model, all));
    const calibration::PhysicalReadOut bodies = calibration::ReadOutPhysical(model, used);
    x = bodies.x;
    const double step = train[0].s.t[1] - train[0].s.t[0];
    const calibration::TableFile table = calibration::IdentifiedTable(model, all, used, bodies, step);
    int from_prior = 0;
    for (const auto& row : table.row) from_prior += row.from_prior;
    for (const auto& row : table.row)
      json["table"].push_back({{"name", row.name},
                               {"mean", row.mean},
                               {"sd", row.sd},
                               {"posterior_sd", row.posterior_sd},
                               {"from_prior", row.from_prior}});
    fmt::print(
        "standard parameters: {} of {} rest mostly on the prior (posterior / prior sd above {}); bodies physical: {}\n",
        from_prior, table.row.size(), calibration::kFromPrior, calibration::IsPhysical(bodies.bodies) ? "yes" : "no");
    json["physical"] = calibration::IsPhysical(bodies.bodies);
    json["from_prior"] = from_prior;
    if (!o.table.empty()) {
      calibration::WriteTable(o.table, table);
      fmt::print("written: {}\n", o.table);
    }
  } else if (!o.table.empty()) {
    throw io::InputError(o.robot + ": prior = \"none\": a table needs standard parameters, and those need a prior");
  }
  if (!o.test.empty()) {
    const calibration::Dataset test = read.One(o.test);
    const verdict::HeldOutError e =
        verdict::CompareHeldOut(test, calibration::Predict(model, test, x, used.eta), o.band_Hz);
    verdict::PrintHeldOut(e, o.test);
    json["test"] = o.test;
    json["held_out"] = verdict::ToJson(e);
  }
  WriteJson(o.json, json);
  return kOk;
}

}  // namespace

void AddIdentify(CLI::App& app, Action& action) {
  auto* verb = app.add_subcommand("identify",
                                  "fit the declared model to logs, weighted, with the prior\nexample: armcal identify "
                                  "--robot er20_like --train train.csv.gz --test test.csv.gz --table-out table.toml\n"
                                  "or find the drives' gains by a known payload, or an unknown payload\nexample: "
                                  "armcal identify --robot er20_like --with b.csv.gz --without a.csv.gz --payload "
                                  "known.toml");
  auto o = std::make_shared<IdentifyOptions>();
  verb->add_option("--robot", o->robot, "robot file or name")->required();
  verb->add_option("--train", o->train, "log(s) to fit");
  verb->add_option("--test", o->test, "held-out log: its error is printed, nothing is fitted to it");
  verb->add_option("--channels", o->channels, "channel map (TOML) of foreign logs");
  verb->add_option(
      "--method", o->method,
      "another method than the weighted fit with prior: a name of the survey's, see docs; auto: instrumental "
      "variables where the regressors are not free of the torque's error and the control law is known");
  verb->add_option("--table-out", o->table, "parameter table to write");
  verb->add_option(
      "--band", o->band_Hz,
      "also compare in the band below this frequency (Hz): residual and torque through the same zero-phase filter");
  AddCutoff(*verb, o->cutoff_Hz);
  verb->add_flag("--force", o->force, "let parameters move that the data hardly determine");
  verb->add_option("--json", o->json, "write everything here");
  AddPayloadOptions(*verb, o->payload);
  verb->callback([o, &action] { action = [o] { return RunIdentify(*o); }; });
}

}  // namespace armcal::tool
