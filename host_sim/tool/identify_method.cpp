// tool - armcal identify --method: any method of the survey, or one that beats it, on any log and robot.
#include "host_sim/tool/identify_method.hpp"

#include <fmt/core.h>

#include "host_sim/data/report/table.hpp"
#include "host_sim/diagnose/verdict/figures.hpp"
#include "host_sim/identify/calibration/information.hpp"
#include "host_sim/identify/methods/closed_loop.hpp"
#include "host_sim/identify/methods/method.hpp"
#include "host_sim/tool/logs.hpp"

namespace armcal::tool {
namespace {

// Name, value and standard deviation of every unknown.
nlohmann::ordered_json PrintUnknowns(const codegen::Model& model, const calibration::Solution& s) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  report::Table t{{"parameter", "unit", "value", "sd"}, {}};
  for (Eigen::Index k = 0; k < s.z.size(); ++k) {
    const int column = static_cast<int>(k), unknown = column - model.columns();
    const std::string name = unknown < 0 ? model.column_name(column) : model.unknowns()[unknown].name;
    const std::string unit = unknown < 0 ? model.column_unit(column) : model.unknowns()[unknown].unit;
    const bool has_sd = s.covariance.size() > 0;
    const double sd = has_sd ? std::sqrt(std::max(0.0, s.covariance(k, k))) : 0;
    t.rows.push_back({name, unit, fmt::format("{:.5g}", s.z[k]), has_sd ? fmt::format("{:.3g}", sd) : "-"});
    out.push_back({{"name", name}, {"unit", unit}, {"value", s.z[k]}});
    if (has_sd) out.back()["sd"] = sd;
  }
  fmt::print("{}", report::Text(t));
  return out;
}

// The arm under its control law along what the logs say was commanded; empty where that is not known.
calibration::ClosedLoop Loop(const codegen::Model& model, const std::vector<calibration::Dataset>& data) {
  const std::map<std::string, Eigen::MatrixXd> reference = calibration::References(data);
  if (reference.empty() || model.robot().control.structure.empty()) return {};
  return calibration::MakeClosedLoop(model, reference);
}

// Where the robot file has no prior, a search still needs a start and ranges: those of weighted least squares. Returns
// what to tell the user.
std::string RangesFromLeastSquares(calibration::Problem& problem) {
  constexpr double kDeviations = 10;
  calibration::Problem plain = problem;
  plain.covariance.resize(0, 0);
  const calibration::Solution s = calibration::Solve(calibration::FindMethod("weighted_pseudo_inverse"), plain);
  const Eigen::VectorXd reach = kDeviations * s.covariance.diagonal().cwiseSqrt();
  problem.start = s.z;
  problem.lower = problem.lower.cwiseMax(s.z - reach), problem.upper = problem.upper.cwiseMin(s.z + reach);
  problem.start = problem.start.cwiseMax(problem.lower).cwiseMin(problem.upper);
  return fmt::format("ranges: weighted least squares +- {:g} standard deviations; the robot file has no prior",
                     kDeviations);
}

}  // namespace

int RunMethod(const MethodOptions& o) {
  const calibration::Method& method = calibration::FindMethod(o.method);
  const codegen::Model model = LoadModel(o.robot);
  const LogReader read(model, o.channels, o.cutoff_Hz);
  const std::vector<calibration::Dataset> train = read.All(o.train);
  calibration::Problem problem = calibration::MakeProblem(model, calibration::Pointers(train));
  if (method.needs_loop) problem.closed_loop = Loop(model, train);
  const std::string ranges =
      method.needs_ranges && !model.robot().has_prior ? RangesFromLeastSquares(problem) : std::string();
  if (!ranges.empty()) fmt::print("{}\n", ranges);
  const calibration::Solution s = calibration::Solve(method, problem);
  nlohmann::ordered_json json{{"robot", model.robot().name}, {"train", o.train}, {"method", method.name}};
  json["parameters"] = PrintUnknowns(model, s);
  json["physical"] = s.physical, json["converged"] = s.converged, json["iterations"] = s.iterations;
  json["seconds"] = s.seconds, json["memory_bytes"] = s.memory_bytes, json["from_prior"] = s.from_prior;
  json["remark"] = s.remark;
  if (!ranges.empty()) json["ranges"] = ranges;
  if (!o.exogeneity.is_null()) json["exogeneity"] = o.exogeneity;
  fmt::print("{}{}{}: {} iterations, {}, {:.3f} s, {:.1f} MB, bodies physical: {}{}{}\n", method.title,
             *method.equation ? " " : "", method.equation, s.iterations, s.converged ? "converged" : "NOT converged",
             s.seconds, 1e-6 * static_cast<double>(s.memory_bytes), s.physical ? "yes" : "no",
             s.remark.empty() ? "" : "; ", s.remark);
  if (!o.test.empty()) {
    const calibration::Dataset test = read.One(o.test);
    const int columns = model.columns(), unknowns = model.nonlinear();
    Eigen::VectorXd x = Eigen::VectorXd::Zero(columns + model.joints());  // no torque gains here
    x.head(columns) = s.z.head(columns);
    const verdict::HeldOutError e = verdict::CompareHeldOut(
        test, calibration::Predict(model, test, x, {s.z.data() + columns, static_cast<std::size_t>(unknowns)}),
        o.band_Hz);
    verdict::PrintHeldOut(e, o.test);
    json["test"] = o.test;
    json["held_out"] = verdict::ToJson(e);
  }
  WriteJson(o.json, json);
  return s.converged ? kOk : kPartial;
}

}  // namespace armcal::tool
