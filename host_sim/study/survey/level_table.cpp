// survey - Table 11: which level each method reaches, beside the survey's letters.
#include <cmath>
#include <limits>

#include "host_sim/study/survey/tables.hpp"

namespace armcal::survey {
namespace {

const Outcome* Named(const std::vector<Outcome>& outcomes, const std::string& name) {
  for (const Outcome& o : outcomes)
    if (o.name == name && (!o.clean.empty() || o.failed > 0)) return &o;
  return nullptr;
}

double MeanOf(const Outcome& o, bool noise, double Score::*index) {
  const std::vector<Score>& scores = noise ? o.noisy : o.clean;
  return scores.empty() ? std::numeric_limits<double>::infinity() : Over(scores, index).mean;
}

// Mean over the model kinds that the method applies to, as section 6.5 says.
template <class Value>
double Average(const Outcome* linear, const Outcome* nonlinear, Value value) {
  if (linear && nonlinear) return (value(*linear) + value(*nonlinear)) / 2;
  return linear ? value(*linear) : value(*nonlinear);
}

std::string FollowLevel(const Evidence& evidence, const Levels& levels, const std::string& name) {
  const auto slope = evidence.follow_slope.find(name);
  if (slope == evidence.follow_slope.end()) return "C";  // takes all samples at once
  if (slope->second <= levels.follow_rms) return "A";
  return evidence.follow_step.at(name) <= levels.follow_rms ? "B" : "C";
}

std::string TimeLevel(const Levels& levels, const calibration::Method& method, double seconds) {
  return method.online ? "Online" : std::string("Offline ") + levels.Of("solution_time_s", seconds);
}

}  // namespace

void ShowLevels(const Settings& settings, const Evidence& evidence, Findings& out) {
  if (!settings.Wants("11")) return;
  const Levels& levels = settings.levels;
  Sheet sheet{
      "11",
      "levels reached (printed)",
      {"method", "models", "e_d", "e_d / e_d(prior)", "e_f", "e_T", "J_e without noise", "follows", "solution time",
       "Delta J_e", "Delta J_e*"},
      {},
      {"The evidence is that of Tables 8 and 9 and of Figure 4: the plant is the truth.",
       "A letter in brackets is the survey's. e_d, e_f and e_T are those with noise; a method for both kinds of "
       "model is marked by the mean of the two, as in the survey.",
       "The printed letters B for e_f of the extended Kalman and the forgetting filter do not follow from the "
       "printed Tables 2, 8 and 9 (e_f 3.1 and 48.5, above 1, is C).",
       "Level A for e_d: 24 of the 60 standard parameters' directions appear in no torque. Without a prior no "
       "method can reach it; with one, A says that the prior was good. e_d / e_d(prior) says what data added.",
       "Without a prior Delta J_e is a ratio of two e_d that one link's small mass makes: 0.03 to 0.3 by the draw, so "
       "its "
       "letter is chance. The Kalman filters (19), (21) and the EKF in logarithms have no process noise and follow "
       "nothing by construction; Figure 4 measures it for (19).",
       "Delta J_e compares a mean that includes the measured torque's own noise with one that does not: it "
       "punishes a small J_e without noise. Delta J_e* uses noise-free torque in both."}};
  for (const calibration::Method& m : calibration::Methods()) {
    const std::string name = m.name;
    const Outcome *linear = Named(evidence.linear, name), *nonlinear = Named(evidence.nonlinear, name);
    if (!linear && !nonlinear) continue;
    const auto level = [&](const char* index, bool noise, double Score::*of) {
      return std::string(
          1, levels.Of(index, Average(linear, nonlinear, [&](const Outcome& o) { return MeanOf(o, noise, of); })));
    };
    const auto growth = [&](std::vector<double> Outcome::*of) {
      const double value = Average(linear, nonlinear, [&](const Outcome& o) { return Summarise(o.*of).mean; });
      return std::string(1, levels.Of("delta_J_e", value));
    };
    const auto printed = [&](std::size_t place) {
      const std::string letter = settings.printed.WordAt("table11", name, place);
      return letter == "-" ? "" : " (" + letter + ")";
    };
    const double over_prior =
        Average(linear, nonlinear, [](const Outcome& o) { return MeanOf(o, true, &Score::e_d_over_prior); });
    const double seconds =
        Average(linear, nonlinear, [](const Outcome& o) { return MeanOf(o, true, &Score::seconds); });
    sheet.rows.push_back({m.title,
                          linear && nonlinear ? "both"
                          : linear            ? "linear"
                                              : "nonlinear",
                          level("e_d", true, &Score::e_d) + printed(0), over_prior,
                          level("e_f", true, &Score::e_f) + printed(1), level("e_T", true, &Score::e_T) + printed(2),
                          level("J_e", false, &Score::J_e) + printed(3),
                          FollowLevel(evidence, levels, name) + printed(4), TimeLevel(levels, m, seconds) + printed(5),
                          growth(&Outcome::delta) + printed(6), growth(&Outcome::delta_true)});
  }
  out.sheets.push_back(sheet);
}

}  // namespace armcal::survey
