// survey - computes the indices of section 5, runs methods, and judges them.
#include "host_sim/study/survey/trial.hpp"
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/calibration/prior.hpp"
#include "host_sim/identify/methods/shared_steps.hpp"
#include "host_sim/study/survey/platform.hpp"

namespace armcal::survey {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

double Std(const VectorXd& v) { return std::sqrt((v.array() - v.mean()).square().mean()); }

// Relative error of one entry. NaN counts as 1, as if nothing had been found.
double Relative(double set, double estimate) {
  const double e = std::abs(estimate - set) / std::abs(set);
  return std::isfinite(e) ? e : 1;
}

}  // namespace

BodyError CompareBodies(const VectorXd& set, const VectorXd& estimate, const Levels& levels) {
  const auto links = set.size() / 11;
  BodyError out;
  out.per_link.resize(links);
  for (Eigen::Index j = 0; j < links; ++j) {
    const VectorXd truth = calibration::ToCentre(set.segment(11 * j, 10));
    VectorXd body = estimate.segment(11 * j, 10);
    const bool massless = !(std::abs(body[0]) > levels.mass_floor_kg);
    VectorXd found = massless ? body : calibration::ToCentre(body);
    if (massless) found.segment(1, 3).setConstant(kNaN);
    out.massless += massless;
    VectorXd whole = VectorXd::Zero(11);
    whole.head(10) = body;
    out.impossible += !calibration::IsPhysical(whole);
    const double trace = truth[4] + truth[7] + truth[9];
    double sum = 0;
    int count = 0;
    for (int k = 0; k < 10; ++k) {
      const double floor = k == 0  ? levels.mass_floor_kg
                           : k < 4 ? levels.center_floor_m
                                   : levels.inertia_floor_of_trace * std::abs(trace);
      if (std::abs(truth[k]) < floor) {
        ++out.skipped;
        continue;
      }
      sum += Relative(truth[k], found[k]);
      ++count;
    }
    out.per_link[j] = count ? sum / count : 0;
  }
  out.e_d = out.per_link.mean();
  return out;
}

double FrictionError(const MatrixXd& set, const MatrixXd& estimate) {
  double sum = 0;
  for (Eigen::Index j = 0; j < set.rows(); ++j)
    for (Eigen::Index k = 0; k < set.cols(); ++k) sum += Relative(set(j, k), estimate(j, k));
  return sum / static_cast<double>(set.size());
}

TorqueError CompareTorques(const MatrixXd& error, const std::vector<double>& tau_max) {
  TorqueError out;
  const auto n = static_cast<double>(error.cols());
  for (Eigen::Index j = 0; j < error.cols(); ++j) {
    const VectorXd e = error.col(j) / tau_max[static_cast<std::size_t>(j)];
    out.mean_abs += e.cwiseAbs().mean() / n;
    out.abs_mean += std::abs(e.mean()) / n;
    out.std_signed += Std(e) / n;
    out.std_abs += Std(e.cwiseAbs()) / n;
  }
  return out;
}

double BaseError(const MatrixXd& difference, const VectorXd& sigma) {
  return std::sqrt((difference * sigma.cwiseInverse().asDiagonal()).squaredNorm() /
                   static_cast<double>(difference.size()));
}

double Coverage(const VectorXd& truth, const VectorXd& estimate, const MatrixXd& covariance) {
  if (covariance.rows() != truth.size()) return kNaN;
  int inside = 0, count = 0;
  for (Eigen::Index k = 0; k < truth.size(); ++k) {
    const double variance = covariance(k, k);
    if (!(variance > 0)) continue;
    ++count;
    inside += std::abs(estimate[k] - truth[k]) <= 1.96 * std::sqrt(variance);
  }
  return count ? static_cast<double>(inside) / count : kNaN;
}

