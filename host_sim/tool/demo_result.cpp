// tool - tells what a demo found: the last screen, and the page.
#include "host_sim/tool/demo_result.hpp"

#include <fmt/format.h>

#include <string>
#include <vector>

#include "host_sim/data/report/axis.hpp"
#include "host_sim/data/report/colour.hpp"
#include "host_sim/diagnose/verdict/diagnosis_page.hpp"
#include "host_sim/diagnose/verdict/verdict_file.hpp"

namespace armcal::tool {

using nlohmann::ordered_json;

namespace {

std::string Cell(const ordered_json& r, const char* key, int j, double factor = 1) {
  return r.contains(key) ? report::Number(factor * r[key].at(j).get<double>()) : "-";
}

report::Table ErrorTable(const ordered_json& r) {
  report::Table t{{"joint", "held-out log before", "after", "floor of the plant", "on the drive: CAD table",
                   "identified", "with the effect", "loop closed"},
                  {},
                  "RMS of measured minus model torque where the joint moves, N m"};
  for (int j = 0; j < static_cast<int>(r.at("before").size()); ++j)
    t.rows.push_back({std::to_string(j + 1), Cell(r, "before_moving", j), Cell(r, "after_moving", j),
                      Cell(r, "plant_floor", j), Cell(r, "drive_cad", j), Cell(r, "drive_before", j),
                      Cell(r, "drive_after", j), r.at("joints").at(j).at("closed").get<bool>() ? "yes" : "no"});
  return t;
}

report::Table TrackingTable(const ordered_json& r) {
  report::Table t{
      {"joint", "CAD table", "identified", "with the effect"}, {}, "tracking error rms of the held-out motion, mrad"};
  for (int j = 0; j < static_cast<int>(r.at("before").size()); ++j)
    t.rows.push_back({std::to_string(j + 1), Cell(r, "tracking_cad_rad", j, 1e3),
                      Cell(r, "tracking_before_rad", j, 1e3), Cell(r, "tracking_after_rad", j, 1e3)});
  return t;
}

std::string Truth(const ordered_json& r) {
  std::string out;
  for (const auto& u : r.at("undeclared"))
    out += fmt::format("{}{} on joint {}", out.empty() ? "" : ", ", u.at("kind").get<std::string>(),
                       verdict::JointText(u.at("joint")));
  return out.empty() ? "nothing" : out;
}

const char* LoopText(const ordered_json& r) {
  return r.at("closed").get<bool>() ? "the loop is closed" : "the loop is NOT closed";
}

// What became of each effect, and which joints stayed open.
std::string Details(const ordered_json& r) {
  std::string out;
  for (const auto& e : r.at("effects"))
    out += fmt::format("; {} on joint {}: {}", e.at("kind").get<std::string>(), verdict::JointText(e.at("joint")),
                       e.at("became").get<std::string>());
  for (const auto& j : r.at("joints"))
    if (!j.at("closed").get<bool>())
      out += fmt::format("; joint {}: error {:.2f} times the floor", j.at("joint").get<int>(),
                         j.at("error_over_floor").get<double>());
  return out;
}

std::string Verdict(const ordered_json& r) {
  std::string out;
  for (const auto& t : r.at("terms")) {
    out += fmt::format("{}{} on joint {}", out.empty() ? "" : ", ", t.at("kind").get<std::string>(),
                       verdict::JointText(t.at("joint")));
    if (!t.at("also_fits").empty()) out += fmt::format(" (or {})", t.at("also_fits")[0].get<std::string>());
    if (!t.at("confirmed").get<bool>()) out += " (not confirmed)";
  }
  return out.empty() ? "nothing is missing" : out;
}

report::Bars DriveBars(const ordered_json& r) {
  report::Bars bars{{"torque error on the drive", "joint", "times the floor of the plant", 520, 320},
                    {},
                    {"CAD table", "identified", "with the effect"},
                    std::vector<std::vector<double>>(3)};
  bars.colours = {6, 1, 0};
  const char* const keys[] = {"drive_cad", "drive_before", "drive_after"};
  for (int j = 0; j < static_cast<int>(r.at("before").size()); ++j) {
    bars.categories.push_back(std::to_string(j + 1));
    for (std::size_t k = 0; k < 3; ++k)
      bars.value[k].push_back(r.at(keys[k]).at(j).get<double>() / r.at("plant_floor").at(j).get<double>());
  }
  return bars;
}

}  // namespace

std::string DemoText(const ordered_json& r) {
  std::string out = fmt::format(
      "\nfound by armcal:    {}\nin the simulation:  {}  (read after the verdict was written)\n", Verdict(r), Truth(r));
  const report::Ink ink = r.at("closed").get<bool>() ? report::Ink::kGreen : report::Ink::kYellow;
  out += fmt::format("outcome:             {}{}\n", report::Coloured(LoopText(r), ink), Details(r));
  out += fmt::format("brought to the drive: {}; table CRC {}, read back {}\n\n", r.at("path").get<std::string>(),
                     r.at("table_crc").get<std::string>(), r.at("readback_ok").get<bool>() ? "equal" : "DIFFERENT");
  out += report::Text(ErrorTable(r)) + "\n" + report::Text(TrackingTable(r));
  return out;
}

void WriteDemoPage(const std::filesystem::path& path, const ordered_json& r) {
  const bool closed = r.at("closed").get<bool>();
  report::Page page((closed ? "The loop, closed: " : "The loop did not close: ") + r.at("title").get<std::string>(),
                    "A simulated six-axis drive whose arm has an effect that its model does not declare: measured, "
                    "found, added, flashed, measured again.");
  page.Columns(
      [&](report::Page& left) {
        left.Box(closed ? report::Tone::kGood : report::Tone::kWarning, "armcal found: " + Verdict(r),
                 LoopText(r) + Details(r) + ". In the simulation there was: " + Truth(r) +
                     ". No program but the drive read that before the verdict was written.");
        left.Text("How it came to the drive: " + r.at("path").get<std::string>() + ".");
      },
      [&](report::Page& right) {
        right.Add(DriveBars(r),
                  "Measured torque minus the committed model's torque at the measured state, computed on the drive and "
                  "read through its trace. The floor is what a perfect model leaves: sensor noise.");
      });
  page.Section("Error before and after");
  page.Add(ErrorTable(r));
  page.Add(TrackingTable(r));
  page.Section("The diagnosis");
  page.Text("What armcal diagnose said before the new model went to the drive.");
  verdict::AddDiagnosis(page, r);
  page.Section("Stages");
  std::vector<std::string> stages;
  for (const auto& s : r.at("stages")) stages.push_back(s);
  page.List(stages);
  page.Write(path);
}

}  // namespace armcal::tool
