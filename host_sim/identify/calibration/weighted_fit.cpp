// calibration - solves the normal equations in units of the prior, and estimates the weights again until they settle.
#include "host_sim/identify/calibration/weighted_fit.hpp"
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "codegen/src/io/watch.hpp"
#include "host_sim/data/logs/steps.hpp"
#include "host_sim/identify/calibration/barrier_fit.hpp"

namespace armcal::calibration {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// Share of the largest scaled eigenvalue below which a direction counts as unseen, where there is no prior at all.
constexpr double kDetermined = 1e-10;
// Share of a joint's rows that its columns leave free, below which the residual says nothing of its noise.
constexpr double kFree = 0.2;

MatrixXd Pick(const MatrixXd& m, const std::vector<int>& index) {
  MatrixXd out(index.size(), index.size());
  for (std::size_t i = 0; i < index.size(); ++i)
    for (std::size_t k = 0; k < index.size(); ++k) out(i, k) = m(index[i], index[k]);
  return out;
}

VectorXd Pick(const VectorXd& v, const std::vector<int>& index) {
  VectorXd out(index.size());
  for (std::size_t i = 0; i < index.size(); ++i) out[i] = v[index[i]];
  return out;
}

}  // namespace

VectorXd SolveWithPrior(const Information& info, const VectorXd& weight, const Prior& prior,
                        const std::vector<int>& active, MatrixXd* covariance) {
  const int size = static_cast<int>(prior.mean.size());
  MatrixXd H = MatrixXd::Zero(size, size);
  VectorXd g = VectorXd::Zero(size);
  for (std::size_t j = 0; j < info.gram.size(); ++j) {
    H += weight[j] * info.gram[j];
    g += weight[j] * (info.right[j] - info.gram[j] * prior.mean);  // in deviations from the prior mean
  }
  const MatrixXd Ha = Pick(H, active);
  const VectorXd ga = Pick(g, active);
  const int a = static_cast<int>(active.size());
  VectorXd step(a);
  MatrixXd P(a, a);
  if (prior.covariance.size() > 0) {
    // x = S z with P0 = S C S: (S H S + C^-1) z = S g. It is solved with C^(1/2), so that a singular prior does no
    // harm.
    const MatrixXd L = CovarianceRoot(Pick(prior.covariance, active));
    const MatrixXd M = L.transpose() * Ha * L + MatrixXd::Identity(a, a);
    const Eigen::LLT<MatrixXd> factor(M);
    step = L * factor.solve(VectorXd(L.transpose() * ga));
    if (covariance) P = L * factor.solve(MatrixXd(L.transpose()));
  } else {
    VectorXd scale = Ha.diagonal().cwiseSqrt();
    for (int i = 0; i < a; ++i) scale[i] = scale[i] > 0 ? 1 / scale[i] : 0;
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(MatrixXd(scale.asDiagonal() * Ha * scale.asDiagonal()));
    const double floor = kDetermined * eigen.eigenvalues()[a - 1];
    VectorXd inverse(a);
    for (int i = 0; i < a; ++i) inverse[i] = eigen.eigenvalues()[i] > floor ? 1 / eigen.eigenvalues()[i] : 0;
    const MatrixXd V = scale.asDiagonal() * eigen.eigenvectors();
    step = V * (inverse.asDiagonal() * (V.transpose() * ga));
    if (covariance) P = V * inverse.asDiagonal() * V.transpose();
  }
  VectorXd x = prior.mean;
  for (int i = 0; i < a; ++i) x[active[i]] += step[i];
  if (covariance) {
    covariance->setZero(size, size);
    for (int i = 0; i < a; ++i)
      for (int k = 0; k < a; ++k) (*covariance)(active[i], active[k]) = P(i, k);
  }
  return x;
}

double VarianceInflation(const VectorXd& residual, const Eigen::VectorXi& used) {
  const int samples = static_cast<int>(residual.size());
  double variance = 0;
  for (int k = 0; k < samples; ++k) variance += used[k] ? residual[k] * residual[k] : 0;
  if (variance <= 0) return 1;
  double factor = 1;
  for (int lag = 1; lag < std::min(200, samples / 4); ++lag) {
    io::CancellationPoint();
    double product = 0;
    for (int k = lag; k < samples; ++k) product += used[k] && used[k - lag] ? residual[k] * residual[k - lag] : 0;
    if (product <= 0) break;
    factor += 2 * product / variance;
  }
  return factor;
}

