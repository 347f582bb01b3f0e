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

std::string Line(const std::string& name, const std::string& what, const json& truth, const json& verdict,
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

class Judge {
 public:
  Judge(const std::string& name, const json& truth, const json& verdict, const std::string& said, Tally& tally)
      : name_(name),
        truth_(truth),
        verdict_(verdict),
        said_(said),
        tally_(tally),
        effects_(truth.at("effects")),
        group_(truth.at("group")) {}

  void Whole() {
    if (group_ == "negative") return Negative();
    Count("II logs that are read", !verdict_.is_null());
    if (verdict_.is_null()) Fail("refused");
    if (verdict_.is_null() && effects_.empty()) return;
    Terms();
    if (effects_.empty()) return Control();
    bool all = true;
    for (const json& e : effects_) all = Effect(e) && all;
    if (group_ == "several") Count("II several: all named", all);
    Floors();
  }

 private:
  bool Count(const std::string& share, bool ok) {
    tally_.shares[share].Add(ok);
    return ok;
  }
  void Fail(const std::string& what) { tally_.failures.push_back(Line(name_, what, truth_, verdict_, said_)); }

  void Negative() {
    const std::string joint = std::to_string(truth_.at("fed_joint").get<int>());
    const bool told = said_.find("joint " + joint) != said_.npos || said_.find("joint" + joint) != said_.npos;
    if (!Count("II negative: the joint is named as suspect", told)) Fail("not told");
  }

  // Sorts out the confirmed terms that claim something of the arm, and what of it is true.
  void Terms() {
    const std::vector<json> terms = verdict_.is_null() ? std::vector<json>{} : practice::Confirmed(verdict_);
    for (const json& t : terms)
      if (!TrueAsWell(t, truth_)) own_.push_back(t);
    const bool told = own_.size() < terms.size();
    const bool payload = !verdict_.is_null() && !verdict_.at("payload").is_null();
    if (group_ == "controls_late") Count("II late channel: named as such", told);
    if (group_ == "payload" && !Count("II payload of the held-out run: named at the flange", payload))
      Fail("payload not named");
    int spurious = 0;
    for (const json& t : own_) {
      const auto any = [&](auto test) {
        return std::any_of(effects_.begin(), effects_.end(), [&](const json& e) { return test(t, e); });
      };
      spurious += !any(Touches);
      Count("II confirmed terms that are right", any(Right) || any(Localised));
    }
    ++tally_.judged;
    tally_.spurious += spurious;
    if (spurious > 0 && !effects_.empty()) Fail("spurious term");
  }

  void Control() {
    const bool payload = group_ == "payload";
    const bool silent =
        Count(payload ? "II controls, payload: silent of the arm" : "II " + group_ + ": silent", own_.empty());
    if (!payload) Count("II controls: silent", silent);
    if (!silent) Fail("false alarm");
  }

  // False: it could be seen and was not named.
  bool Effect(const json& e) {
    const auto test = [&](auto what) {
      if (effects_.size() == 1) return !own_.empty() && what(own_[0], e);
      return std::any_of(own_.begin(), own_.end(), [&](const json& t) { return what(t, e); });
    };
    const bool joint = test(OnJointOf), right = test(Right), local = test(Localised);
    for (const json& t : own_)
      if (OnJointOf(t, e)) Cover(t, e, tally_.shares["II parameters: 95 % interval holds the truth"]);
    if (!e.at("detectable").get<bool>()) {
      Count("II not detectable: silent", own_.empty());
      Count("II not detectable: right all the same", right || local);
      return true;
    }
    const bool unrecorded = e.at("accept_kinds").empty(), ok = unrecorded ? local : right;
    if (group_ == "several" && !Count("II several: effect named", ok))
      Fail("several: missed " + e.at("kind").get<std::string>());
    if (group_ == "payload") Count("II payload: effect named", ok);
    if (group_ == "several" || group_ == "payload") return ok;
    Alone(e, joint, ok, unrecorded);
    if (!ok) Fail(own_.empty() ? "missed" : joint ? "another kind" : "another joint");
    return ok;
  }

  void Alone(const json& e, bool joint, bool ok, bool unrecorded) {
    const std::string what = unrecorded ? "II unrecorded" : "II single";
    Count(what + (unrecorded ? ": joint and signal" : ": kind or class, and joint"), ok);
    Count(what + ": joint", joint);
    Count(what + ", score " + ScoreBin(e.at("score")), ok);
    Count(what + ", channel " + truth_.at("channel").get<std::string>(), ok);
    Count(what + ", noise " + truth_.at("noise_class").get<std::string>(), ok);
    Count(what + fmt::format(", {} Hz", truth_.at("rate_Hz").get<double>()), ok);
    if (e.at("lowest_fifth").get<bool>()) Count(what + ", lowest fifth of the detectable range", ok);
    if (e.at("report_only").get<bool>()) Count(what + ", form of the report part alone", ok);
    if (!unrecorded)
      Count(what + (e.at("held_by_a_record").get<bool>() ? ", form of a record" : ", form of no record"), ok);
    Count("II form " + e.at("kind").get<std::string>(), ok);
  }

  void Floors() {
    if (verdict_.is_null() || group_ == "payload" || truth_.at("channel") == "jittered samples") return;
    for (const json& e : effects_)
      if (e.at("run_state").get<bool>()) return;
    for (std::size_t j = 0; j < verdict_.at("after").size(); ++j)
      if (std::any_of(effects_.begin(), effects_.end(),
                      [&](const json& e) { return e.at("visible_ratio")[j].get<double>() > practice::kAffected; }))
        tally_.over.push_back(verdict_.at("after")[j].get<double>() / truth_.at("test_floor_derived")[j].get<double>());
  }

  const std::string& name_;
  const json &truth_, &verdict_;
  const std::string& said_;
  Tally& tally_;
  const json& effects_;
  const std::string group_;
  std::vector<json> own_;
};

}  // namespace

void JudgeSetTwo(const std::string& name, const json& truth, const json& verdict, const std::string& said,
                 Tally& tally) {
  Judge(name, truth, verdict, said, tally).Whole();
}

}  // namespace armcal::judged
