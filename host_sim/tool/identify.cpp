// tool - armcal identify: fits parameters to logs, by the weighted fit, by another method, or with a payload.
#include <fmt/core.h>
#include <fmt/ranges.h>

#include <cmath>

#include "codegen/src/io/input_error.hpp"
#include "codegen/src/io/json.hpp"
#include "host_sim/data/files/files.hpp"
#include "host_sim/data/report/table.hpp"
#include "host_sim/diagnose/analysis/identified.hpp"
#include "host_sim/diagnose/verdict/figures.hpp"
#include "host_sim/diagnose/verdict/identification_page.hpp"
#include "host_sim/diagnose/verdict/json_values.hpp"
#include "host_sim/identify/calibration/information.hpp"
#include "host_sim/identify/calibration/payload.hpp"
#include "host_sim/identify/calibration/table_ceilings.hpp"
#include "host_sim/identify/calibration/table_file.hpp"
#include "host_sim/identify/methods/closed_loop.hpp"
#include "host_sim/identify/methods/method.hpp"
#include "host_sim/tool/logs.hpp"
#include "host_sim/tool/verb.hpp"
#include "host_sim/tool/watched.hpp"

namespace armcal::tool {

using calibration::DriveGain;

namespace {

// --method: any method of the survey, or one that beats it.
struct MethodOptions {
  std::string robot, method, test, json;
  LogFormat format;
  std::vector<std::string> train;
  double band_Hz = 0, cutoff_Hz = 0;
  nlohmann::ordered_json exogeneity;  // the test that chose the method, for the JSON; null: it was asked for
};

// An end that the logs do not bound is null in JSON.
nlohmann::ordered_json EndOf(double end) { return std::isfinite(end) ? nlohmann::ordered_json(end) : nullptr; }

// Name, value, standard deviation and 95 % interval of every unknown.
nlohmann::ordered_json PrintUnknowns(const codegen::Model& model, const calibration::Solution& s) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  report::Table t{{"parameter", "unit", "value", "sd"}, {}};
  const bool profiled = s.interval.size() > 0;
  if (profiled) t.header.push_back("95 % interval");
  for (Eigen::Index k = 0; k < s.z.size(); ++k) {
    const int column = static_cast<int>(k), unknown = column - model.columns();
    const std::string name = unknown < 0 ? model.column_name(column) : model.unknowns()[unknown].name;
    const std::string unit = unknown < 0 ? model.column_unit(column) : model.unknowns()[unknown].unit;
    const bool has_sd = s.covariance.size() > 0;
    const double sd = has_sd ? std::sqrt(std::max(0.0, s.covariance(k, k))) : 0;
    t.rows.push_back({name, unit, fmt::format("{:.5g}", s.z[k]), has_sd ? fmt::format("{:.3g}", sd) : "-"});
    out.push_back({{"name", name}, {"unit", unit}, {"value", s.z[k]}});
    if (has_sd) out.back()["sd"] = sd;
    if (!profiled) continue;
    const double low = s.interval(k, 0), high = s.interval(k, 1);
    out.back()["interval_95"] = {EndOf(low), EndOf(high)};
    const auto end = [](double v) { return std::isfinite(v) ? fmt::format("{:.5g}", v) : std::string("open"); };
    t.rows.back().push_back(end(low) + " .. " + end(high));
  }
  fmt::print("{}", report::Text(t));
  return out;
}

// The arm under its control law along what the logs say was commanded; empty where that is not known.
calibration::ClosedLoop Loop(const codegen::Model& model, const std::vector<calibration::Dataset>& data) {
  if (!calibration::HaveReferences(data) || model.robot().control.structure.empty()) return {};
  return calibration::MakeClosedLoop(model);
}

// Where the robot file has no prior, a search still needs a start and ranges: those of least squares. Returns what to
// tell the user.
std::string RangesFromLeastSquares(calibration::Problem& problem) {
  constexpr double kDeviations = 10;
  calibration::Problem plain = problem;
  plain.covariance.resize(0, 0);
  const calibration::Solution s = calibration::Solve(calibration::LeastSquaresFor(*plain.model), plain);
  const Eigen::VectorXd reach = kDeviations * s.covariance.diagonal().cwiseSqrt();
  problem.start = s.z;
  problem.lower = problem.lower.cwiseMax(s.z - reach), problem.upper = problem.upper.cwiseMin(s.z + reach);
  problem.start = problem.start.cwiseMax(problem.lower).cwiseMin(problem.upper);
  return fmt::format("ranges: weighted least squares +- {:g} standard deviations; the robot file has no prior",
                     kDeviations);
}

// What the held-out log cannot tell, to the terminal and the JSON.
void AddMotion(const calibration::HeldOutMotion& motion, nlohmann::ordered_json& json) {
  for (const std::string& line : verdict::MotionText(motion)) fmt::print("{}\n", line);
  json["held_out_motion"] = verdict::ToJson(motion);
  json["held_out_text"] = verdict::MotionText(motion);
}

// kOk, or kPartial where the method says that it did not converge. Throws io::InputError: unknown method, or a log that
// lacks what the method needs.
int RunMethod(const MethodOptions& o) {
  const calibration::Method& method = calibration::FindMethod(o.method);
  const codegen::Model model = LoadModel(o.robot);
  const LogReader read(model, o.format, o.cutoff_Hz);
  const std::vector<calibration::Dataset> train = read.All(o.train);
  calibration::Problem problem = calibration::MakeProblem(model, calibration::Pointers(train));
  if (method.needs_loop) problem.closed_loop = Loop(model, train);
  const std::string ranges =
      method.needs_ranges && !model.robot().has_prior ? RangesFromLeastSquares(problem) : std::string();
  if (!ranges.empty()) fmt::print("{}\n", ranges);
  calibration::Solution s = calibration::Solve(method, problem);
  // Once more with the noise that the first fit shows. A search takes too long for that.
  if (!method.needs_ranges && s.z.allFinite()) {
    problem.sigma_Nm = calibration::ResidualNoise(problem, s.z);
    problem.intervals = true;
    s = calibration::Solve(method, problem);
  }
  nlohmann::ordered_json json{
      {"robot", model.robot().name}, {"train", calibration::Sources(train)}, {"method", method.name}};
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
    verdict::PrintError(e, model.robot(), "held out: " + o.test);
    json["test"] = o.test;
    json["held_out"] = verdict::ToJson(e);
    const auto logs = calibration::Pointers(train);
    AddMotion(calibration::CompareMotion(model, calibration::WeightedFit(model, logs), logs, test), json);
  }
  WriteJson(o.json, json);
  return s.converged ? kOk : kPartial;
}

