// judged set - compares a verdict on a case of set II with the truth.
#include <set>

#include "tests/judged/shares.hpp"

namespace armcal::judged {

using practice::Joints;

namespace {

// "5-6" as {5, 6}; "flange" as itself.
std::set<std::string> JointSet(const json& joint) {
  std::set<std::string> out;
  const std::string text = Joints(joint);
  for (std::size_t from = 0; from <= text.size();) {
    const std::size_t dash = std::min(text.find('-', from), text.size());
    out.insert(text.substr(from, dash - from));
    from = dash + 1;
  }
  return out;
}

bool OnJointOf(const json& term, const json& effect) {
  const std::string said = Joints(term.at("joint"));
  const json also = effect.value("also_joints", json::array());
  return said == Joints(effect.at("joint")) ||
         std::any_of(also.begin(), also.end(), [&](const json& j) { return said == Joints(j); });
}

// Kind or class, and joint.
bool Right(const json& term, const json& effect) {
  json there = term;
  if (OnJointOf(term, effect)) there["joint"] = effect.at("joint");
  return practice::Names(there, effect);
}

bool Localised(const json& term, const json& effect) { return OnJointOf(term, effect) && SameSignal(term, effect); }

// A joint of the term is one that the effect acts on, or shows on.
bool Touches(const json& term, const json& effect) {
  std::set<std::string> joints = JointSet(effect.at("joint"));
  for (const json& j : effect.at("also_joints")) joints.merge(JointSet(j));
  for (std::size_t j = 0; j < effect.at("visible_ratio").size(); ++j)
    if (effect.at("visible_ratio")[j].get<double>() > practice::kAffected) joints.insert(std::to_string(j + 1));
  for (const std::string& j : JointSet(term.at("joint")))
    if (joints.contains(j) || j == "all") return true;
  return false;
}

// What the log itself holds besides effects of the arm: a late channel, the payload of the other run.
bool TrueAsWell(const json& term, const json& truth) {
  std::set<std::string> kinds{term.at("kind").get<std::string>()};
  for (const json& also : term.at("also_fits")) kinds.insert(also.get<std::string>());
  for (const json& fact : truth.value("true_as_well", json::array())) {
    if (fact.at("joint") != "any" && Joints(fact.at("joint")) != Joints(term.at("joint"))) continue;
    for (const json& kind : fact.at("kinds"))
      if (kinds.contains(kind.get<std::string>())) return true;
  }
  return false;
}

std::string Text(const json& term) {
  std::string out = fmt::format("{} on {} over", term.at("kind").get<std::string>(), Joints(term.at("joint")));
  for (const json& s : term.at("signals")) out += " " + s.get<std::string>();
  out += fmt::format(", score {:.0f}", term.at("score").get<double>());
  for (const json& also : term.at("also_fits")) out += "|" + also.get<std::string>();
  if (term.contains("refuted") && !term.at("refuted").is_null()) out += " (refuted)";
  else if (!term.at("confirmed").get<bool>()) out += " (not confirmed)";
  return out;
}

std::string Line(const std::string& name, const char* what, const json& truth, const json& verdict,
                 const std::string& said) {
  std::string out = fmt::format("{} | {} | {}, {}, {} Hz | ", name, what, truth.at("noise_class").get<std::string>(),
                                truth.at("channel").get<std::string>(), truth.at("rate_Hz").get<double>());
  for (const json& e : truth.at("effects"))
    out += fmt::format("{} on {} size {:.2f} score {:.0f}; ", e.at("kind").get<std::string>(), Joints(e.at("joint")),
                       e.at("size").get<double>(), e.at("score").get<double>());
  if (truth.contains("fed_joint")) out += fmt::format("friction of {} fed back; ", truth.at("fed_joint").get<int>());
  if (truth.contains("payload_kg"))
    out += fmt::format("payload {:.1f} kg in the held-out run; ", truth.at("payload_kg").get<double>());
  out += "| ";
  if (verdict.is_null()) return out + "refused: " + said.substr(said.find_last_of('\n', said.size() - 2) + 1);
  for (const json& t : verdict.at("terms")) out += Text(t) + "; ";
  return out + (verdict.at("terms").empty() ? "silent" : "");
}

std::string ScoreBin(double score) {
  return score < 30    ? "below 30"
         : score < 60  ? "30-60"
         : score < 120 ? "60-120"
         : score < 500 ? "120-500"
                       : "above 500";
}

}  // namespace

void JudgeSetTwo(const std::string& name, const json& truth, const json& verdict, const std::string& said,
                 Tally& tally) {
  auto& shares = tally.shares;
  const std::string group = truth.at("group"), channel = truth.at("channel");
  const json& effects = truth.at("effects");
  const auto fail = [&](const char* what) { tally.failures.push_back(Line(name, what, truth, verdict, said)); };
  const auto count = [&](const std::string& share, bool ok) {
    shares[share].Add(ok);
    return ok;
  };
  if (group == "negative") {
    const bool told = said.find(fmt::format("joint {}", truth.at("fed_joint").get<int>())) != said.npos ||
                      said.find(fmt::format("joint{}", truth.at("fed_joint").get<int>())) != said.npos;
    if (!count("II negative: the joint is named as suspect", told)) fail("not told");
    return;
  }
  count("II logs that are read", !verdict.is_null());
  if (verdict.is_null()) {
    fail("refused");
    if (effects.empty()) return;
  }
  const std::vector<json> terms = verdict.is_null() ? std::vector<json>{} : practice::Confirmed(verdict);
  std::vector<json> own;  // that claim something of the arm
  for (const json& t : terms)
    if (!TrueAsWell(t, truth)) own.push_back(t);
  if (group == "controls_late") count("II late channel: named as such", own.size() < terms.size());
  if (group == "payload" && !count("II payload of the held-out run: named at the flange", own.size() < terms.size()))
    fail("payload not named");
  ++tally.judged;
  int spurious = 0;
  for (const json& t : own) {
    const auto any = [&](auto test) {
      return std::any_of(effects.begin(), effects.end(), [&](const json& e) { return test(t, e); });
    };
    spurious += !any(Touches);
    count("II confirmed terms that are right", any(Right) || any(Localised));
  }
  tally.spurious += spurious;
  if (effects.empty()) {
    const std::string of = group == "payload" ? "II controls, payload: silent of the arm" : "II " + group + ": silent";
    const bool silent = count(of, own.empty());
    if (group != "payload") count("II controls: silent", silent);
    if (!silent) fail("false alarm");
    return;
  }
  if (spurious > 0) fail("spurious term");
  bool all = true;
  for (const json& e : effects) {
    const bool detectable = e.at("detectable"), alone = effects.size() == 1;
    const auto test = [&](auto what) {
      if (alone) return !own.empty() && what(own[0], e);
      return std::any_of(own.begin(), own.end(), [&](const json& t) { return what(t, e); });
    };
    const bool joint = test(OnJointOf), right = test(Right), local = test(Localised);
    for (const json& t : own)
      if (OnJointOf(t, e)) Cover(t, e, shares["II parameters: 95 % interval holds the truth"]);
    if (!detectable) {
      count("II not detectable: silent", own.empty());
      count("II not detectable: right all the same", right || local);
      continue;
    }
    const bool unrecorded = e.at("accept_kinds").empty();
    const bool ok = unrecorded ? local : right;
    if (group == "several") {
      if (!count("II several: effect named", ok)) fail(("several: missed " + e.at("kind").get<std::string>()).c_str());
      all = all && ok;
      continue;
    }
    if (group == "payload") {
      count("II payload: effect named", ok);
      continue;
    }
    const std::string what = unrecorded ? "II unrecorded" : "II single";
    count(what + (unrecorded ? ": joint and signal" : ": kind or class, and joint"), ok);
    count(what + ": joint", joint);
    count(what + ", score " + ScoreBin(e.at("score")), ok);
    count(what + ", channel " + channel, ok);
    count(what + ", noise " + truth.at("noise_class").get<std::string>(), ok);
    count(what + fmt::format(", {} Hz", truth.at("rate_Hz").get<double>()), ok);
    if (e.at("lowest_fifth").get<bool>()) count(what + ", lowest fifth of the detectable range", ok);
    if (e.at("report_only").get<bool>()) count(what + ", form of the report part alone", ok);
    if (!unrecorded)
      count(what + (e.at("held_by_a_record").get<bool>() ? ", form of a record" : ", form of no record"), ok);
    count("II form " + e.at("kind").get<std::string>(), ok);
    if (!ok) fail(own.empty() ? "missed" : joint ? "another kind" : "another joint");
  }
  if (group == "several" && all) count("II several: all named", true);
  if (group == "several" && !all) count("II several: all named", false);
  for (std::size_t j = 0; !verdict.is_null() && j < verdict.at("after").size(); ++j) {
    bool affected = false, run_state = false;
    for (const json& e : effects) {
      affected = affected || e.at("visible_ratio")[j].get<double>() > practice::kAffected;
      run_state = run_state || e.at("run_state").get<bool>();
    }
    if (affected && !run_state && group != "payload" && channel != "jittered samples")
      tally.over.push_back(verdict.at("after")[j].get<double>() / truth.at("test_floor_derived")[j].get<double>());
  }
}

}  // namespace armcal::judged
