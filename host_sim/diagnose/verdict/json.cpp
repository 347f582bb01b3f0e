// verdict - writes one diagnosis as JSON, and reads the terms in such a file.
#include "host_sim/diagnose/verdict/json.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "codegen/src/io/input_error.hpp"
#include "codegen/src/io/json.hpp"
#include "host_sim/data/files/files.hpp"
#include "host_sim/diagnose/diagnosis/determined.hpp"
#include "host_sim/diagnose/verdict/curves.hpp"
#include "host_sim/diagnose/verdict/figures.hpp"
#include "host_sim/diagnose/verdict/words.hpp"
#include "host_sim/identify/calibration/log_check.hpp"

namespace armcal::verdict {

using diagnosis::Term;
using nlohmann::ordered_json;

namespace {

std::vector<std::string> Signals(const Term& t) {
  std::vector<std::string> out;
  const std::string joint = t.joints.empty() ? "" : std::to_string(t.joints[0] + 1);
  for (std::string s : t.record->signals) {
    if (s == "t") out.push_back("time");
    else if (s.ends_with("[k]")) out.push_back(s.substr(0, s.size() - 3) + std::to_string(t.joints.at(1) + 1));
    else if (s.ends_with("[j]")) out.push_back(s.substr(0, s.size() - 3) + joint);
    else if (s.back() == ')') out.push_back(s.insert(s.size() - 1, joint));
    else out.push_back(s == "tau_rigid" ? "load" + joint : s + joint);
  }
  return out;
}

// {"r": "not determined", "gap": "on its bound"}: parameters that nobody should use alone.
nlohmann::ordered_json MarksJson(const Term& t) {
  nlohmann::ordered_json out = nlohmann::ordered_json::object();
  if (!t.in_fit) return out;
  const diagnosis::Marks marks = diagnosis::MarkParameters(t);
  const auto add = [&](const std::string& name, diagnosis::Mark mark) {
    if (mark != diagnosis::Mark::kNone)
      out[name] = mark == diagnosis::Mark::kOnBound ? "on its bound" : "not determined";
  };
  for (std::size_t k = 0; k < t.eta.size(); ++k) add(t.unknowns[k].name, marks.eta[k]);
  for (std::size_t c = 0; c < t.columns.size(); ++c) add(t.columns[c].name, marks.amplitude[c]);
  return out;
}

// Rows of a matrix.
nlohmann::ordered_json ToJson(const Eigen::MatrixXd& m) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (Eigen::Index r = 0; r < m.rows(); ++r) out.push_back(ToList(m.row(r)));
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

// null where no payload is named.
nlohmann::ordered_json PayloadJson(const DiagnosisView& v) {
  const calibration::Carried& load = v.held_out->payload;
  if (!load.named) return nullptr;
  nlohmann::ordered_json out{{"kind", "payload"},
                             {"place", "flange"},
                             {"mass_kg", load.mass_kg},
                             {"mass_sd_kg", load.sd_kg},
                             {"mass_interval_kg", load.interval_kg},
                             {"gain_tolerance", load.tolerance},
                             {"gain_tolerance_stated", load.tolerance_stated},
                             {"center_m", ToList(load.load.segment<3>(1) / load.mass_kg)},
                             {"load", ToList(load.load)},
                             {"half_mass_kg", {load.half[0][0], load.half[1][0]}},
                             {"half_mass_sd_kg", load.half_sd_kg},
                             {"score", load.score}};
  const Eigen::VectorXd torque = calibration::RmsInBand(*v.test, v.test->tau).cwiseMax(1e-12);
  for (const auto& [key, residual] :
       {std::pair{"relative_without", &v.held_out->without_payload}, std::pair{"relative_with", &v.held_out->after}})
    out[key] = ToList(calibration::RmsInBand(*v.test, *residual).cwiseQuotient(torque));
  out["sentences"] = PayloadText(v);
  return out;
}

// What a page says of a term besides its sentence.
nlohmann::ordered_json WordsJson(const DiagnosisView& v, std::size_t term) {
  const Term& t = v.finding->terms[term];
  return {{"name", fmt::format("{}, joint {}", t.record->kind, JointName(t))},
          {"remark", Remark(t)},
          {"title", t.record->title},
          {"what_it_is", t.record->title + ". " + t.record->source + "."},
          {"cause", CauseText(v, term)},
          {"to_do", WhatToDo(t)},
          {"new_model", InTheModel(t, v.model->robot())},
          {"score", ScoreText(t)},
          {"folds", FoldText(t)},
          {"runner_up", RunnerUp(t)},
          {"fits_equally", AlsoFits(t)}};
}

// The parameters that the training logs determine, as the declared model has them.
nlohmann::ordered_json DeclaredJson(const DiagnosisView& v) {
  const calibration::Fit& fit = v.finding->declared;
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (const int c : fit.active)
    if (c < v.model->columns())
      out.push_back({{"name", v.model->column_name(c)},
                     {"unit", v.model->column_unit(c)},
                     {"value", fit.x[c]},
                     {"sd", fit.sd[c]}});
  return out;
}

}  // namespace

void AddRobot(ordered_json& json, const codegen::Robot& robot) {
  json["robot"] = robot.name, json["robot_title"] = robot.title;
  for (const codegen::Joint& joint : robot.joint)
    json["joint_names"].push_back(joint.name), json["torque_units"].push_back(calibration::TorqueUnit(joint));
}

nlohmann::ordered_json DiagnosisJson(const DiagnosisView& v) {
  const auto& f = *v.finding;
  nlohmann::ordered_json j;
  j["verdict"] = AnyConfirmed(f) ? "effect" : "none";
  j["joint_base"] = 1;
  const std::vector<Strange> strange = StrangeJoints(v);
  j["headline"] = Headline(f, !strange.empty());
  AddRobot(j, v.model->robot());
  j["terms"] = nlohmann::ordered_json::array();
  for (const std::size_t n : OrderOfTerms(v)) {
    const Term& t = f.terms[n];
    nlohmann::ordered_json term{
        {"kind", t.record->kind}, {"record", t.record->name}, {"class", codegen::Word(t.record->effect_class)}};
    if (t.joints.size() == 1 || IsUnknown(t)) term["joint"] = t.joints[0] + 1;
    else term["joint"] = JointName(t);
    const codegen::EffectUse use = Found(t);
    term["joints"] = nlohmann::ordered_json::array();
    for (const int joint : use.joints) term["joints"].push_back(joint + 1);
    term["unknowns"] = use.nonlinear;
    term["signals"] = Signals(t);
    nlohmann::ordered_json parameters, deviations = nlohmann::ordered_json::object(), units;
    for (std::size_t k = 0; k < t.eta.size(); ++k) {
      parameters[t.unknowns[k].name] = t.eta[k], units[t.unknowns[k].name] = t.unknowns[k].unit;
      if (t.eta_sd[static_cast<Eigen::Index>(k)] > 0)
        deviations[t.unknowns[k].name] = t.eta_sd[static_cast<Eigen::Index>(k)];
    }
    for (std::size_t c = 0; c < t.columns.size(); ++c) {
      const std::string& name = t.columns[c].name;
      units[name] = t.columns[c].unit;
      if (t.in_fit) parameters[name] = t.amplitude[c], deviations[name] = t.sd[c];
      else parameters[name] = nullptr;
    }
    term["parameters"] = parameters;
    term["parameter_sd"] = deviations;
    term["parameter_unit"] = units;
    term["eta"] = t.eta, term["amplitude"] = ToList(t.amplitude), term["covariance"] = ToJson(t.covariance);
    term["also_fits"] = t.also_fits;
    term["confirmed"] = t.confirmed;
    term["in_fit"] = t.in_fit;
    if (t.refuted) term["refuted"] = RefutedJson(*t.refuted);
    if (!t.unconfirmed.empty()) term["unconfirmed"] = t.unconfirmed;
    term["marks"] = MarksJson(t);
    term["sentence"] = Sentence(v, n);
    term["words"] = WordsJson(v, n);
    if (t.in_fit && !t.training_only) {
      const Dependence d = DependenceOf(v, n);
      term["without_moving"] = ToList(calibration::Rms(*v.test, v.held_out->after + v.term_torque[n], true)),
      term["without_in_band"] = ToList(calibration::RmsInBand(*v.test, v.held_out->after + v.term_torque[n]));
      term["dependence"] = {{"over", d.signal},       {"torque", d.torque}, {"x", d.term.x},
                            {"without", d.without.y}, {"term", d.term.y},   {"remains", d.remains.y},
                            {"of_joint", d.joint + 1}};
    }
    term["score"] = t.score;
    term["log10_chance"] = t.log_chance / std::numbers::ln10;
    term["folds"] = ToList(t.folds);
    term["runner_up"] = t.rivals.empty() ? "" : RivalName(t.rivals[0]);
    if (!t.rivals.empty()) term["runner_up_refused"] = t.rivals[0].refused;
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
  j["before_in_band"] = ToList(calibration::RmsInBand(test, v.held_out->before));
  j["after_in_band"] = ToList(calibration::RmsInBand(test, v.held_out->after));
  j["torque_moving"] = ToList(calibration::Rms(test, test.tau, true));
  std::vector<double> share;
  for (int k = 0; k < test.joints(); ++k) share.push_back(test.moving.col(k).cast<double>().mean());
  j["moving_share"] = share;
  j["noise_floor"] = ToList(f.sigma);
  j["noise_innovation"] = ToList(f.innovation);
  j["smallest_detectable"] = ToList(f.smallest);
  j["payload"] = PayloadJson(v);
  j["limits"] = nlohmann::ordered_json::array();
  for (const diagnosis::Limit& limit : f.limits) {
    nlohmann::ordered_json& each = j["limits"].emplace_back();
    each["kind"] = limit.record->kind, each["joints"] = nlohmann::ordered_json::array();
    for (const int joint : limit.joints) each["joints"].push_back(joint + 1);
    each["on"] = limit.joint + 1;
    each["rms_Nm"] = std::isfinite(limit.rms_Nm) ? nlohmann::ordered_json(limit.rms_Nm) : nlohmann::ordered_json();
  }
  if (!v.held_out->tracking.empty()) j["tracking"] = v.held_out->tracking;
  j["held_out_motion"] = ToJson(v.motion);
  j["not_looked_at"] = NotLookedAt(v);
  j["exogeneity"] = ToJson(v.exogeneity);
  j["too_short"] = nlohmann::ordered_json::array();
  for (const int joint : f.too_short) j["too_short"].push_back(joint + 1);
  j["at_rest"] = nlohmann::ordered_json::array();
  for (const int joint : Rested(v)) j["at_rest"].push_back(joint + 1);
  j["held_out_differs"] = nlohmann::ordered_json::array();
  for (const Strange& s : strange)
    j["held_out_differs"].push_back({{"joint", s.joint + 1}, {"held_out", s.held_out}, {"training", s.training}});
  j["held_out_differs_text"] = StrangeText(strange, v.model->robot());
  j["held_out_text"] = MotionText(v.motion);
  j["exogeneity_text"] = ExogeneityText(v.exogeneity, kLacksMore);
  j["declared_parameters"] = DeclaredJson(v);
  j["curves"] = CurvesJson(v);
  j["seconds"] = v.seconds;
  return j;
}

namespace {

bool IsAmong(const codegen::EffectUse& use, const std::vector<std::string>& effects) {
  const std::string word = EffectWord(use.effect, use.joints);
  return std::any_of(effects.begin(), effects.end(),
                     [&](const std::string& e) { return e == use.effect || e == word; });
}

}  // namespace

std::vector<codegen::EffectUse> ReadFound(const std::string& path, const std::vector<std::string>& effects) {
  std::vector<codegen::EffectUse> out;
  if (path.empty()) return out;
  try {
    const ordered_json verdict = files::ReadJsonFile(path);
    for (const auto& term : verdict.at("terms")) {
      codegen::EffectUse use;
      use.effect = term.at("record").get<std::string>();
      for (const int joint : term.at("joints")) use.joints.push_back(joint - 1);
      use.nonlinear = term.at("unknowns").get<std::map<std::string, double>>();
      if (!use.nonlinear.empty() && IsAmong(use, effects)) out.push_back(use);
    }
  } catch (const nlohmann::ordered_json::exception&) {
    throw io::InputError(path + ": expected a verdict that armcal diagnose --json wrote");
  }
  if (out.empty())
    throw io::InputError(
        fmt::format("{}: expected a term with nonlinear parameters among {}", path, fmt::join(effects, ", ")));
  return out;
}

diagnosis::KnownTerm ReadKnownTerm(const ordered_json& term, const codegen::Catalogue& catalogue,
                                   Eigen::MatrixXd& covariance) {
  diagnosis::KnownTerm out;
  const auto number = [](const ordered_json& j) { return j.is_number() ? j.get<double>() : 0; };  // null: not finite
  try {
    const auto record = catalogue.find(term.at("record").get<std::string>());
    if (record == catalogue.end())
      throw io::InputError(io::JsonText(term["record"]) + ": expected a record of the catalogue");
    out.record = &record->second;
    for (const int joint : term.at("joints")) out.joints.push_back(joint - 1);
    out.eta = term.at("eta").get<std::vector<double>>();
    const ordered_json &amplitude = term.at("amplitude"), &rows = term.at("covariance");
    out.amplitude.resize(static_cast<Eigen::Index>(amplitude.size()));
    for (std::size_t c = 0; c < amplitude.size(); ++c)
      out.amplitude[static_cast<Eigen::Index>(c)] = number(amplitude[c]);
    const auto size = static_cast<Eigen::Index>(out.eta.size() + amplitude.size());
    covariance.setZero(size, size);
    for (Eigen::Index r = 0; r < size; ++r)
      for (Eigen::Index c = 0; c < size; ++c)
        covariance(r, c) = number(rows.at(static_cast<std::size_t>(r)).at(static_cast<std::size_t>(c)));
  } catch (const nlohmann::ordered_json::exception&) {
    throw io::InputError("expected a verdict with eta, amplitude and covariance of each term: diagnose anew");
  }
  return out;
}

}  // namespace armcal::verdict