double FollowError(const MatrixXd& truth, const MatrixXd& estimate, double step_s, double settle_s) {
  const auto from = static_cast<Eigen::Index>(std::llround(settle_s / step_s));
  const Eigen::Index rows = truth.rows() - from;
  if (rows <= 0) return kNaN;
  const MatrixXd relative = (estimate.bottomRows(rows) - truth.bottomRows(rows)).cwiseQuotient(truth.bottomRows(rows));
  return relative.array().square().colwise().mean().sqrt().mean();
}

Statistic Summarise(std::vector<double> values) {
  std::erase_if(values, [](double v) { return std::isnan(v); });
  const auto n = values.size();
  Statistic s{kNaN, kNaN, kNaN, kNaN, kNaN, static_cast<int>(n)};
  if (n == 0) return s;
  std::sort(values.begin(), values.end());
  double sum = 0, square = 0;
  for (const double v : values) sum += v;
  s.mean = sum / static_cast<double>(n);
  for (const double v : values) square += (v - s.mean) * (v - s.mean);
  s.p95 = values[std::min(n - 1, static_cast<std::size_t>(std::ceil(0.95 * static_cast<double>(n))) - 1)];
  s.largest = values.back();
  if (n < 2) return s;
  // Student's t at 97.5 %: exact for one to four degrees of freedom, then an expansion right to 1 %.
  constexpr double kExact[] = {12.706, 4.303, 3.182, 2.776};
  const double freedom = static_cast<double>(n - 1);
  const double t = n <= 5 ? kExact[n - 2] : 1.96 + 2.372 / freedom + 2.82 / (freedom * freedom);
  const double half = t * std::sqrt(square / freedom / static_cast<double>(n));
  s.low = s.mean - half, s.high = s.mean + half;
  return s;
}

Truth::Truth(codegen::Model model_of_truth, calibration::Dataset train_log, Instants other_run)
    : model(std::move(model_of_truth)),
      z(SetParameters(model)),
      bodies(calibration::BodyMean(model)),
      friction(Friction(model, z)),
      train(std::move(train_log)),
      other(std::move(other_run.s)),
      tau_other(std::move(other_run.tau)),
      sigma_Nm(model.joints()) {
  for (int j = 0; j < model.joints(); ++j) sigma_Nm[j] = model.robot().joint[j].torque_noise_Nm;
}

Truth AnalyticTruth(codegen::Model model, const codegen::Signals& train, const codegen::Signals& other) {
  const VectorXd z = SetParameters(model);
  calibration::Dataset log = Measured(train, Torque(model, train, z));
  Instants run{other, Torque(model, other, z)};
  return {std::move(model), std::move(log), std::move(run)};
}

calibration::Dataset Truth::Noisy(std::uint64_t seed) const {
  calibration::Dataset log = train;
  log.tau += Noise(train.samples(), sigma_Nm, seed);
  return log;
}

MatrixXd Truth::Judged(const MatrixXd& of_train) const {
  std::vector<Eigen::Index> rows;
  for (Eigen::Index k = 0; k < of_train.rows(); ++k)
    if (train.used.row(k).minCoeff() == 1) rows.push_back(k);
  return of_train(rows, Eigen::all);
}

double LeastFrictionError(const Truth& truth, const calibration::Problem& problem) {
  const calibration::Linearised at = calibration::Linearise(problem, truth.z);
  MatrixXd covariance;
  calibration::SolveRegularised(problem, at.A.transpose() * at.A, VectorXd::Zero(truth.z.size()), &covariance);
  // Entries of the friction matrix are sums of parameters.
  MatrixXd entries(truth.friction.size(), truth.z.size());
  for (Eigen::Index c = 0; c < truth.z.size(); ++c)
    entries.col(c) = Friction(truth.model, VectorXd::Unit(truth.z.size(), c)).reshaped();
  const VectorXd sd = (entries * covariance * entries.transpose()).diagonal().cwiseMax(0).cwiseSqrt();
  const double mean_of_normal = std::sqrt(2 / std::numbers::pi);  // of |x|, x of unit variance
  return mean_of_normal * sd.cwiseQuotient(truth.friction.reshaped().cwiseAbs()).mean();
}