// --with, --without: a known payload gives the drives' gains, an unknown one is identified.
struct PayloadOptions {
  std::string robot, payload, payload_out, ros_out, table, json;
  LogFormat format;
  std::vector<std::string> with, without;
  double cutoff_Hz = 0;
  bool asked() const {
    return !with.empty() || !without.empty() || !payload.empty() || !payload_out.empty() || !ros_out.empty();
  }
};

const char* const kName[] = {"m", "cx", "cy", "cz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz"};
const char* const kUnit[] = {"kg", "m", "m", "m", "kg*m^2", "kg*m^2", "kg*m^2", "kg*m^2", "kg*m^2", "kg*m^2"};

void Check(const PayloadOptions& o) {
  if (o.with.empty()) throw io::InputError("--with: expected log(s) of runs with the payload");
  if (o.without.empty())
    throw io::InputError(
        "--without: expected log(s) of runs without the payload; the log that identified the arm will do");
  for (const auto& [option, given] : {std::pair{"--payload-out", &o.payload_out}, std::pair{"--ros-out", &o.ros_out}})
    if (!o.payload.empty() && !given->empty())
      throw io::InputError(std::string(option) + ": expected no --payload; what is known is not identified");
  if (o.payload.empty() && !o.table.empty())
    throw io::InputError("--table-out: expected --payload FILE; a load at the flange has no place in a table");
}

// A table that a drive would refuse is written all the same: a robot file with other ceilings may be what is wrong.
void SaveTable(const std::string& path, const codegen::Model& model, const calibration::TableFile& table) {
  calibration::WriteTable(path, table);
  fmt::print("written: {}\n", path);
  if (const std::string beyond = calibration::BeyondCeiling(model, table); !beyond.empty())
    fmt::print(stderr, "armcal: {}: a drive would refuse this table: {}\n", path, beyond);
}

void PrintHeld(const analysis::IdentifiedBodies& read) {
  for (const std::string& sentence : read.held) fmt::print("{}\n", sentence);
}

