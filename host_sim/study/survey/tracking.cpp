// survey - Figure 4: friction changes while the filters run, and some of them follow it.
#include <algorithm>
#include <cmath>
#include <limits>

#include "host_sim/machine/plant/joint_effects.hpp"
#include "host_sim/study/survey/plant_run.hpp"
#include "host_sim/study/survey/platform.hpp"
#include "host_sim/study/survey/tables.hpp"

namespace armcal::survey {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kShownJoint = 2, kTracks = 3;
constexpr double kRun_s = 30;
constexpr double kStepAt = 1.0 / 3;  // of the run

struct Profile {
  const char* name;
  double (*growth)(double share_of_run);  // beta / beta at the start
};
const Profile kProfiles[] = {{"slope", [](double u) { return 1 + 0.5 * u; }},
                             {"second order", [](double u) { return 1 + 0.5 * u * u; }},
                             {"step", [](double u) { return u < kStepAt ? 1.0 : 1.3; }},
                             {"constant", [](double) { return 1.0; }}};

struct Filter {
  std::string method;
  double mu;  // 0: the method has none
};
const Filter kFilters[] = {{"kalman", 0},         {"forgetting", 0.99},  {"forgetting", 0.993}, {"forgetting", 0.995},
                           {"forgetting", 0.997}, {"forgetting", 0.998}, {"forgetting", 0.999}, {"multiple_model", 0}};

struct Tracked {
  VectorXd t;
  MatrixXd beta, found;  // [samples x joints]
};

// All betas change alike, in steps: the plant's effects begin at a time each.
constexpr double kStep_s = 0.5;

double GrowthAt(const Profile& profile, double t_s) {
  return profile.growth(std::floor(t_s / kStep_s + 1e-9) * kStep_s / kRun_s);
}

// The plant along the linear trajectory; torque without noise.
calibration::Dataset Run(const Settings& settings, const Motions& motions, const codegen::Model& model,
                         const Profile& profile) {
  PlantSettings plant;
  plant.friction = plant.torque_constant = plant.noise = 0;
  plant.seconds = kRun_s;
  double before = 1;
  for (double t_s = 0; t_s < kRun_s; t_s += kStep_s) {
    const double rise = GrowthAt(profile, t_s) - before;
    before += rise;
    if (rise == 0) continue;
    for (int j = 0; j < settings.robot.joints(); ++j) {
      const double beta = settings.robot.joint[static_cast<std::size_t>(j)].nominal.at("Fv");
      const toml::table keys{{"drag_at_1radps_Nm", rise * beta}, {"exponent", 1.0}};
      plant.effects.push_back({"viscous_cubic", j,
                               plant::ReadJointEffect("viscous_cubic", io::TomlReader(keys, "figure 4")),
                               kRamp_s + t_s});
    }
  }
  return WithoutRotors(settings.robot, model, RunPlant(settings.robot, motions.linear.series, plant));
}

Tracked Track(const Settings& settings, const codegen::Model& truth, const calibration::Dataset& clean,
              const calibration::Method& method, double mu, const Profile& profile, int draw) {
  const codegen::Robot& arm = truth.robot();
  const auto seed = settings.seed * 101 + static_cast<std::uint64_t>(draw);
  const PriorError error;
  const codegen::Model prior(DrawPrior(arm, error, seed), settings.records);
  const int joints = truth.joints(), samples = clean.samples();
  const VectorXd z = SetParameters(truth);
  Tracked run;
  run.t = clean.s.t;
  run.beta.resize(samples, joints), run.found.resize(samples, joints);
  VectorXd sigma(joints);
  for (int j = 0; j < joints; ++j) {
    const double beta = z[PlaceOf(truth, "Fv" + std::to_string(j + 1))];
    for (int k = 0; k < samples; ++k) run.beta(k, j) = beta * GrowthAt(profile, run.t[k]);
    sigma[j] = arm.joint[static_cast<std::size_t>(j)].torque_noise_Nm;
  }
  calibration::Dataset log = clean;
  log.tau += Noise(samples, sigma, seed + 50);
  calibration::Problem problem = WithPrior(prior, {&log}, RelativeDeviation(error));
  problem.stop = settings.stop;
  if (mu > 0) problem.forgetting = mu;
  const Attempt attempt = Try(method, problem);
  run.found.setConstant(std::nan(""));
  if (attempt.solution && attempt.solution->path.rows() == samples)
    for (int j = 0; j < joints; ++j)
      run.found.col(j) = attempt.solution->path.col(PlaceOf(truth, "Fv" + std::to_string(j + 1)));
  return run;
}

std::vector<double> List(const VectorXd& v) { return {v.begin(), v.end()}; }

report::Plot PlotOf(const std::string& title, const std::vector<std::pair<std::string, const Tracked*>>& runs) {
  report::Plot plot;
  plot.text = {title, "time / s", "viscous friction of joint 3 / N m s/rad", 760, 300};
  const MatrixXd& beta = runs.front().second->beta;
  const std::vector<double> t = List(runs.front().second->t);
  plot.series.push_back({"set", t, List(beta.col(kShownJoint))});
  for (const auto& [name, run] : runs) plot.series.push_back({name, t, List(run->found.col(kShownJoint))});
  // Filters without a prior start far away. The picture leaves that out, to show how they follow.
  for (std::size_t k = 1; k < plot.series.size(); ++k)
    for (double& v : plot.series[k].y)
      if (v < 0.5 * plot.series[0].y[0] || v > 2.2 * plot.series[0].y[0]) v = std::nan("");
  return plot;
}

}  // namespace

