// methods - fits Fourier series to periodic logs, and filters and decimates rows (Table 10).
#include "host_sim/identify/methods/prefilter.hpp"
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/logs/butterworth.hpp"
#include "host_sim/identify/methods/method_list.hpp"
#include "host_sim/identify/methods/shared_steps.hpp"

namespace armcal::calibration {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// Columns 1, sin h w t, cos h w t ... and their derivatives of the given order.
MatrixXd Series(const VectorXd& t, double period_s, int harmonics, int order) {
  MatrixXd F(t.size(), 2 * harmonics + 1);
  F.col(0).setConstant(order == 0);
  for (int h = 1; h <= harmonics; ++h) {
    const double w = 2 * std::numbers::pi * h / period_s;
    // d/dt turns (sin, cos) by a quarter and multiplies by w.
    const Eigen::ArrayXd x = w * (t.array() - t[0]) + 0.5 * std::numbers::pi * order;
    F.col(2 * h - 1) = std::pow(w, order) * x.sin();
    F.col(2 * h) = std::pow(w, order) * x.cos();
  }
  return F;
}

MatrixXd Coefficients(const Dataset& log, double period_s, int harmonics) {
  if (log.samples() < 2 * (2 * harmonics + 1))
    throw io::InputError(log.source + ": expected at least " + std::to_string(2 * (2 * harmonics + 1)) +
                         " samples for " + std::to_string(harmonics) + " harmonics");
  const double length = log.s.t[log.samples() - 1] - log.s.t[0], step = length / (log.samples() - 1);
  if (!(period_s > 0) || period_s > length + 1.5 * step)
    throw io::InputError(log.source + ": expected a whole period of the motion in the log");
  return Series(log.s.t, period_s, harmonics, 0).householderQr().solve(log.s.q);
}

}  // namespace

Dataset FourierFit(const codegen::Model& model, const Dataset& log, double period_s, int harmonics) {
  const MatrixXd c = Coefficients(log, period_s, harmonics);
  Dataset out = log;
  out.s.q = Series(log.s.t, period_s, harmonics, 0) * c;
  out.s.qd = Series(log.s.t, period_s, harmonics, 1) * c;
  out.s.qdd = Series(log.s.t, period_s, harmonics, 2) * c;
  for (int j = 0; j < log.joints(); ++j)
    for (int k = 0; k < log.samples(); ++k) {
      out.moving(k, j) = std::abs(out.s.qd(k, j)) > model.robot().joint[j].v_min_radps;
      out.used(k, j) = log.used(k, j) && out.moving(k, j);
    }
  return out;
}

VectorXd FourierResidual(const Dataset& log, double period_s, int harmonics) {
  const MatrixXd c = Coefficients(log, period_s, harmonics);
  return (log.s.q - Series(log.s.t, period_s, harmonics, 0) * c).colwise().norm() / std::sqrt(log.samples());
}

double FindPeriod_s(const Dataset& log, int harmonics) {
  const double length = (log.s.t[log.samples() - 1] - log.s.t[0]) * log.samples() / (log.samples() - 1);
  double best = length, least = INFINITY;
  for (int k = 1; k <= std::max(1, static_cast<int>(length)); ++k) {
    const double now = FourierResidual(log, length / k, harmonics).squaredNorm();
    if (now < least) least = now, best = length / k;
  }
  return best;
}

Solution FourierFitted(const Problem& problem) {
  const double began = CpuSeconds();
  std::vector<Dataset> fitted;
  std::string remark;
  for (const Dataset* log : problem.train) {
    const double period_s = FindPeriod_s(*log);
    char what[120];
    std::snprintf(what, sizeof(what), "%speriod %.4g s leaves %.2g of q (worst joint, RMS)", remark.empty() ? "" : "; ",
                  period_s, FourierResidual(*log, period_s).maxCoeff());
    remark += what;
    fitted.push_back(FourierFit(*problem.model, *log, period_s));
  }
  const bool prior = problem.covariance.size() > 0;
  Solution s = Solve(prior ? FindMethod("map_barrier") : LeastSquaresFor(*problem.model), Along(problem, fitted));
  s.remark = remark + (s.remark.empty() ? "" : "; " + s.remark);
  s.seconds = CpuSeconds() - began;
  return s;
}

