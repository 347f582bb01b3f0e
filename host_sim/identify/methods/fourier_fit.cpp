// methods - least-squares Fourier series of a periodic log; knows no method.
#include "host_sim/identify/methods/fourier_fit.hpp"

#include <Eigen/QR>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/methods/better_methods.hpp"
#include "host_sim/identify/methods/linearised.hpp"

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
  const bool prior = problem.covariance.size() > 0, nonlinear = problem.model->nonlinear() > 0;
  Solution s = Solve(FindMethod(prior       ? "map_barrier"
                                : nonlinear ? "variable_projection"
                                            : "weighted_pseudo_inverse"),
                     Along(problem, fitted));
  s.remark = remark + (s.remark.empty() ? "" : "; " + s.remark);
  s.seconds = CpuSeconds() - began;
  return s;
}

}  // namespace armcal::calibration