Score Judge(const Truth& truth, const Levels& levels, const MatrixXd& measured, const calibration::Solution& solution,
            const VectorXd& bodies_before) {
  Score s;
  const BodyError body = CompareBodies(truth.bodies, solution.bodies, levels);
  const TorqueError train =
      CompareTorques(truth.Judged(measured - Torque(truth.model, truth.train.s, solution.z)), levels.tau_max_Nm);
  const MatrixXd difference = truth.tau_other - Torque(truth.model, truth.other, solution.z);
  const TorqueError other = CompareTorques(difference, levels.tau_max_Nm);
  s.e_d = body.e_d;
  s.e_d_link = body.per_link;
  s.massless = body.massless;
  s.e_f = FrictionError(truth.friction, Friction(truth.model, solution.z));
  s.e_T = train.abs_mean, s.e_T_std = train.std_signed;
  s.e_T_printed = train.mean_abs, s.e_T_std_printed = train.std_abs;
  s.J_e = s.e_d + s.e_f + s.e_T + s.e_T_std;
  s.J_true = s.e_d + s.e_f + other.abs_mean + other.std_signed;
  const double before = CompareBodies(truth.bodies, bodies_before, levels).e_d;
  s.e_d_over_prior = before > 0 ? s.e_d / before : std::nan("");
  s.e_base = BaseError(difference, truth.sigma_Nm);
  s.coverage = Coverage(truth.z, solution.z, solution.covariance);
  s.physical = body.impossible == 0;
  s.seconds = solution.seconds;
  s.memory_bytes = static_cast<double>(solution.memory_bytes);
  s.from_prior = solution.from_prior;
  s.remark = solution.remark;
  return s;
}

Attempt Try(const calibration::Method& method, const calibration::Problem& problem) {
  try {
    return {calibration::Solve(method, problem), ""};
  } catch (const io::InputError& e) {
    return {std::nullopt, e.what()};
  }
}

calibration::Problem WithPrior(const codegen::Model& model, std::vector<const calibration::Dataset*> train,
                               double relative_sd) {
  calibration::Problem p = calibration::MakeProblem(model, std::move(train));
  const auto narrow = [&](int i) {
    const double sd = relative_sd * std::abs(p.start[i]);
    p.covariance.row(i).setZero(), p.covariance.col(i).setZero();
    p.covariance(i, i) = sd * sd;
    p.lower[i] = std::max(p.lower[i], p.start[i] - 3 * sd);
    p.upper[i] = std::min(p.upper[i], p.start[i] + 3 * sd);
  };
  for (int c = 0; c < model.columns(); ++c)
    if (!model.is_rigid(c) && p.start[c] != 0) narrow(c);
  for (int k = 0; k < model.nonlinear(); ++k) narrow(model.columns() + k);
  return p;
}

Statistic Over(const std::vector<Score>& scores, double Score::*index) {
  std::vector<double> values;
  for (const Score& s : scores) values.push_back(s.*index);
  return Summarise(values);
}

Cell Mean(const std::vector<Score>& scores, double Score::*index) {
  const Statistic s = Over(scores, index);
  return {s.mean, s.low, s.high};
}

Cell Mean(const std::vector<double>& values) {
  const Statistic s = Summarise(values);
  return {s.mean, s.low, s.high};
}

codegen::Robot WithLaw(const codegen::Robot& file, Law law, const Stribeck& stribeck) {
  codegen::Robot robot = file;
  const codegen::Robot variant = Variant(file, law, Bodies::kBase, stribeck);
  robot.effect.insert(robot.effect.begin(), variant.effect.begin(), variant.effect.end());
  return robot;
}

}  // namespace armcal::survey