namespace {

constexpr int kDecimatedSteps = 15;

// All rows of one log at z, used or not: a filter needs its neighbours.
std::vector<MatrixXd> AllRows(const Problem& problem, const Dataset& log, const VectorXd& z) {
  const codegen::Model& model = *problem.model;
  const int columns = model.columns(), unknowns = model.nonlinear();
  const std::span<const double> p(z.data(), static_cast<std::size_t>(columns));
  const std::span<const double> eta(z.data() + columns, static_cast<std::size_t>(unknowns));
  std::vector<MatrixXd> K, J, all;
  model.Regressor(log.s, p, eta, K);
  if (unknowns > 0) model.Jacobian(log.s, p, p, eta, J);
  for (int j = 0; j < model.joints(); ++j) {
    all.emplace_back(log.samples(), columns + unknowns + 1);
    all[j].leftCols(columns) = K[j];
    if (unknowns > 0) all[j].middleCols(columns, unknowns) = J[j];
    all[j].col(columns + unknowns) = log.tau.col(j) - K[j] * z.head(columns);
  }
  return all;
}

}  // namespace

Linearised FilteredRows(const Problem& problem, const VectorXd& z, const Decimation& decimation) {
  std::vector<VectorXd> kept;
  Linearised out;
  for (const Dataset* log : problem.train) {
    const int samples = log->samples();
    const double rate = log->rate_Hz();
    const double cutoff = std::min(decimation.cutoff_Hz, 0.4 * rate);
    const int every = decimation.every > 0 ? decimation.every : std::max(1, static_cast<int>(rate / (2 * cutoff)));
    const int reach = static_cast<int>(std::ceil(rate / (2 * cutoff)));
    std::vector<MatrixXd> all = AllRows(problem, *log, z);
    for (int j = 0; j < log->joints(); ++j) {
      for (Eigen::Index c = 0; c < all[j].cols(); ++c)
        if (!all[j].col(c).isZero(0)) all[j].col(c) = logs::ZeroPhaseLowPass(all[j].col(c), cutoff, rate);
      // The filter leaves of white noise its share of the band below half the sample rate.
      const double sigma = problem.sigma_Nm[j] * std::sqrt(std::min(1.0, 2 * cutoff / rate));
      for (int k = 0; k < samples; k += every) {
        const int a = std::max(0, k - reach), b = std::min(samples - 1, k + reach);
        if (log->used.col(j).segment(a, b - a + 1).minCoeff() == 0) continue;
        kept.push_back(all[j].row(k) / sigma);
        out.joint.push_back(j);
      }
    }
  }
  if (kept.empty()) throw io::InputError("no filtered row may be used: expected longer stretches of motion");
  out.A.resize(static_cast<Eigen::Index>(kept.size()), z.size());
  out.residual.resize(out.A.rows());
  for (std::size_t r = 0; r < kept.size(); ++r) {
    out.A.row(static_cast<Eigen::Index>(r)) = kept[r].head(z.size());
    out.residual[static_cast<Eigen::Index>(r)] = kept[r][z.size()];
  }
  return out;
}

Solution ParallelDecimation(const Problem& problem) {
  const double began = CpuSeconds();
  const bool linear = problem.model->nonlinear() == 0 && !problem.model->depends_on_estimate();
  Solution solution;
  VectorXd z = problem.start;
  ClampEta(problem, z);
  solution.converged = false;
  for (; solution.iterations < kDecimatedSteps && !solution.converged && !Stopped(problem); ++solution.iterations) {
    const Linearised rows = FilteredRows(problem, z);
    VectorXd next = SolveRegularised(problem, rows.A.transpose() * rows.A,
                                     rows.A.transpose() * (rows.residual + rows.A * z), &solution.covariance);
    ClampEta(problem, next);
    double change = 0;
    for (Eigen::Index c = 0; c < z.size(); ++c)
      if (solution.covariance(c, c) > 0)
        change = std::max(change, std::abs(next[c] - z[c]) / std::sqrt(solution.covariance(c, c)));
    solution.converged = linear || change < kSettled;
    z = next;
    solution.memory_bytes = 3 * static_cast<std::size_t>(rows.A.size()) * sizeof(double);
  }
  solution.z = z;
  if (!solution.converged) solution.remark = "stopped before the last step was small";
  Finish(problem, began, solution);
  return solution;
}

}  // namespace armcal::calibration
