// analysis - identifies the declared model.
#include "host_sim/diagnose/analysis/identified.hpp"

#include "host_sim/diagnose/verdict/curves.hpp"
#include "host_sim/diagnose/verdict/json.hpp"
#include "host_sim/identify/calibration/information.hpp"
#include "host_sim/identify/calibration/table_ceilings.hpp"

namespace armcal::analysis {

using nlohmann::ordered_json;

namespace {

constexpr int kMostRounds = 8;  // of fits within ceilings; two are usual

ordered_json Columns(const codegen::Model& model, const calibration::Fit& fit) {
  ordered_json out = ordered_json::array();
  for (int c = 0; c < model.columns(); ++c) {
    ordered_json row{
        {"name", model.column_name(c)}, {"unit", model.column_unit(c)}, {"value", fit.x[c]}, {"sd", fit.sd[c]}};
    if (model.robot().has_prior) row["posterior_over_prior"] = fit.ratio(c);
    out.push_back(row);
  }
  return out;
}

ordered_json Nonlinear(const codegen::Model& model, const std::vector<double>& eta) {
  ordered_json out = ordered_json::array();
  for (int k = 0; k < model.nonlinear(); ++k)
    out.push_back({{"name", model.unknowns()[k].name},
                   {"unit", model.unknowns()[k].unit},
                   {"value", eta[static_cast<std::size_t>(k)]}});
  return out;
}

Eigen::VectorXd Unknowns(const codegen::Model& model, const calibration::Fit& fit) {
  Eigen::VectorXd z(model.columns() + model.nonlinear());
  z << fit.x.head(model.columns()), Eigen::VectorXd::Map(fit.eta.data(), model.nonlinear());
  return z;
}

const codegen::Model& Physical(const codegen::Model& model) {
  if (model.robot().has_prior) calibration::RequirePhysicalPrior(model);
  return model;
}

}  // namespace

int IdentifiedBodies::FromPrior() const {
  int count = 0;
  for (const calibration::TableRow& row : table.row) count += row.from_prior;
  return count;
}

IdentifiedBodies ReadBodies(const codegen::Model& model, const calibration::Fit& all, const calibration::Fit& used,
                            const std::vector<calibration::Dataset>& train) {
  const Eigen::VectorXd noise = calibration::NoiseDensity(model, calibration::Pointers(train), used);
  IdentifiedBodies out;
  out.widths = calibration::EstimateLinkWidths(model, used);
  out.bodies = calibration::ReadOutWithWidths(model, used, out.widths);
  out.table = calibration::IdentifiedTable(model, all, out.bodies, noise);
  // A fit within limits may cross others, and friction that depends on the load changes with the bodies.
  std::vector<calibration::Limit> limits;
  for (int round = 0; round < kMostRounds; ++round) {
    calibration::Ceiled beyond = calibration::BeyondCeilings(model, out.table);
    if (beyond.limits.empty()) break;
    limits.insert(limits.end(), beyond.limits.begin(), beyond.limits.end());
    out.held.insert(out.held.end(), beyond.said.begin(), beyond.said.end());
    out.bodies = calibration::ReadOutWithWidths(model, used, out.widths, limits);
    out.table = calibration::IdentifiedTable(model, all, out.bodies, noise);
  }
  for (int k = 0; k < model.body_parameters(); ++k) {
    calibration::TableRow& row = out.table.row[static_cast<std::size_t>(k)];
    row.from_prior = row.sd > 0 && row.posterior_sd > calibration::kFromPrior * out.widths.sd[k];
  }
  return out;
}

Identified::Identified(const codegen::Model& identified, const std::vector<calibration::Dataset>& train)
    : model(Physical(identified)),
      all(calibration::WeightedFit(model, calibration::Pointers(train))),
      used(all),
      exogeneity(
          calibration::CheckExogeneity(model, train, Unknowns(model, all), calibration::Instruments::kSimulated)) {}

void Identified::ReadOut(const std::vector<calibration::Dataset>& train, bool force) {
  used = calibration::WeightedFit(model, calibration::Pointers(train),
                                  force ? std::vector<int>{} : calibration::HardlyDetermined(model, all));
  read = ReadBodies(model, all, used, train);
  has_bodies = true;
}

Identified::OnLog Identified::Compare(const calibration::Dataset& log, bool held_out, double band_Hz) const {
  const Eigen::MatrixXd predicted = calibration::Predict(model, log, x(), eta());
  OnLog out{verdict::CompareHeldOut(log, predicted, band_Hz), {}};
  out.json[held_out ? "held_out" : "on_training"] = verdict::ToJson(out.error);
  for (int j = 0; j < log.joints(); ++j)
    out.json["curves"].push_back(verdict::CurvesOf(log, j, {{"predicted", predicted.col(j)}}));
  return out;
}

ordered_json Identified::ToJson() const {
  ordered_json json;
  verdict::AddRobot(json, model.robot());
  json["columns"] = Columns(model, all);
  for (int j = 0; j < model.joints(); ++j) {
    json["sigma_Nm"].push_back(all.sigma[j]);
    json["torque_gain"].push_back(1 + all.x[model.columns() + j]);
  }
  if (model.nonlinear() > 0) json["nonlinear"] = Nonlinear(model, all.eta);
  json["exogeneity"] = verdict::ToJson(exogeneity);
  json["exogeneity_text"] = verdict::ExogeneityText(exogeneity, kLacksTerm);
  if (!has_bodies) return json;
  json["link_widths"] = {{"relative", std::vector<double>(read.widths.relative.begin(), read.widths.relative.end())},
                         {"center_m", read.widths.center_m},
                         {"inertia_of_trace", read.widths.inertia_of_trace}};
  for (const calibration::TableRow& row : read.table.row)
    json["table"].push_back({{"name", row.name},
                             {"mean", row.mean},
                             {"sd", row.sd},
                             {"posterior_sd", row.posterior_sd},
                             {"from_prior", row.from_prior}});
  json["held_to_ceilings"] = read.held;
  for (int j = 0; j < model.joints(); ++j) json["table_gain"].push_back(1 + x()[model.columns() + j]);
  json["physical"] = calibration::IsPhysical(read.bodies.bodies);
  json["from_prior"] = read.FromPrior();
  return json;
}

}  // namespace armcal::analysis