// The declared model fitted to the runs without payload in true torque; the gains become the table's torque scales.
void WriteTable(const PayloadOptions& o, const codegen::Model& model, std::vector<calibration::Dataset> without,
                const std::vector<DriveGain>& gains) {
  if (!model.robot().has_prior)
    throw io::InputError(o.robot + ": prior = \"none\": a table needs standard parameters, and those need a prior");
  codegen::Robot exact = model.robot();
  std::vector<double> scale(gains.size(), 1);
  for (std::size_t j = 0; j < gains.size(); ++j) {
    if (!gains[j].determined) continue;
    scale[j] = gains[j].value;
    exact.joint[j].motor.torque_constant_tolerance = 0;  // known by experiment: no unknown of the fit
    for (calibration::Dataset& d : without) d.tau.col(static_cast<Eigen::Index>(j)) *= scale[j];
  }
  const codegen::Model known(exact, LoadCatalogue());
  const calibration::Fit all = calibration::WeightedFit(known, calibration::Pointers(without));
  const calibration::Fit held =
      calibration::WeightedFit(known, calibration::Pointers(without), calibration::HardlyDetermined(known, all));
  const analysis::IdentifiedBodies read = analysis::ReadBodies(known, all, held, without);
  PrintHeld(read);
  calibration::TableFile table = read.table;
  for (std::size_t j = 0; j < scale.size(); ++j) table.joint[j].torque_scale *= scale[j];
  SaveTable(o.table, model, table);
}

int RunGains(const PayloadOptions& o, const codegen::Model& model, const LogReader& read) {
  const codegen::Payload known = codegen::ReadPayload(std::filesystem::path(o.payload));
  const std::vector<calibration::Dataset> with = read.All(o.with), without = read.All(o.without);
  const auto gains =
      calibration::FindDriveGains(model, {calibration::Pointers(without), calibration::Pointers(with)}, known);
  nlohmann::ordered_json json{{"robot", model.robot().name}, {"with", o.with}, {"without", o.without}};
  json["payload_kg"] = known.mass_kg;
  report::Table t{{"joint", "gain", "sd", "stated N m/A", "true N m/A", ""}, {}};
  bool all = true;
  for (std::size_t j = 0; j < gains.size(); ++j) {
    const DriveGain& g = gains[j];
    const codegen::Joint& joint = model.robot().joint[j];
    all = all && g.determined;
    nlohmann::ordered_json row{{"joint", j + 1}, {"gain", g.value}, {"sd", g.sd}, {"determined", g.determined}};
    std::vector<std::string> cells{std::to_string(j + 1),
                                   fmt::format("{:.4f}", g.value),
                                   fmt::format("{:.2g}", g.sd),
                                   "-",
                                   "-",
                                   g.determined ? "" : "not determined by these logs"};
    if (joint.has_motor) {
      row["torque_constant_NmpA"] = g.value * joint.motor.torque_constant_NmpA;
      cells[3] = fmt::format("{:.5g}", joint.motor.torque_constant_NmpA);
      cells[4] = fmt::format("{:.5g}", g.value * joint.motor.torque_constant_NmpA);
    }
    json["gains"].push_back(row);
    t.rows.push_back(cells);
  }
  t.caption = fmt::format("true torque = gain x measured torque, by a payload of {:g} kg", known.mass_kg);
  fmt::print("{}", report::Text(t));
  if (!o.table.empty()) WriteTable(o, model, without, gains);
  WriteJson(o.json, json);
  return all ? kOk : kPartial;
}

std::string Snippet(const calibration::Load& load) {
  const auto list = [](const auto& v) {
    std::string text;
    for (Eigen::Index k = 0; k < v.size(); ++k) text += fmt::format("{}{:.6g}", k ? ", " : "", v[k]);
    return "[" + text + "]";
  };
  return fmt::format(
      "# Flange axes (tool_frame); inertia about the centre: xx xy xz yy yz zz. At the end of a robot file the last "
      "link\n"
      "# carries it; armcal identify --payload takes it as known.\n[payload]\nmass_kg = {:.6g}  # +- {:.2g}\n"
      "center_m = {}\ninertia_kgm2 = {}\n",
      load.body[0], load.sd[0], list(load.body.segment(1, 3)), list(load.body.segment(4, 6)));
}

// The fields of geometry_msgs/msg/Inertia, which payload services take.
nlohmann::ordered_json RosInertia(const calibration::Load& load) {
  const auto& b = load.body;
  return {{"m", b[0]},   {"com", {{"x", b[1]}, {"y", b[2]}, {"z", b[3]}}},
          {"ixx", b[4]}, {"ixy", b[5]},
          {"ixz", b[6]}, {"iyy", b[7]},
          {"iyz", b[8]}, {"izz", b[9]}};
}

