// tool - puts the closed loop's figures before a person: one table, one sentence, the pictures.
#include "host_sim/tool/demo_report.hpp"

#include <fmt/core.h>
#include <cmath>
#include <cstring>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/files/files.hpp"
#include "host_sim/data/report/axis.hpp"

namespace armcal::tool {

using Eigen::VectorXd;

VectorXd PlantFloor(const std::string& truth, const calibration::Dataset& log, std::uint32_t first_tick,
                    int decimation) {
  const int n = log.joints();
  const std::string bytes = files::ReadWholeFile(truth);
  const std::size_t record = 4 + 8 * static_cast<std::size_t>(n);
  // ticks of one motion follow each other; find the log's first one
  std::size_t at = 0;
  const auto tick_at = [&](std::size_t k) {
    std::uint32_t tick = 0;
    std::memcpy(&tick, bytes.data() + k * record, 4);
    return tick;
  };
  const std::size_t count = bytes.size() / record;
  while (at < count && tick_at(at) != first_tick) ++at;
  const auto needed = static_cast<std::size_t>(log.samples()) * static_cast<std::size_t>(decimation);
  if (at + needed > count || tick_at(at + needed - 1) != first_tick + needed - 1)
    throw io::InputError(truth + ": does not hold the recorded motion");
  Eigen::MatrixXd residual(log.samples(), n);
  for (int k = 0; k < log.samples(); ++k) {
    VectorXd mean = VectorXd::Zero(n);
    for (int i = 0; i < decimation; ++i) {
      VectorXd tau(n);
      std::memcpy(tau.data(), bytes.data() + (at + static_cast<std::size_t>(k) * decimation + i) * record + 4,
                  8 * static_cast<std::size_t>(n));
      mean += tau / decimation;
    }
    residual.row(k) = log.tau.row(k) - mean.transpose();
  }
  return calibration::Rms(log, residual, true);
}

namespace {

std::string Cell(const nlohmann::ordered_json& r, const char* key, int j, double factor = 1) {
  return r.contains(key) ? report::Number(factor * r[key][j].get<double>()) : "-";
}

report::Table ErrorTable(const nlohmann::ordered_json& r) {
  report::Table t{{"joint", "held-out log before", "after", "floor of the plant", "on the drive: CAD table",
                   "identified", "with the effect"},
                  {},
                  "RMS of measured minus model torque where the joint moves, N m"};
  for (int j = 0; j < static_cast<int>(r["before"].size()); ++j)
    t.rows.push_back({std::to_string(j + 1), Cell(r, "before_moving", j), Cell(r, "after_moving", j),
                      Cell(r, "plant_floor", j), Cell(r, "drive_cad", j), Cell(r, "drive_before", j),
                      Cell(r, "drive_after", j)});
  return t;
}

report::Table TrackingTable(const nlohmann::ordered_json& r) {
  report::Table t{
      {"joint", "CAD table", "identified", "with the effect"}, {}, "tracking error rms of the held-out motion, mrad"};
  for (int j = 0; j < static_cast<int>(r["before"].size()); ++j)
    t.rows.push_back({std::to_string(j + 1), Cell(r, "tracking_cad_rad", j, 1e3),
                      Cell(r, "tracking_before_rad", j, 1e3), Cell(r, "tracking_after_rad", j, 1e3)});
  return t;
}

std::string Joint(const nlohmann::ordered_json& joint) {
  return joint.is_string() ? joint.get<std::string>() : joint.dump();
}

std::string Truth(const nlohmann::ordered_json& r) {
  std::string out;
  for (const auto& u : r["undeclared"])
    out += fmt::format("{}{} on joint {}", out.empty() ? "" : ", ", u["kind"].get<std::string>(), Joint(u["joint"]));
  return out.empty() ? "nothing" : out;
}

std::string Verdict(const nlohmann::ordered_json& r) {
  std::string out;
  for (const auto& t : r["terms"]) {
    out += fmt::format("{}{} on joint {}", out.empty() ? "" : ", ", t["kind"].get<std::string>(), Joint(t["joint"]));
    if (!t["also_fits"].empty()) out += fmt::format(" (or {})", t["also_fits"][0].get<std::string>());
    if (!t["confirmed"].get<bool>()) out += " (not confirmed)";
  }
  return out.empty() ? "nothing is missing" : out;
}

}  // namespace

std::string DemoText(const nlohmann::ordered_json& r) {
  std::string out = fmt::format(
      "\nfound by armcal:    {}\nin the simulation:  {}  (read after the verdict was written)\n", Verdict(r), Truth(r));
  out += fmt::format("brought to the drive: {}; table CRC {}, read back {}\n\n", r["path"].get<std::string>(),
                     r["table_crc"].get<std::string>(), r["readback_ok"].get<bool>() ? "equal" : "DIFFERENT");
  out += report::Text(ErrorTable(r)) + "\n" + report::Text(TrackingTable(r));
  return out;
}

void WriteDemoPage(const std::string& path, const nlohmann::ordered_json& r, const verdict::DiagnosisView& view) {
  report::Page page("The loop, closed: " + r["title"].get<std::string>(),
                    "A simulated six-axis drive whose arm has an effect that its model does not declare: measured, "
                    "found, added, flashed, measured again.");
  page.Box(report::Tone::kGood, "armcal found: " + Verdict(r),
           "In the simulation there was: " + Truth(r) +
               ". No program but the drive read that before the verdict was written.");
  page.Section("Error before and after");
  page.Add(ErrorTable(r));
  report::Bars bars;
  bars.text.title = "on the drive, held-out motion: torque error over the floor of the plant";
  bars.text.x_label = "joint";
  bars.text.y_label = "times the floor";
  bars.series = {"CAD table", "identified", "with the effect"};
  bars.value.resize(bars.series.size());
  const char* const keys[] = {"drive_cad", "drive_before", "drive_after"};
  for (int j = 0; j < static_cast<int>(r["before"].size()); ++j) {
    bars.categories.push_back(std::to_string(j + 1));
    for (int k = 0; k < 3; ++k)
      bars.value[k].push_back(r[keys[k]][j].get<double>() / r["plant_floor"][j].get<double>());
  }
  page.Add(bars,
           "Measured torque minus the committed model's torque at the measured state, computed on the drive and read "
           "through its trace. The floor is what a perfect model leaves: sensor noise.");
  page.Add(TrackingTable(r));
  page.Text("How it came to the drive: " + r["path"].get<std::string>() + ".");
  verdict::AddDiagnosis(page, view);
  page.Section("Stages");
  std::vector<std::string> stages;
  for (const auto& s : r["stages"]) stages.push_back(s);
  page.List(stages);
  page.Write(path);
}

}  // namespace armcal::tool