void ShowTracking(const Settings& settings, const Motions& motions, Evidence& evidence, Findings& out) {
  Sheet sheet{"figure 4",
              "relative RMS error of beta from 5 s on, mean over joints; 30 s, noise of Table 7",
              {"method", "mu"},
              {},
              {"\"Follows\" means at most 5 %: level A if it follows the slope, B if it follows the step alone, C if "
               "neither. The survey names these levels and gives no number.",
               "The plant is the truth; its betas rise in steps of half a second.",
               "All mu are shown: the best is known only afterwards. Forgetting on standard parameters divides P by mu "
               "in directions that no torque sees, for ever: small mu diverge while the arm moves, larger ones at "
               "rest."}};
  for (const Profile& p : kProfiles) sheet.columns.emplace_back(p.name);
  constexpr int kFilterCount = std::size(kFilters), kProfileCount = std::size(kProfiles);
  std::vector<Tracked> runs(kFilterCount * kProfileCount * kTracks);
  const auto place = [](int filter, int profile, int draw) {
    return static_cast<std::size_t>((filter * kProfileCount + profile) * kTracks + draw);
  };
  const codegen::Model truth(
      Variant(settings.robot, Law::kCoulombViscous, Bodies::kStandard, SetStribeck(settings.robot.joints())),
      settings.records);
  std::vector<calibration::Dataset> clean(kProfileCount);
  ForEachDraw(settings, "figure 4, runs of the plant", kProfileCount,
              [&](int p) { clean[static_cast<std::size_t>(p)] = Run(settings, motions, truth, kProfiles[p]); });
  ForEachDraw(settings, "figure 4", static_cast<int>(runs.size()), [&](int k) {
    const int f = k / (kProfileCount * kTracks), p = k / kTracks % kProfileCount;
    runs[static_cast<std::size_t>(k)] =
        Track(settings, truth, clean[static_cast<std::size_t>(p)], calibration::FindMethod(kFilters[f].method),
              kFilters[f].mu, kProfiles[p], k % kTracks);
  });
  std::map<std::pair<std::string, std::string>, Tracked> shown;  // (profile, filter) -> the first draw
  for (int k = 0; k < kFilterCount; ++k) {
    const Filter& f = kFilters[k];
    std::vector<Cell> row{calibration::FindMethod(f.method).title, f.mu > 0 ? Cell(f.mu) : Cell("-")};
    std::map<std::string, double> mean;  // by profile
    for (int p = 0; p < kProfileCount; ++p) {
      std::vector<double> errors;
      for (int d = 0; d < kTracks; ++d) {
        const Tracked& run = runs[place(k, p, d)];
        if (run.beta.size() > 0)
          errors.push_back(FollowError(run.beta, run.found, run.t[1] - run.t[0], settings.levels.settle_s));
      }
      shown[{kProfiles[p].name, f.method + (f.mu > 0 ? " " + std::to_string(f.mu).substr(0, 5) : "")}] =
          std::move(runs[place(k, p, 0)]);
      const bool diverged = std::any_of(errors.begin(), errors.end(), [](double e) { return !std::isfinite(e); });
      const Statistic s = Summarise(errors);
      row.push_back(diverged ? Cell("diverged") : Cell(s.mean, s.low, s.high));
      mean[kProfiles[p].name] = diverged || errors.empty() ? std::numeric_limits<double>::infinity() : s.mean;
    }
    sheet.rows.push_back(row);
    const auto known = evidence.follow_slope.find(f.method);
    if (known == evidence.follow_slope.end() || mean["slope"] < known->second)
      evidence.follow_slope[f.method] = mean["slope"], evidence.follow_step[f.method] = mean["step"];
  }
  out.sheets.push_back(sheet);
  Picture picture{
      "4", "following a changing viscous friction", "Joint 3; (a), (b) slope, (c), (d) second-order change.", {}, ""};
  for (const char* profile : {"slope", "second order"}) {
    std::vector<std::pair<std::string, const Tracked*>> kalman, forgetting;
    for (const auto& [key, run] : shown) {
      if (key.first != profile || run.beta.size() == 0) continue;
      if (key.second == "kalman") kalman.insert(kalman.begin(), {"(19)", &run});
      if (key.second == "forgetting 0.995" || key.second == "forgetting 0.998")
        forgetting.emplace_back("(23), mu " + key.second.substr(11), &run);
      if (key.second == "multiple_model")
        kalman.emplace_back("bank of three", &run), forgetting.emplace_back("bank of three", &run);
    }
    if (!kalman.empty()) picture.plots.push_back(PlotOf(std::string("Kalman filter, ") + profile, kalman));
    if (!forgetting.empty())
      picture.plots.push_back(PlotOf(std::string("exponential forgetting, ") + profile, forgetting));
  }
  out.pictures.push_back(std::move(picture));
}

}  // namespace armcal::survey