int RunLoad(const PayloadOptions& o, const codegen::Model& model, const LogReader& read) {
  const std::vector<calibration::Dataset> with = read.All(o.with), without = read.All(o.without);
  const calibration::Load load =
      calibration::FindLoad(model, {calibration::Pointers(without), calibration::Pointers(with)});
  nlohmann::ordered_json json{{"robot", model.robot().name}, {"with", o.with}, {"without", o.without}};
  report::Table t{{"load", "unit", "value", "sd", "95 % interval", ""}, {}, "flange axes, inertia about the centre"};
  for (int i = 0; i < load.body.size(); ++i) {
    const bool determined = load.determined[static_cast<std::size_t>(i)];
    const double low = load.body[i] - load.HalfWidth95(i), high = load.body[i] + load.HalfWidth95(i);
    t.rows.push_back({kName[i], kUnit[i], fmt::format("{:.5g}", load.body[i]), fmt::format("{:.2g}", load.sd[i]),
                      fmt::format("{:.4g} .. {:.4g}", low, high), determined ? "" : "not determined by these logs"});
    json["load"].push_back({{"name", kName[i]},
                            {"unit", kUnit[i]},
                            {"value", load.body[i]},
                            {"sd", load.sd[i]},
                            {"interval_95", {low, high}},
                            {"determined", determined}});
  }
  json["geometry_msgs/msg/Inertia"] = RosInertia(load);
  json["least_squares_physical"] = load.was_physical;
  fmt::print("{}", report::Text(t));
  if (!load.was_physical) fmt::print("least squares alone gave no body that can exist; this one can\n");
  if (!o.payload_out.empty()) {
    files::WriteWholeFile(o.payload_out, Snippet(load));
    fmt::print("written: {}\n", o.payload_out);
  }
  if (!o.ros_out.empty()) {
    files::WriteWholeFile(o.ros_out, io::JsonText(RosInertia(load)) + "\n");
    fmt::print("written: {}\n", o.ros_out);
  }
  WriteJson(o.json, json);
  return kOk;
}

void AddPayloadOptions(CLI::App& verb, PayloadOptions& o) {
  verb.add_option("--with", o.with, "log(s) of runs with a payload at the flange; with --without, instead of --train");
  verb.add_option("--without", o.without, "log(s) of runs without it, any trajectory");
  verb.add_option("--payload", o.payload,
                  "file with a [payload] table (mass_kg; center_m, inertia_kgm2 if known): find the drives' gains; "
                  "without this option the payload itself is found");
  verb.add_option("--payload-out", o.payload_out, "the [payload] table found, to append to a robot file");
  verb.add_option("--ros-out", o.ros_out, "the payload found as geometry_msgs/msg/Inertia, for a ROS payload service");
}

// kOk, or kPartial where the logs do not determine every gain. Throws io::InputError: an option is missing or in vain,
// no load is seen, or a log cannot be one of this arm.
int RunPayload(const PayloadOptions& o) {
  Check(o);
  const codegen::Model model = LoadModel(o.robot);
  const LogReader read(model, o.format, o.cutoff_Hz);
  return o.payload.empty() ? RunLoad(o, model, read) : RunGains(o, model, read);
}

// Else: the weighted fit with the prior.
struct IdentifyOptions {
  std::string robot, table, json, report, test, method;
  LogFormat format;
  std::vector<std::string> train;
  bool force = false;
  double band_Hz = 0, cutoff_Hz = 0;
  PayloadOptions payload;
};

std::string Significant(double v) { return fmt::format("{:.5g}", v); }

// What the data tell; what the prior tells is named below the table, and --json has its values.
void PrintColumns(const codegen::Model& model, const calibration::Fit& fit) {
  report::Table t{{"parameter", "unit", "value", "sd", "posterior / prior"}, {}};
  std::vector<std::string> from_prior;
  for (const int c : fit.active) {
    if (c >= model.columns()) continue;
    const double ratio = fit.ratio(c);
    if (ratio > calibration::kFromPrior) {
      from_prior.push_back(model.column_name(c));
      continue;
    }
    t.rows.push_back(
        {model.column_name(c), verdict::ColumnUnit(model.robot(), model.column_name(c), model.column_unit(c)),
         Significant(fit.x[c]), Significant(fit.sd[c]), model.robot().has_prior ? fmt::format("{:.3f}", ratio) : "-"});
  }
  if (!t.rows.empty()) fmt::print("{}", report::Text(t));
  if (!from_prior.empty())
    fmt::print("{} parameters rest mostly on the prior (posterior / prior above {}): {}\n", from_prior.size(),
               calibration::kFromPrior, fmt::join(from_prior, ", "));
}

