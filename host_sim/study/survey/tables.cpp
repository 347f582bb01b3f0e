// survey - runs the survey: computes once what several tables need, then fills the tables in their order.
#include "host_sim/study/survey/tables.hpp"

#include "host_sim/study/survey/platform.hpp"

namespace armcal::survey {

const std::vector<std::string>& OwnLinear() {
  static const std::vector<std::string> names{"pseudo_inverse",   "kalman",  "forgetting",
                                              "gradient_descent", "genetic", "particle_filter"};
  return names;
}

const std::vector<std::string>& OwnNonlinear() {
  static const std::vector<std::string> names{"extended_kalman", "forgetting", "gradient_descent", "genetic",
                                              "particle_filter"};
  return names;
}

const std::vector<std::string>& BetterLinear() {
  static const std::vector<std::string> names{"weighted_pseudo_inverse", "map_barrier", "multiple_model", "robust"};
  return names;
}

const std::vector<std::string>& BetterNonlinear() {
  static const std::vector<std::string> names{"variable_projection", "log_ekf", "stribeck_basis", "map_barrier"};
  return names;
}

namespace {

std::vector<std::string> Both(std::vector<std::string> own, const std::vector<std::string>& better) {
  own.insert(own.end(), better.begin(), better.end());
  return own;
}

std::vector<Outcome> Draws(const Settings& settings, const Motions& motions, Law law,
                           const std::vector<std::string>& methods) {
  DrawSettings d;
  d.law = law;
  d.draws = std::min(settings.draws, 20);  // the survey shows one; the priors' table takes all
  d.slow_draws = settings.slow_draws;
  d.seed = settings.seed;
  return RunDraws(settings, motions, d, methods);
}

// Searches the motions that the tables use and, for the table of trajectories, every other curve, search and criterion.
Motions SearchMotions(const Settings& settings) {
  using excitation::Criterion, excitation::Family, excitation::Search;
  Motions motions;
  const auto excite = [&](ExcitedBy& e, double seconds) {
    settings.progress("trajectory " + LawName(e.law) + ", " + excitation::Name(e.family), 0);
    Excite(settings.robot, settings.records, {seconds, settings.seed, settings.stop, settings.searches}, e);
  };
  motions.nonlinear.law = Law::kGradient;
  excite(motions.linear, settings.search_s);
  excite(motions.nonlinear, settings.search_s);
  motions.other = Validation(settings.robot, settings.records, settings.seed);
  motions.friction.law = Law::kGradient;
  motions.friction.criterion = Criterion::Kind::kAccuracy;
  if (settings.Wants("online") || settings.Wants("trajectories")) excite(motions.friction, settings.search_s);
  if (!settings.Wants("trajectories")) return motions;
  const auto other = [&](Law law, Family family, Search search, Criterion::Kind criterion) {
    motions.others.push_back({law, family, search, criterion, {}});
  };
  for (const Law law : {Law::kCoulombViscous, Law::kGradient}) {
    other(law, Family::kFourier, Search::kGenetic, Criterion::Kind::kCondition);
    other(law, Family::kFourier, Search::kGradient, Criterion::Kind::kDOptimal);
  }
  other(Law::kCoulombViscous, Family::kFourier, Search::kGradient, Criterion::Kind::kAccuracy);
  for (const Family family : {Family::kSine, Family::kPolynomial, Family::kSpline})
    other(Law::kCoulombViscous, family, Search::kGradient, Criterion::Kind::kCondition);
  for (ExcitedBy& e : motions.others) excite(e, settings.search_s);
  motions.others.push_back(motions.friction);
  return motions;
}

}  // namespace

Sheet Slips() {
  return {"slips",
          "where the survey slips, and what armcal does",
          {"place", "printed", "here"},
          {{"(21)", "tau_f in the innovation", "tau_j, as in (24)"},
           {"(21), (24)", "P_k on the left of the last line", "P_n"},
           {"(14)", "tau_j = K phi for nonlinear models", "holds for increments only: K is a linearisation"},
           {"section 5.1", "e_T = Mean(|e| / tau_max)", "the tables can only be |Mean(e)| / tau_max; both are shown"},
           {"section 5.1", "e_T_Std = Std(|e| / tau_max)", "the tables are Std(e / tau_max); both are shown"},
           {"Tables 5, 6", "inertia of link 3", "belongs to no body: an eigenvalue is -0.016"},
           {"Table 12", "(5) worse than (7)", "impossible, (5) contains (7): the solver failed"},
           {"Table 11", "B for e_f of the EKF and forgetting", "their printed e_f are above 1, which is C"},
           {"(9)", "f1 tau_load", "one f1 for the arm repeats rigid columns, whatever the load: table (9)"},
           {"Table 4", "Delta J_e", "with measured torque in J_e it cannot be below 0.1 once J_e is below 0.2"}},
          {}};
}

Findings RunSurvey(const Settings& asked) {
  Settings settings = asked;
  settings.records = Records(asked.records);
  Findings out;
  if (settings.Wants("figures")) ShowArm(settings, out);
  const Motions motions = SearchMotions(settings);
  ShowTrajectories(settings, motions, out);

  Evidence evidence;
  const bool levels = settings.Wants("11");
  if (levels || settings.Wants("5") || settings.Wants("8"))
    evidence.linear = Draws(settings, motions, Law::kCoulombViscous, Both(OwnLinear(), BetterLinear()));
  if (levels || settings.Wants("6") || settings.Wants("9"))
    evidence.nonlinear = Draws(settings, motions, Law::kStribeck, Both(OwnNonlinear(), BetterNonlinear()));
  ShowParameters(settings, motions, evidence, out);
  ShowErrors(settings, evidence, out);
  ShowInstruments(settings, motions, out);
  ShowDifferentiation(settings, motions, out);
  if (levels || settings.Wants("figures")) ShowTracking(settings, motions, evidence, out);
  ShowLevels(settings, evidence, out);
  ShowModels(settings, motions, out);
  ShowLoad(settings, motions, out);
  if (settings.Wants("priors")) ShowPriors(settings, motions, out);
  if (settings.Wants("shipped")) ShowShippedPrior(settings, motions, out);
  if (settings.Names("widths")) ShowWidths(settings, motions, out);
  if (settings.Wants("laws")) ShowLaws(settings, motions, out);
  if (settings.Wants("choice")) ShowChoice(settings, motions, out);
  if (settings.Wants("bounds")) ShowBounds(settings, motions, out);
  if (settings.Wants("online")) ShowOnline(settings, motions, out);
  out.sheets.push_back(Slips());
  return out;
}

}  // namespace armcal::survey