Fit WeightedFit(const codegen::Model& model, const std::vector<const Dataset*>& data, const std::vector<int>& held) {
  const int n = model.joints(), columns = model.columns();
  const Prior prior = MakePrior(model);
  Fit fit;
  for (const int c : prior.active)
    if (std::find(held.begin(), held.end(), c) == held.end()) fit.active.push_back(c);
  fit.eta = MeanUnknowns(model);
  fit.x = prior.mean;
  fit.sigma.resize(n);
  for (int j = 0; j < n; ++j) fit.sigma[j] = model.robot().joint[j].torque_noise_Nm;
  fit.inflation = VectorXd::Ones(n);
  // The first pass has no estimate at which to take the gain columns. The weights settle within three passes.
  for (fit.iterations = 1; fit.iterations <= 4; ++fit.iterations) {
    fit.information = Information(n, columns + n);
    for (const Dataset* d : data) fit.information += Accumulate(model, *d, fit.x.head(columns), fit.eta);
    // right-hand side for kappa is linear about the current estimate: measured = Y p + kappa (Y p_now)
    const VectorXd weight = fit.sigma.cwiseAbs2().cwiseInverse();
    fit.x = SolveWithPrior(fit.information, weight, prior, fit.active, &fit.covariance);
    for (int j = 0; j < n; ++j) {
      const auto own = (fit.information.gram[j].diagonal().array() > 0).count();
      const double rows = fit.information.rows[j], free = rows - static_cast<double>(own);
      if (free > kFree * rows) fit.sigma[j] = std::max(1e-12, std::sqrt(fit.information.Residual(j, fit.x) / free));
    }
  }
  fit.inflation.setZero();
  for (const Dataset* d : data) {
    const MatrixXd left = d->tau - Predict(model, *d, fit.x, fit.eta);
    for (int j = 0; j < n; ++j) {
      VectorXd own = left.col(j);
      Eigen::VectorXi used = d->used.col(j);
      if (d->averaged(j)) own = d->average[static_cast<std::size_t>(j)] * left.col(j), used.setOnes(own.size());
      fit.inflation[j] += VarianceInflation(own, used) / static_cast<double>(data.size());
    }
  }
  const VectorXd weight = (fit.sigma.cwiseAbs2().cwiseProduct(fit.inflation)).cwiseInverse();
  SolveWithPrior(fit.information, weight, prior, fit.active,
                 &fit.covariance);  // the covariance under weights that count residuals which are not white
  fit.sd = fit.covariance.diagonal().cwiseMax(0).cwiseSqrt();
  fit.prior_sd = prior.covariance.diagonal().cwiseSqrt();
  if (!prior.informative) fit.prior_sd.setConstant(std::numeric_limits<double>::infinity());
  return fit;
}

VectorXd NoiseDensity(const codegen::Model& model, const std::vector<const Dataset*>& data, const Fit& fit) {
  VectorXd square = VectorXd::Zero(model.joints()), rows = square;
  const auto limited = [&](int j) {
    return std::any_of(data.begin(), data.end(), [j](const Dataset* d) { return d->averaged(j); });
  };
  for (const Dataset* d : data) {
    const double step_s = logs::MedianStep(d->s.t) * d->per_sample;
    const VectorXd left = Rms(*d, d->tau - Predict(model, *d, fit.x, fit.eta), true);
    for (int j = 0; j < model.joints(); ++j) {
      const double own = d->moving.col(j).sum(), sd = limited(j) ? left[j] : fit.sigma[j];
      square[j] += own * sd * sd * step_s, rows[j] += own;
    }
  }
  const codegen::Robot& robot = model.robot();
  for (int j = 0; j < model.joints(); ++j)  // a joint that rests has the robot file's noise, which is that of one tick
    if (rows[j] == 0) square[j] = std::pow(robot.joint[j].torque_noise_Nm, 2) / robot.tick_rate_Hz, rows[j] = 1;
  return square.cwiseQuotient(rows).cwiseSqrt();
}

DataTerm LogsAbout(const Fit& fit, const VectorXd& x) {
  DataTerm term{0, VectorXd::Zero(x.size()), MatrixXd::Zero(x.size(), x.size())};
  for (std::size_t j = 0; j < fit.information.gram.size(); ++j) {
    const double weight = 1 / (fit.sigma[j] * fit.sigma[j] * fit.inflation[j]);
    term.hessian += weight * fit.information.gram[j];
    term.gradient -= weight * fit.information.right[j];
  }
  term.gradient += term.hessian * x;
  return term;
}

PhysicalReadOut ReadOutPhysical(const codegen::Model& model, const Fit& fit) {
  RequirePhysicalPrior(model);
  const Prior prior = MakePrior(model);
  const Eigen::Index size = prior.mean.size();
  BarrierProblem problem;
  problem.model = &model;
  problem.bodies = BodyMean(model);
  problem.bodies_sd = VectorXd::Zero(problem.bodies.size());
  for (int k = 0; k < problem.bodies.size(); ++k)
    if (model.table()[k].state == "estimated") problem.bodies_sd[k] = model.table()[k].sd;
  problem.x = prior.mean;
  problem.x_sd = VectorXd::Zero(size);
  for (const int c : fit.active) problem.x_sd[c] = std::sqrt(prior.covariance(c, c));
  problem.data = [&](const VectorXd& x, bool) { return LogsAbout(fit, x); };
  BarrierFit found = FitWithBarrier(problem);
  return {std::move(found.bodies), std::move(found.bodies_sd), std::move(found.x), found.iterations, found.converged};
}

}  // namespace armcal::calibration
