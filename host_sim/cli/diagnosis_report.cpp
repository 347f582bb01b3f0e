// cli - a diagnosis as JSON and as lines for the terminal.
#include "host_sim/cli/diagnosis_report.hpp"

#include <fmt/core.h>

#include "host_sim/cli/diagnosis_words.hpp"
#include "host_sim/cli/logs.hpp"

namespace armcal::cli {

using diagnosis::Term;

namespace {

std::vector<std::string> Signals(const Term& t) {
  std::vector<std::string> out;
  const std::string joint = t.joints.empty() ? "" : std::to_string(t.joints[0] + 1);
  for (std::string s : t.record->signals) {
    if (s == "t") out.push_back("time");
    else if (s.ends_with("[k]")) out.push_back(s.substr(0, s.size() - 3) + std::to_string(t.joints.at(1) + 1));
    else if (s.back() == ')') out.push_back(s.insert(s.size() - 1, joint));
    else out.push_back(s == "tau_rigid" ? "load" + joint : s + joint);
  }
  return out;
}

}  // namespace

nlohmann::ordered_json DiagnosisJson(const DiagnosisView& v) {
  const auto& f = *v.finding;
  nlohmann::ordered_json j;
  j["verdict"] = AnyConfirmed(f) ? "effect" : "none";
  j["joint_base"] = 1;
  j["terms"] = nlohmann::ordered_json::array();
  for (std::size_t k = 0; k < f.terms.size(); ++k) {
    const Term& t = f.terms[k];
    nlohmann::ordered_json term{{"kind", t.record->kind}, {"record", t.record->name}};
    if (t.joints.size() == 1 || IsUnknown(t)) term["joint"] = t.joints[0] + 1;
    else term["joint"] = JointName(t);
    term["signals"] = Signals(t);
    nlohmann::ordered_json parameters, deviations;
    for (std::size_t u = 0; u < t.eta.size(); ++u) {
      parameters[t.unknowns[u].name] = t.eta[u];
      if (t.eta_sd[static_cast<Eigen::Index>(u)] > 0)
        deviations[t.unknowns[u].name] = t.eta_sd[static_cast<Eigen::Index>(u)];
    }
    for (std::size_t c = 0; c < t.columns.size(); ++c)
      parameters[t.columns[c].name] = t.amplitude[c], deviations[t.columns[c].name] = t.sd[c];
    term["parameters"] = parameters;
    term["parameter_sd"] = deviations;
    term["also_fits"] = t.also_fits;
    term["confirmed"] = t.confirmed;
    term["score"] = t.score;
    term["folds"] = ToList(t.folds);
    term["runner_up"] = t.rivals.empty() ? "" : RivalName(t.rivals[0]);
    term["runner_up_score"] = t.rivals.empty() ? 0 : t.rivals[0].score;
    term["separate"] = nlohmann::ordered_json::array();
    for (const Separation& s : v.separation[k])
      term["separate"].push_back({{"from", s.from}, {"how", s.how}, {"command", s.command}});
    term["training_only"] = t.training_only;
    term["in_model"] = t.confirmed && t.record->on_target;
    if (!t.record->on_target) term["remedy"] = t.record->remedy;
    j["terms"].push_back(term);
  }
  const auto& test = *v.test;
  j["before"] = ToList(calibration::Rms(test, v.held_out->before, false));
  j["after"] = ToList(calibration::Rms(test, v.held_out->after, false));
  j["before_moving"] = ToList(calibration::Rms(test, v.held_out->before, true));
  j["after_moving"] = ToList(calibration::Rms(test, v.held_out->after, true));
  std::vector<double> share;
  for (int k = 0; k < test.joints(); ++k) share.push_back(test.moving.col(k).cast<double>().mean());
  j["moving_share"] = share;
  j["noise_floor"] = ToList(f.sigma);
  j["noise_innovation"] = ToList(f.innovation);
  j["smallest_detectable"] = ToList(f.smallest);
  if (!v.held_out->tracking.empty()) j["tracking"] = v.held_out->tracking;
  j["seconds"] = v.seconds;
  return j;
}

std::string DiagnosisText(const DiagnosisView& v) {
  std::string out = "verdict: " + Headline(*v.finding) + "\n";
  for (std::size_t k = 0; k < v.finding->terms.size(); ++k) {
    const Term& t = v.finding->terms[k];
    out += fmt::format("  {}, joint {}{}: {}\n", t.record->kind, JointName(t), Remark(t), t.record->title);
    if (t.confirmed) out += fmt::format("    {}\n", Parameters(t));
    out += fmt::format("    score {}; {}\n", ScoreText(t), FoldText(t));
    out += fmt::format("    runner-up: {}; fits equally: {}\n", RunnerUp(t), AlsoFits(t));
    for (const Separation& s : v.separation[k]) {
      out += fmt::format("    to tell it from {}: {}\n", s.from, s.how);
      out += fmt::format("      {}\n", s.command.empty() ? kNoMotion : s.command);
    }
    if (t.confirmed && !t.record->on_target) out += fmt::format("    {}\n", t.record->remedy);
  }
  return out;
}

}  // namespace armcal::cli
