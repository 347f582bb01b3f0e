// survey - how well the better methods do under every prior, over fresh draws, and the goals that they must reach.
#include <algorithm>

#include "host_sim/study/survey/tables.hpp"

namespace armcal::survey {
namespace {

constexpr double kWorst = 0.2;
constexpr int kTruthsJudged = 20;  // at least: a mean over three drawn truths says nothing of a bound

void AddRows(const std::string& prior, const std::string& case_name, const std::vector<Outcome>& outcomes, bool noise,
             Sheet& sheet) {
  for (const Outcome& o : outcomes) {
    const std::vector<Score>& scores = noise ? o.noisy : o.clean;
    if (scores.empty()) continue;
    std::vector<Score> in_ms = scores;
    for (Score& s : in_ms) s.seconds *= 1e3;
    const Statistic e_d = Over(scores, &Score::e_d), e_f = Over(scores, &Score::e_f);
    const double least = Over(scores, &Score::e_f_least).mean;
    sheet.rows.push_back({prior, o.title, case_name, static_cast<double>(scores.size()),
                          Cell(e_d.mean, e_d.low, e_d.high), e_d.p95, Mean(scores, &Score::e_d_over_prior),
                          Cell(e_f.mean, e_f.low, e_f.high), e_f.p95, least > 0 ? Cell(least) : Cell("-"),
                          Mean(scores, &Score::J_true), Mean(scores, &Score::e_base), Mean(scores, &Score::coverage),
                          Over(scores, &Score::physical).mean, Over(in_ms, &Score::seconds).p95,
                          static_cast<double>(o.failed)});
  }
}

const Outcome* NoisyOf(const std::vector<Outcome>& outcomes, const std::string& name) {
  for (const Outcome& o : outcomes)
    if (o.name == name && !o.noisy.empty()) return &o;
  return nullptr;
}

void WorstGoals(const std::vector<Outcome>& outcomes, Findings& out) {
  const Outcome* map = NoisyOf(outcomes, "map_barrier");
  if (!map) return;
  const std::string where = "Table 8, MAP told its worst case +-20 %, noise: ";
  const Statistic e_d = Over(map->noisy, &Score::e_d);
  out.goals.push_back({where + "mean e_d", e_d.mean, 0.19, true});
  out.goals.push_back({where + "95th percentile of e_d", e_d.p95, 0.19, true});
  out.goals.push_back({where + "mean e_f", Over(map->noisy, &Score::e_f).mean, 0.02, true});
  out.goals.push_back(
      {where + "share of draws with physical bodies", Over(map->noisy, &Score::physical).mean, 1, false});
  out.goals.push_back(
      {where + "Table 4's mean Delta J_e against noise-free torque", Summarise(map->delta_true).mean, 0.1, true});
}

}  // namespace

void ShowPriors(const Settings& settings, const Motions& motions, Findings& out) {
  Sheet sheet{
      "priors",
      "methods that use the CAD values, under every prior",
      {"prior", "method", "case", "draws", "e_d", "e_d p95", "e_d / e_d(prior)", "e_f", "e_f p95", "bound of e_f",
       "J_e*", "base error / sigma", "coverage", "share physical", "time p95 / ms", "failed"},
      {},
      {"Truth: the plant, as in Tables 8 and 9; \"analytic\": K z of armcal's own regressor, as in the survey.",
       "Bound of e_f: what is left on average if the errors have the least covariance that the rows and the prior "
       "allow "
       "(Cramer and Rao), all parameters being unknown. A joint that is slow for a few samples shows little of its "
       "Stribeck speed.",
       "Worst case: every mass, centre, moment and friction value is 20 % off, up or down. Of the 60 body "
       "parameters 24 directions are seen in no torque, so the prior's error in them stays whatever the data: e_d "
       "has a floor, and level A for e_d says as much about the prior as about the method.",
       "sigma / 10: the noise-free data with the torque noise declared ten times smaller than Table 7. With "
       "Table 7's own sigma an estimator rightly distrusts noise-free data as much as noisy ones."}};
  const auto settings_of = [&](const PriorError& prior, Law law, bool random_truth, double clean_sigma) {
    DrawSettings d;
    d.law = law, d.prior = prior, d.random_truth = random_truth, d.clean_sigma = clean_sigma;
    d.draws = settings.draws, d.slow_draws = settings.slow_draws, d.seed = settings.seed + 7;
    return d;
  };
  const auto run = [&](const PriorError& prior, Law law, bool random_truth, double clean_sigma,
                       const std::vector<std::string>& methods) {
    return RunDraws(settings, motions, settings_of(prior, law, random_truth, clean_sigma), methods);
  };
  const std::vector<std::string> map{"map_barrier"}, laws{"log_ekf", "stribeck_basis"},
      laws_and_map{"log_ekf", "stribeck_basis", "map_barrier"};
  const PriorError worst{PriorError::kWorst, kWorst};
  for (const PriorError& prior :
       {worst, PriorError{PriorError::kUniform, 0.2}, PriorError{PriorError::kUniform, 0.5}}) {
    const auto same = run(prior, Law::kCoulombViscous, false, 1, map);
    AddRows(PriorName(prior), "(7), noise", same, true, sheet);
    AddRows(PriorName(prior), "(7), no noise", same, false, sheet);
    if (prior.kind == PriorError::kWorst) WorstGoals(same, out);
  }
  const auto sharp = run(worst, Law::kCoulombViscous, false, 0.1, map);
  AddRows(PriorName(worst), "(7), no noise, sigma / 10", sharp, false, sheet);
  if (const Outcome* o = NoisyOf(sharp, "map_barrier"))
    out.goals.push_back(
        {"Table 8, MAP told its worst case +-20 %, no noise: mean e_d", Over(o->clean, &Score::e_d).mean, 0.15, true});
  const PriorError uniform{PriorError::kUniform, 0.2};
  for (const PriorError& prior : {uniform, worst, PriorError{PriorError::kUniform, 0.5}}) {
    const bool judged = PriorName(prior) == PriorName(uniform);
    DrawSettings drawn = settings_of(prior, Law::kStribeck, true, 1);
    if (judged) drawn.draws = std::max(drawn.draws, kTruthsJudged);
    const auto stribeck = RunDraws(settings, motions, drawn, judged ? laws_and_map : laws);
    AddRows(PriorName(prior), "(4), drawn truths, noise", stribeck, true, sheet);
    if (!judged) continue;
    for (const std::string& name : laws)
      if (const Outcome* o = NoisyOf(stribeck, name))
        out.goals.push_back(
            {"Table 9, (4) with drawn truths on the plant, noise, " + name + ": mean e_f over its bound",
             Over(o->noisy, &Score::e_f).mean / Over(o->noisy, &Score::e_f_least).mean, 1.15, true});
  }
  DrawSettings analytic = settings_of(uniform, Law::kStribeck, true, 1);
  analytic.analytic = true, analytic.draws = std::max(analytic.draws, kTruthsJudged);
  const auto as_in_survey = RunDraws(settings, motions, analytic, laws);
  AddRows(PriorName(uniform), "(4), drawn truths, noise, analytic", as_in_survey, true, sheet);
  for (const std::string& name : laws)
    if (const Outcome* o = NoisyOf(as_in_survey, name))
      out.goals.push_back({"Table 9, (4) with drawn truths, analytic, noise, " + name + ": mean e_f",
                           Over(o->noisy, &Score::e_f).mean, 0.06, true});
  // The same laws along a trajectory searched for friction: it has low speeds instead of a small cond(K).
  if (motions.friction.searches > 0) {
    const auto stribeck =
        RunDraws(settings, AlongFriction(motions), settings_of(uniform, Law::kStribeck, true, 1), laws);
    AddRows(PriorName(uniform), "(4), drawn truths, noise, friction-aware trajectory", stribeck, true, sheet);
  }
  out.sheets.push_back(sheet);
}

}  // namespace armcal::survey
