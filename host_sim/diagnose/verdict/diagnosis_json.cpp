// verdict - a diagnosis as JSON.
#include "host_sim/diagnose/verdict/diagnosis_words.hpp"
#include "host_sim/diagnose/verdict/figures.hpp"

namespace armcal::verdict {

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

nlohmann::ordered_json RefutedJson(const diagnosis::Refutation& why) {
  nlohmann::ordered_json out;
  if (why.joint < 0) out["joint"] = "all";
  else out["joint"] = why.joint + 1;
  out["without_it"] = why.beside_others ? "the other terms" : "the declared model";
  out["factor"] = why.factor;
  out["rms_with"] = ToList(why.with), out["rms_without"] = ToList(why.without);
  return out;
}

}  // namespace

nlohmann::ordered_json DiagnosisJson(const DiagnosisView& v) {
  const auto& f = *v.finding;
  nlohmann::ordered_json j;
  j["verdict"] = AnyConfirmed(f) ? "effect" : "none";
  j["joint_base"] = 1;
  j["terms"] = nlohmann::ordered_json::array();
  for (std::size_t n = 0; n < f.terms.size(); ++n) {
    const Term& t = f.terms[n];
    nlohmann::ordered_json term{{"kind", t.record->kind}, {"record", t.record->name}, {"class", codegen::Word(t.record->effect_class)}};
    if (t.joints.size() == 1 || IsUnknown(t)) term["joint"] = t.joints[0] + 1;
    else term["joint"] = JointName(t);
    const codegen::EffectUse use = Found(t);
    term["joints"] = nlohmann::ordered_json::array();
    for (const int joint : use.joints) term["joints"].push_back(joint + 1);
    term["unknowns"] = use.nonlinear;
    term["signals"] = Signals(t);
    nlohmann::ordered_json parameters, deviations;
    for (std::size_t k = 0; k < t.eta.size(); ++k) {
      parameters[t.unknowns[k].name] = t.eta[k];
      if (t.eta_sd[static_cast<Eigen::Index>(k)] > 0)
        deviations[t.unknowns[k].name] = t.eta_sd[static_cast<Eigen::Index>(k)];
    }
    for (std::size_t c = 0; c < t.columns.size(); ++c)
      parameters[t.columns[c].name] = t.amplitude[c], deviations[t.columns[c].name] = t.sd[c];
    term["parameters"] = parameters;
    term["parameter_sd"] = deviations;
    term["also_fits"] = t.also_fits;
    term["confirmed"] = t.confirmed;
    if (t.refuted) term["refuted"] = RefutedJson(*t.refuted);
    if (t.confirmed && !t.training_only) {
      const Dependence d = DependenceOf(v, n);
      term["without_moving"] = ToList(calibration::Rms(*v.test, v.held_out->after + v.term_torque[n], true));
      term["dependence"] = {
          {"over", d.signal}, {"torque", d.torque}, {"x", d.term.x}, {"without", d.without.y}, {"term", d.term.y}};
    }
    term["score"] = t.score;
    term["folds"] = ToList(t.folds);
    term["runner_up"] = t.rivals.empty() ? "" : RivalName(t.rivals[0]);
    term["runner_up_score"] = t.rivals.empty() ? 0 : t.rivals[0].score;
    term["separate"] = nlohmann::ordered_json::array();
    for (const Separation& apart : v.separation[n])
      term["separate"].push_back({{"from", apart.from}, {"how", apart.how}, {"command", apart.command}});
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
  j["torque_moving"] = ToList(calibration::Rms(test, test.tau, true));
  std::vector<double> share;
  for (int k = 0; k < test.joints(); ++k) share.push_back(test.moving.col(k).cast<double>().mean());
  j["moving_share"] = share;
  j["noise_floor"] = ToList(f.sigma);
  j["noise_innovation"] = ToList(f.innovation);
  j["smallest_detectable"] = ToList(f.smallest);
  if (!v.held_out->tracking.empty()) j["tracking"] = v.held_out->tracking;
  j["exogeneity"] = ToJson(v.exogeneity);
  j["seconds"] = v.seconds;
  return j;
}

}  // namespace armcal::verdict
