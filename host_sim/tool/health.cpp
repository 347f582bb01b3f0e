// tool - armcal health: reads the residual statistics of a drive, and says which joint no longer fits its model.
#include <fmt/core.h>
#include <fmt/ranges.h>

#include "host_sim/client/residual_reader.hpp"
#include "host_sim/data/report/colour.hpp"
#include "host_sim/diagnose/health/joint_health.hpp"
#include "host_sim/diagnose/health/shapes.hpp"
#include "host_sim/tool/connect.hpp"
#include "host_sim/tool/fleet.hpp"
#include "host_sim/tool/verb.hpp"

namespace armcal::tool {
namespace {

using health::JointHealth;
using nlohmann::ordered_json;

struct HealthOptions {
  std::string connect, json;
  FleetOptions fleet;
};

const char* VerdictText(health::Verdict v) {
  switch (v) {
    case health::Verdict::kFits:
      return "fits";
    case health::Verdict::kNoLongerFits:
      return "no longer fits";
    case health::Verdict::kNeverFitted:
      return "has not fitted since the table was adopted";
    case health::Verdict::kTooEarly:
      break;
  }
  return "has moved too little to tell";
}

// "40.2 min (38.1 to 43.5)": three times in the unit that suits the first.
std::string Ago(double s, double least_s, double most_s) {
  const auto [unit_s, unit] = s < 120         ? std::pair{1.0, "s"}
                              : s < 7200      ? std::pair{60.0, "min"}
                              : s < 2 * 86400 ? std::pair{3600.0, "h"}
                                              : std::pair{86400.0, "days"};
  return fmt::format("{:.1f} {} ({:.1f} to {:.1f})", s / unit_s, unit, least_s / unit_s, most_s / unit_s);
}

std::string TermText(const health::Term& t) {
  const health::Shape& shape = health::ShapeOf(t.shape);
  std::string text = shape.name;
  for (const int k : t.also) text += std::string(" or ") + health::ShapeOf(k).name;
  const std::string unit = shape.unit == std::string("1") ? "" : std::string(" ") + shape.unit;
  return text + fmt::format(" ({:+.3g} +- {:.1g}{})", t.value, t.sd, unit);
}

std::string Sentence(const JointHealth& h) {
  std::string verdict = VerdictText(h.verdict);
  if (h.verdict == health::Verdict::kFits) verdict = report::Coloured(verdict, report::Ink::kGreen);
  else if (h.verdict != health::Verdict::kTooEarly) verdict = report::Coloured(verdict, report::Ink::kYellow);
  std::string text = fmt::format("joint {} {}", h.joint, verdict);
  if (h.verdict == health::Verdict::kTooEarly)
    return text + fmt::format(": {:.0f} samples in motion since the table was adopted, an answer needs {:.0f} more",
                              h.rows, h.missing_rows);
  if (h.verdict != health::Verdict::kFits) {
    text += h.looks_like.terms.empty() ? ": can't tell what it is" : ": looks like ";
    for (std::size_t i = 0; i < h.looks_like.terms.size(); ++i)
      text += (i > 0 ? ", and " : "") + TermText(h.looks_like.terms[i]);
  }
  if (h.onset)
    text += ", for about " +
            Ago(h.elapsed_s - h.onset->at_s, h.elapsed_s - h.onset->latest_s, h.elapsed_s - h.onset->earliest_s);
  return text + fmt::format("; residual {:.3g} N*m, at the adoption {:.3g}, torque noise {:.3g}", h.rms_now_Nm,
                            h.rms_then_Nm, h.sigma_Nm);
}

ordered_json TermJson(const health::Term& t) {
  const health::Shape& shape = health::ShapeOf(t.shape);
  std::vector<std::string> also;
  for (const int k : t.also) also.push_back(health::ShapeOf(k).name);
  return {{"name", shape.name}, {"kind", shape.kind}, {"parameter", shape.parameter}, {"unit", shape.unit},
          {"change", t.value},  {"sd", t.sd},         {"rms_Nm", t.rms_Nm},           {"also_fits", also}};
}

ordered_json JointJson(const JointHealth& h) {
  static const char* const words[] = {"fits", "no_longer_fits", "never_fitted", "too_early"};
  ordered_json j{{"joint", h.joint},
                 {"verdict", words[static_cast<int>(h.verdict)]},
                 {"looks_like", ordered_json::array()},
                 {"explained_share", h.looks_like.share},
                 {"since_s", nullptr},
                 {"residual_Nm", h.rms_now_Nm},
                 {"residual_at_adoption_Nm", h.rms_then_Nm},
                 {"torque_noise_Nm", h.sigma_Nm},
                 {"rows", h.rows},
                 {"missing_rows", h.missing_rows}};
  for (const health::Term& t : h.looks_like.terms) j["looks_like"].push_back(TermJson(t));
  if (h.onset) {
    j["since_s"] = h.elapsed_s - h.onset->at_s;
    j["since_between_s"] = {h.elapsed_s - h.onset->latest_s, h.elapsed_s - h.onset->earliest_s};
  }
  return j;
}

int RunHealth(const HealthOptions& o, ordered_json& said) {
  TryFleet(o.fleet);
  client::DriveClient drive = ConnectTo(o.connect);
  ordered_json json{{"verdict", ""}, {"elapsed_s", 0}, {"joints", ordered_json::array()}};
  bool misfit = false, early = false, unnamed = false;
  std::vector<JointHealth> joints;
  for (int joint = 1; joint <= drive.ReadIdentity().axes; ++joint) {
    const JointHealth& h = joints.emplace_back(health::Judge(client::ReadResiduals(drive, joint)));
    fmt::print("{}\n", Sentence(h));
    const bool bad = h.verdict == health::Verdict::kNoLongerFits || h.verdict == health::Verdict::kNeverFitted;
    misfit = misfit || bad;
    unnamed = unnamed || (bad && h.looks_like.terms.empty());
    early = early || h.verdict == health::Verdict::kTooEarly;
    json["elapsed_s"] = h.elapsed_s;
    json["joints"].push_back(JointJson(h));
  }
  const std::vector<int> together = health::ChangedTogether(joints);
  if (!together.empty())
    fmt::print("joints {} changed at the same time: another payload, or the base was moved?\n",
               fmt::join(together, ", "));
  if (unnamed)
    fmt::print(
        "a joint has changed, or it moves in another way and its model lacks something; take a log: armcal record ..., "
        "then armcal diagnose ...\n");
  json["changed_together"] = together;
  json["verdict"] = misfit ? "misfit" : early ? "too_early" : "fits";
  said = json;
  WriteJson(o.json, json);
  KeepHealth(o.fleet, drive, json);
  return misfit ? kMismatch : early ? kPartial : kOk;
}

}  // namespace

void AddHealth(CLI::App& app, Action& action) {
  auto* verb = app.add_subcommand(
      "health",
      "does each joint still fit the table in force? From the drive's own statistics, without a log\n"
      "exit code 0: all fit, 5: a joint does not, 6: too early to tell\n"
      "example: armcal health --connect 192.168.0.10:502");
  auto o = std::make_shared<HealthOptions>();
  verb->add_option("--connect", o->connect, kConnectHelp)->required();
  verb->add_option("--json", o->json, "write the verdicts here");
  AddDriveFleetOptions(*verb, o->fleet, "the verdicts");
  verb->callback([o, &action] { action = Telling(o, &RunHealth); });
}

}  // namespace armcal::tool