int RunIdentify(const IdentifyOptions& o) {
  if (o.payload.asked()) {
    if (!o.train.empty() || !o.test.empty() || !o.method.empty() || o.force || o.band_Hz > 0)
      throw io::InputError("--with, --without: expected no --train, --test, --method, --force or --band beside them");
    if (!o.report.empty())
      throw io::InputError("--report: expected no --with or --without; a page shows a fit of --train");
    PayloadOptions payload = o.payload;
    payload.robot = o.robot, payload.format = o.format, payload.table = o.table, payload.json = o.json;
    payload.cutoff_Hz = o.cutoff_Hz;
    return RunPayload(payload);
  }
  if (o.train.empty()) throw io::InputError("--train: expected log(s) to fit");
  if (!o.method.empty() && !o.report.empty())
    throw io::InputError("--report: expected no --method; a page shows the weighted fit");
  if (!o.method.empty() && o.force) throw io::InputError("--force: expected no --method; it is about the weighted fit");
  if (!o.method.empty() && !o.table.empty())
    throw io::InputError("--table-out: expected no --method; a table comes from the weighted fit");
  MethodOptions method{o.robot, o.method, o.test, o.json, o.format, o.train, o.band_Hz, o.cutoff_Hz, {}};
  if (!o.method.empty() && o.method != "auto") return RunMethod(method);
  const codegen::Model model = LoadModel(o.robot);
  const LogReader read(model, o.format, o.cutoff_Hz);
  std::optional<Watched> line(std::in_place, "identify");
  const auto say = [&line](const std::string& text) { line->Clear(), SayAside(text); };
  const std::vector<calibration::Dataset> train = read.All(o.train, say);
  io::SetDone(0.3);
  const std::vector<std::string> untold = analysis::Untold(model, train);
  analysis::Identified found(model, train);
  io::SetDone(0.6);
  line->Clear();
  for (const std::string& text : untold) fmt::print("{}\n", text);
  PrintColumns(model, found.all);
  const calibration::Exogeneity& exogeneity = found.exogeneity;
  fmt::print("{}", verdict::ExogeneityText(exogeneity, analysis::kLacksTerm));
  if (o.method == "auto" && !exogeneity.passed() && exogeneity.instruments == calibration::kSimulatedLoop) {
    method.method = "instrumental_variable", method.exogeneity = verdict::ToJson(exogeneity);
    line.reset();
    return RunMethod(method);
  }
  if (model.robot().has_prior) {
    found.ReadOut(train, o.force);
    io::SetDone(0.8);
    line->Clear();
    fmt::print(
        "standard parameters: {} of {} rest mostly on the prior (posterior / prior sd above {}); bodies physical: {}\n",
        found.read.FromPrior(), found.read.table.row.size(), calibration::kFromPrior,
        calibration::IsPhysical(found.read.bodies.bodies) ? "yes" : "no");
    PrintHeld(found.read);
    if (!o.table.empty()) SaveTable(o.table, model, found.read.table);
  } else if (!o.table.empty()) {
    throw io::InputError(o.robot + ": prior = \"none\": a table needs standard parameters, and those need a prior");
  }
  nlohmann::ordered_json json{{"robot", model.robot().name}, {"train", calibration::Sources(train)}};
  json.update(found.ToJson());
  if (!o.table.empty()) json["table_file"] = o.table;
  if (!o.test.empty()) {
    const calibration::Dataset test = read.One(o.test, say);
    const analysis::Identified::OnLog held_out = found.Compare(test, true, o.band_Hz);
    const calibration::HeldOutMotion motion =
        calibration::CompareMotion(model, found.all, calibration::Pointers(train), test);
    line.reset();
    verdict::PrintError(held_out.error, model.robot(), "held out: " + o.test);
    json["test"] = o.test;
    json.update(held_out.json);
    AddMotion(motion, json);
  } else {
    json.update(found.Compare(train[0], false, o.band_Hz).json);
    line.reset();
  }
  WriteJson(o.json, json);
  if (!o.report.empty()) {
    verdict::WriteIdentificationPage(o.report, json);
    fmt::print("report: {}\n", o.report);
  }
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
  AddLogFormat(*verb, o->format);
  verb->add_option(
      "--method", o->method,
      "another method than the weighted fit with prior: a name of the survey's, see docs; auto: instrumental "
      "variables where the regressors are not free of the torque's error and the control law is known");
  verb->add_option("--table-out", o->table, "parameter table to write");
  AddBand(*verb, o->band_Hz);
  AddCutoff(*verb, o->cutoff_Hz);
  verb->add_flag("--force", o->force, "let parameters move that the data hardly determine");
  verb->add_option("--json", o->json, "write everything here");
  verb->add_option("--report", o->report, "write a self-contained page here; of the weighted fit");
  AddPayloadOptions(*verb, o->payload);
  verb->callback([o, &action] { action = [o] { return RunIdentify(*o); }; });
}

}  // namespace armcal::tool
