// tool - armcal identify --with --without: a known payload gives the drives' gains, an unknown one is identified.
#include "host_sim/tool/identify_payload.hpp"

#include <fmt/core.h>
#include <cmath>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/files/files.hpp"
#include "host_sim/data/report/table.hpp"
#include "host_sim/identify/calibration/payload.hpp"
#include "host_sim/identify/calibration/table_file.hpp"
#include "host_sim/tool/logs.hpp"

namespace armcal::tool {
namespace {

using calibration::DriveGain;

const char* const kName[] = {"m", "cx", "cy", "cz", "Ixx", "Ixy", "Ixz", "Iyy", "Iyz", "Izz"};
const char* const kUnit[] = {"kg", "m", "m", "m", "kg*m^2", "kg*m^2", "kg*m^2", "kg*m^2", "kg*m^2", "kg*m^2"};

void Check(const PayloadOptions& o) {
  if (o.with.empty()) throw io::InputError("--with: expected log(s) of runs with the payload");
  if (o.without.empty()) throw io::InputError("--without: expected log(s) of runs without the payload");
  if (!o.payload.empty() && !o.payload_out.empty())
    throw io::InputError("--payload-out: expected no --payload; what is known is not identified");
  if (o.payload.empty() && !o.table.empty())
    throw io::InputError("--table-out: expected --payload FILE; a load at the flange has no place in a table");
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
  calibration::TableFile table = calibration::IdentifiedTable(
      known, all, held, calibration::ReadOutPhysical(known, held), without[0].s.t[1] - without[0].s.t[0]);
  for (std::size_t j = 0; j < scale.size(); ++j) table.joint[j].torque_scale *= scale[j];
  calibration::WriteTable(o.table, table);
  fmt::print("written: {}\n", o.table);
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

int RunLoad(const PayloadOptions& o, const codegen::Model& model, const LogReader& read) {
  const std::vector<calibration::Dataset> with = read.All(o.with), without = read.All(o.without);
  const calibration::Load load =
      calibration::FindLoad(model, {calibration::Pointers(without), calibration::Pointers(with)});
  nlohmann::ordered_json json{{"robot", model.robot().name}, {"with", o.with}, {"without", o.without}};
  report::Table t{{"load", "unit", "value", "sd", ""}, {}, "flange axes, inertia about the centre"};
  for (int i = 0; i < load.body.size(); ++i) {
    const bool determined = load.determined[static_cast<std::size_t>(i)];
    t.rows.push_back({kName[i], kUnit[i], fmt::format("{:.5g}", load.body[i]), fmt::format("{:.2g}", load.sd[i]),
                      determined ? "" : "not determined by these logs"});
    json["load"].push_back({{"name", kName[i]},
                            {"unit", kUnit[i]},
                            {"value", load.body[i]},
                            {"sd", load.sd[i]},
                            {"determined", determined}});
  }
  json["least_squares_physical"] = load.was_physical;
  fmt::print("{}", report::Text(t));
  if (!load.was_physical) fmt::print("least squares alone gave no body that can exist; this one can\n");
  if (!o.payload_out.empty()) {
    files::WriteWholeFile(o.payload_out, Snippet(load));
    fmt::print("written: {}\n", o.payload_out);
  }
  WriteJson(o.json, json);
  return kOk;
}

}  // namespace

void AddPayloadOptions(CLI::App& verb, PayloadOptions& o) {
  verb.add_option("--with", o.with, "log(s) of runs with a payload at the flange; with --without, instead of --train");
  verb.add_option("--without", o.without, "log(s) of runs without it, any trajectory");
  verb.add_option("--payload", o.payload,
                  "file with a [payload] table (mass_kg; center_m, inertia_kgm2 if known): find the drives' gains; "
                  "without this option the payload itself is found");
  verb.add_option("--payload-out", o.payload_out, "the [payload] table found, to append to a robot file");
}

int RunPayload(const PayloadOptions& o) {
  Check(o);
  const codegen::Model model = LoadModel(o.robot);
  const LogReader read(model, o.channels, o.cutoff_Hz);
  return o.payload.empty() ? RunLoad(o, model, read) : RunGains(o, model, read);
}

}  // namespace armcal::tool
