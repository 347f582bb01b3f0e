// survey - draws what is believed before any data, and loops over the draws.
#include "host_sim/study/survey/draws.hpp"
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <mutex>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/calibration/prior.hpp"
#include "host_sim/identify/search/parallel.hpp"
#include "host_sim/machine/plant/joint_effects.hpp"
#include "host_sim/machine/plant/random.hpp"
#include "host_sim/study/survey/platform.hpp"

namespace armcal::survey {

using Eigen::VectorXd;

namespace {

double Factor(const PriorError& error, plant::Random& random) {
  const double u = random.Uniform(-1, 1);
  return 1 + error.width * (error.kind == PriorError::kWorst ? std::copysign(1.0, u) : u);
}

bool CanExist(const codegen::Link& link) {
  Eigen::VectorXd centre(10), body = Eigen::VectorXd::Zero(11);
  centre[0] = link.mass_kg;
  for (int k = 0; k < 3; ++k) centre[1 + k] = link.center_m[k];
  for (int k = 0; k < 6; ++k) centre[4 + k] = link.inertia_kgm2[k];
  body.head(10) = calibration::ToOrigin(centre);
  return calibration::IsPhysical(body);
}

codegen::Link DrawLink(const codegen::Link& truth, const PriorError& error, plant::Random& random) {
  codegen::Link link = truth;
  link.mass_kg *= Factor(error, random);
  for (double& c : link.center_m) c *= Factor(error, random);
  for (double& I : link.inertia_kgm2) I *= Factor(error, random);
  return link;
}

}  // namespace

std::string PriorName(const PriorError& error) {
  char text[40];
  std::snprintf(text, sizeof text, "%s +-%.0f %%", error.kind == PriorError::kWorst ? "worst case" : "uniform",
                100 * error.width);
  return text;
}

double RelativeDeviation(const PriorError& error) {
  return error.kind == PriorError::kWorst ? error.width : error.width / std::sqrt(3.0);
}

codegen::Robot DrawPrior(const codegen::Robot& truth, const PriorError& error, std::uint64_t seed) {
  constexpr int kTries = 10000;
  plant::Random random(seed);
  codegen::Robot robot = truth;
  for (codegen::Joint& joint : robot.joint) {
    const codegen::Link link = joint.link;
    int tries = 0;
    do {
      if (++tries > kTries)
        throw io::InputError(robot.path + ": link of " + joint.name + ": expected a body that can exist");
      joint.link = DrawLink(link, error, random);
    } while (!CanExist(joint.link));
    for (auto& [name, value] : joint.nominal) value *= Factor(error, random);
  }
  for (codegen::EffectUse& use : robot.effect) {
    for (auto& [name, value] : use.mean) value *= Factor(error, random);
    for (auto& [name, value] : use.nonlinear) value *= Factor(error, random);
  }
  robot.link_relative_sd = robot.friction_relative_sd = RelativeDeviation(error);
  robot.center_floor_m = robot.inertia_floor_ratio = 0;
  return robot;
}

codegen::Catalogue WithoutProcessNoise(codegen::Catalogue records) {
  for (auto& [name, record] : records)
    for (codegen::LinearParameter& parameter : record.linear) parameter.process_noise = 0;
  return records;
}

Stribeck DrawStribeck(int joints, std::uint64_t seed) {
  plant::Random random(seed);
  Stribeck s = SetStribeck(joints);
  for (int j = 0; j < joints; ++j) {
    s.fs_over_fc[j] = random.Uniform(1.1, 1.5);
    s.qs_radps[j] = std::exp(random.Uniform(std::log(0.05), std::log(0.2)));
  }
  return s;
}

Stribeck BelievedStribeck(int joints) {
  Stribeck s = SetStribeck(joints);
  s.fs_over_fc.setConstant(1.25);
  return s;
}

namespace {

constexpr double kSurveyStart = 1;  // qs in rad/s at which the survey's own filters start; the survey does not print it
// Standard deviations of DrawStribeck's draws, relative to what is believed before.
constexpr double kLogSpeed = 0.4, kBreakaway = 0.46;
constexpr double kSurveyExponent = 2;       // of (4)
constexpr int kTruths = 20;                 // drawn at most; further draws of CAD values and noise use them again
constexpr std::uint64_t kStride = 1000003;  // between the seeds of one run and the next

std::uint64_t SeedOf(std::uint64_t seed, int draw, int purpose) {
  return seed * kStride + static_cast<std::uint64_t>(draw) * 16 + static_cast<std::uint64_t>(purpose);
}

// The survey's recursions use no CAD values; they have a start of their own.
bool KnowsNothing(const std::string& method) { return method == "extended_kalman" || method == "forgetting"; }

calibration::Problem ProblemFor(const std::string& method, const codegen::Model& prior, const calibration::Dataset& log,
                                const DrawSettings& draws, const VectorXd& sigma) {
  calibration::Problem p = WithPrior(prior, {&log}, RelativeDeviation(draws.prior));
  p.sigma_Nm = sigma;
  p.seed = draws.seed;
  if (draws.random_truth)  // as wide as the draw: Fs / Fc in 1.1 .. 1.5 and qs in 0.05 .. 0.2 rad/s
    for (int i = 0; i < p.start.size(); ++i) {
      const bool eta = i >= prior.columns();
      if (!eta && (prior.is_rigid(i) || prior.table()[prior.table_index(i)].effect != "stribeck")) continue;
      p.covariance(i, i) = std::pow((eta ? kLogSpeed : kBreakaway) * p.start[i], 2);
      p.lower[i] = 0.3 * p.start[i], p.upper[i] = 3 * p.start[i];
    }
  if (KnowsNothing(method))
    for (int k = 0; k < prior.nonlinear(); ++k) {
      const int i = prior.columns() + k;
      p.start[i] = kSurveyStart;
      p.lower[i] = 1e-3, p.upper[i] = 1e3;
    }
  return p;
}

double Growth(double without, double with) { return (with - without) / without; }

// Of one method on one draw; [0] without noise, [1] with.
struct Solved {
  std::optional<Score> score[2];
  calibration::Solution solution[2];
  int failed = 0;
  std::string why;
};

Solved SolveBoth(const Settings& settings, const DrawSettings& draws, const Truth& truth, const codegen::Model& prior,
                 const calibration::Dataset& clean, const calibration::Dataset& noisy,
                 const calibration::Method& method) {
  Solved out;
  const VectorXd bodies = calibration::BodyMean(prior);
  for (int with_noise = 0; with_noise < 2; ++with_noise) {
    const calibration::Dataset& log = with_noise ? noisy : clean;
    const VectorXd sigma = truth.sigma_Nm * (with_noise ? 1 : draws.clean_sigma);
    calibration::Problem problem = ProblemFor(method.name, prior, log, draws, sigma);
    problem.stop = settings.stop;
    Attempt attempt = Try(method, problem);
    if (!attempt.solution) {
      out.why = attempt.why;
      return out;
    }
    if (!attempt.solution->z.allFinite()) {
      ++out.failed;
      out.why = attempt.solution->remark;
      continue;
    }
    out.score[with_noise] = Judge(truth, settings.levels, log.tau, *attempt.solution, bodies);
    if (draws.random_truth) out.score[with_noise]->e_f_least = LeastFrictionError(truth, problem);
    attempt.solution->path.resize(0, 0);
    out.solution[with_noise] = *std::move(attempt.solution);
  }
  return out;
}

void Append(Solved solved, Outcome& out) {
  out.failed += solved.failed;
  if (out.why.empty()) out.why = solved.why;
  for (int with_noise = 0; with_noise < 2; ++with_noise) {
    if (!solved.score[with_noise]) continue;
    (with_noise ? out.noisy : out.clean).push_back(*solved.score[with_noise]);
    calibration::Solution& first = with_noise ? out.first_noisy : out.first;
    if (first.z.size() == 0) first = std::move(solved.solution[with_noise]);
  }
  if (!solved.score[0] || !solved.score[1]) return;
  out.delta.push_back(Growth(solved.score[0]->J_e, solved.score[1]->J_e));
  out.delta_true.push_back(Growth(solved.score[0]->J_true, solved.score[1]->J_true));
}

}  // namespace

bool Settings::Names(const std::string& table) const {
  return std::find(tables.begin(), tables.end(), table) != tables.end();
}

std::unique_ptr<Truth> MakeTruth(const Settings& settings, const Motions& motions, Law law, const Stribeck& stribeck) {
  const codegen::Robot& file = settings.robot;
  codegen::Model model(Variant(file, law, Bodies::kStandard, stribeck), settings.records);
  PlantSettings plant;
  plant.friction = plant.torque_constant = plant.noise = 0;
  for (int j = 0; law == Law::kStribeck && j < file.joints(); ++j) {
    const double excess = (stribeck.fs_over_fc[j] - 1) * file.joint[static_cast<std::size_t>(j)].nominal.at("Fc");
    const toml::table keys{{"excess_Nm", excess}, {"speed_radps", stribeck.qs_radps[j]}, {"exponent", kSurveyExponent}};
    plant.effects.push_back({"stribeck", j, plant::ReadJointEffect("stribeck", io::TomlReader(keys, "survey")), 0});
  }
  const excitation::Series& series = law == Law::kStribeck ? motions.nonlinear.series : motions.linear.series;
  calibration::Dataset train = WithoutRotors(file, model, RunPlant(file, series, plant));
  return std::make_unique<Truth>(std::move(model), std::move(train), RunExactly(file, motions.other, plant));
}

namespace {

std::unique_ptr<Truth> MakeAnalytic(const Settings& settings, const Motions& motions, Law law,
                                    const Stribeck& stribeck) {
  const excitation::Series& series = law == Law::kStribeck ? motions.nonlinear.series : motions.linear.series;
  codegen::Model model(Variant(settings.robot, law, Bodies::kStandard, stribeck), settings.records);
  return std::make_unique<Truth>(AnalyticTruth(std::move(model), Sampled(series), Sampled(motions.other)));
}

}  // namespace

Motions AlongFriction(Motions motions) {
  motions.nonlinear = motions.friction;
  return motions;
}

void ForEachDraw(const Settings& settings, const std::string& what, int count, const std::function<void(int)>& work) {
  int done = 0;
  std::mutex line;
  search::InParallel(count, 0, [&](int d) {
    if (settings.Stopped()) return;
    work(d);
    const std::lock_guard lock(line);
    settings.progress(what, static_cast<double>(++done) / count);
  });
}

std::vector<Outcome> RunDraws(const Settings& settings, const Motions& motions, const DrawSettings& draws,
                              const std::vector<std::string>& methods) {
  const int joints = settings.robot.joints();
  const std::unique_ptr<Truth> set = MakeTruth(settings, motions, draws.law, SetStribeck(joints));
  std::vector<std::unique_ptr<Truth>> truths(
      static_cast<std::size_t>(draws.random_truth ? std::min(draws.draws, kTruths) : 0));
  ForEachDraw(settings, "runs of the plant", static_cast<int>(truths.size()), [&](int d) {
    const Stribeck drawn = DrawStribeck(joints, SeedOf(draws.seed, d, 3));
    truths[static_cast<std::size_t>(d)] = draws.analytic ? MakeAnalytic(settings, motions, draws.law, drawn)
                                                         : MakeTruth(settings, motions, draws.law, drawn);
  });
  std::vector<std::vector<Solved>> solved(static_cast<std::size_t>(draws.draws));
  ForEachDraw(settings, LawName(draws.law) + ", " + PriorName(draws.prior), draws.draws, [&](int d) {
    // CAD's values of the Stribeck part are centred on the set values or, for drawn truths, on their range.
    const Stribeck believed = draws.random_truth ? BelievedStribeck(joints) : SetStribeck(joints);
    const Truth& truth = draws.random_truth ? *truths[static_cast<std::size_t>(d % kTruths)] : *set;
    const codegen::Robot cad = Variant(settings.robot, draws.law, Bodies::kStandard, believed);
    const codegen::Model prior(DrawPrior(cad, draws.prior, SeedOf(draws.seed, d, 1)), settings.records);
    const calibration::Dataset& clean = truth.train;
    const calibration::Dataset noisy = truth.Noisy(SeedOf(draws.seed, d, 2));
    for (const std::string& name : methods) {
      const calibration::Method& method = calibration::FindMethod(name);
      Solved one;
      if (!method.needs_ranges || d < draws.slow_draws)
        one = SolveBoth(settings, draws, truth, prior, clean, noisy, method);
      if (d > 0) one.solution[0] = one.solution[1] = {};  // only the first is shown
      solved[static_cast<std::size_t>(d)].push_back(std::move(one));
    }
  });
  std::vector<Outcome> out;
  for (std::size_t m = 0; m < methods.size(); ++m) {
    const calibration::Method& method = calibration::FindMethod(methods[m]);
    out.push_back({method.name, method.title, method.equation, {}, {}, {}, {}, {}, {}, 0, ""});
    for (std::vector<Solved>& of_draw : solved)
      if (m < of_draw.size()) Append(std::move(of_draw[m]), out.back());
  }
  return out;
}

}  // namespace armcal::survey
