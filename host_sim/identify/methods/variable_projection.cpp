// methods - nonlinear laws (13): only eta is searched, and the linear part is solved inside.
//
// A grid over each joint's eta is tried first, because exp(-(v / q_s)^2) has no slope where q_s is far off, and because
// (5) and (6) have several minima. That is where (21) fails. The search then starts from the best point of each joint's
// grid, and once more from its other minima; a joint keeps the better end.
#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/methods/method_list.hpp"
#include "host_sim/identify/methods/profile_interval.hpp"
#include "host_sim/identify/methods/projection.hpp"
#include "host_sim/identify/methods/shared_steps.hpp"

namespace armcal::calibration {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kValuesTried[] = {16, 9, 5};  // of each eta, where a joint has one, two or more of them
constexpr int kOtherStarts = 4, kRounds = 3;
constexpr double kWorthATry = 400;  // chi^2 / 2 above the best, up to which a grid's other minimum is a start
constexpr int kProjectionSteps = 30, kProbeSteps = 6;
constexpr double kSettledCost = 1e-6;  // decrease of the cost, in units of chi^2 / 2

// The grid of a group with d etas has side^d points; point k, digit i says which value eta i has.
int Side(std::size_t etas) { return kValuesTried[std::min<std::size_t>(etas, std::size(kValuesTried)) - 1]; }
int Points(std::size_t etas) {
  int points = 1;
  for (std::size_t i = 0; i < std::min<std::size_t>(etas, 3); ++i) points *= Side(etas);
  return points;
}

// Each group's eta at point k of its grid; groups with fewer points, and etas past the third, stay as they are.
VectorXd OnGrid(const Problem& problem, const Projection& fit, VectorXd z, int k) {
  for (const Projection::Group& group : fit.groups()) {
    const int side = Side(group.eta.size());
    if (k >= Points(group.eta.size())) continue;
    int left = k;
    for (std::size_t i = 0; i < std::min<std::size_t>(group.eta.size(), 3); ++i, left /= side) {
      const int c = group.eta[i];
      const double share = (left % side + 0.5) / side;
      z[c] = fit.logarithmic(c) ? problem.lower[c] * std::pow(problem.upper[c] / problem.lower[c], share)
                                : problem.lower[c] + share * (problem.upper[c] - problem.lower[c]);
    }
  }
  return z;
}

// Points of a group's grid: for the first eta, each value whose best point is lower than that of the values beside it.
// The lowest comes first.
std::vector<int> Minima(const std::vector<double>& cost, std::size_t etas) {
  const int side = Side(etas), points = Points(etas);
  std::vector<int> best(static_cast<std::size_t>(side), -1), out;
  const auto at = [&](int k) { return cost[static_cast<std::size_t>(k)]; };
  for (int k = 0; k < points; ++k) {
    int& b = best[static_cast<std::size_t>(k % side)];
    if (b < 0 || at(k) < at(b)) b = k;
  }
  for (int v = 0; v < side; ++v) {
    const auto of = [&](int value) { return at(best[static_cast<std::size_t>(value)]); };
    if ((v == 0 || of(v) <= of(v - 1)) && (v + 1 == side || of(v) <= of(v + 1)))
      out.push_back(best[static_cast<std::size_t>(v)]);
  }
  std::sort(out.begin(), out.end(), [&](int a, int b) { return at(a) < at(b); });
  return out;
}

// Starts of the search, the best first: each group at its grid's best point or, in later starts, at another minimum.
std::vector<VectorXd> Starts(const Problem& problem, const Projection& fit, const VectorXd& z) {
  const Projection::Whole whole = fit.At(z);
  int points = 0;
  for (const Projection::Group& group : fit.groups()) points = std::max(points, Points(group.eta.size()));
  std::vector<std::vector<double>> cost(fit.groups().size());
  for (int k = 0; k < points && !Stopped(problem); ++k) {
    const std::vector<double> here = fit.Swapped(whole, OnGrid(problem, fit, z, k));
    for (std::size_t g = 0; g < cost.size(); ++g)
      if (k < Points(fit.groups()[g].eta.size())) cost[g].push_back(here[g]);
  }
  if (Stopped(problem)) return {z};
  const std::vector<double> now = fit.Swapped(whole, z);
  std::vector<VectorXd> starts{z};
  for (std::size_t g = 0; g < cost.size(); ++g) {
    const std::vector<int>& eta = fit.groups()[g].eta;
    const std::vector<int> minima = Minima(cost[g], eta.size());
    const auto put = [&](VectorXd& at, int k) {
      const VectorXd grid = OnGrid(problem, fit, z, k);
      for (const int c : eta) at[c] = grid[c];
    };
    const double best = std::min(now[g], cost[g][static_cast<std::size_t>(minima[0])]);
    if (best < now[g])
      for (VectorXd& start : starts) put(start, minima[0]);
    for (std::size_t m = 1; m < minima.size() && m <= kOtherStarts; ++m) {
      if (cost[g][static_cast<std::size_t>(minima[m])] > best + kWorthATry) break;
      while (starts.size() <= m) starts.push_back(starts[0]);
      put(starts[m], minima[m]);
    }
  }
  return starts;
}

// Gauss and Newton's steps, damped after Levenberg and Marquardt, from z. Returns whether the last step was small.
bool Descend(const Problem& problem, const Projection& fit, int steps, VectorXd& z, double& cost, int& iterations) {
  VectorXd gradient;
  MatrixXd hessian;
  bool converged = false;
  cost = fit.Evaluate(z, nullptr, nullptr);
  double damping = 1e-3;
  for (int k = 0; k < steps && !converged && !Stopped(problem); ++k, ++iterations) {
    fit.Evaluate(z, &gradient, &hessian);
    converged = true;
    for (int attempt = 0; attempt < 10; ++attempt) {
      MatrixXd damped = hessian;
      damped.diagonal() = damped.diagonal() * (1 + damping) + VectorXd::Constant(damped.rows(), 1e-12);
      VectorXd trial = fit.Moved(z, -damped.ldlt().solve(gradient));
      const double now = fit.Evaluate(trial, nullptr, nullptr);
      if (now < cost) {
        converged = cost - now < kSettledCost * (1 + cost);
        cost = now, z = trial, damping = std::max(1e-9, damping / 10);
        break;
      }
      damping = std::max(1e-6, damping * 10);
    }
    if (problem.progress) problem.progress(static_cast<double>(k + 1) / steps, cost);
  }
  return converged;
}

// Groups whose eta of `other` is better take it.
bool TakeBetter(const Projection& fit, const VectorXd& other, VectorXd& z, double cost) {
  const std::vector<double> swapped = fit.Swapped(fit.At(z), other);
  bool taken = false;
  for (std::size_t g = 0; g < swapped.size(); ++g)
    if (swapped[g] < cost - kSettledCost * (1 + cost)) {
      for (const int c : fit.groups()[g].eta) z[c] = other[c];
      taken = true;
    }
  return taken;
}

}  // namespace

Solution VariableProjection(const Problem& problem) {
  const double began = CpuSeconds();
  if (problem.model->nonlinear() == 0)
    throw io::InputError("method variable_projection: the model is linear; expected one with nonlinear parameters");
  const Projection fit(problem);
  Solution solution;
  VectorXd z = problem.start;
  ClampEta(problem, z);
  double cost = fit.Evaluate(z, nullptr, nullptr);
  // A grid is laid with the other joints as they are, so it is laid again once they are found.
  bool better = true;
  for (int round = 0; round < kRounds && better && !Stopped(problem); ++round) {
    better = round == 0;
    const std::vector<VectorXd> starts = Starts(problem, fit, z);
    for (std::size_t s = 0; s < starts.size() && !Stopped(problem); ++s) {
      if (round > 0 && starts[s] == z) continue;
      VectorXd other = starts[s];
      double reached = 0;
      if (s > 0) {
        Descend(problem, fit, kProbeSteps, other, reached, solution.iterations);
        VectorXd mixed = z;
        if (TakeBetter(fit, other, mixed, cost)) other = mixed;
        else if (reached >= cost) continue;
      }
      const bool converged = Descend(problem, fit, kProjectionSteps, other, reached, solution.iterations);
      if (reached > cost) continue;
      better = better || reached < cost - kSettledCost * (1 + cost);
      z = other, cost = reached, solution.converged = converged;
    }
  }
  // The scan for intervals may find a lower minimum.
  for (int round = 0; round < kRounds; ++round) {
    solution.z = z;
    const Linearised here = Linearise(problem, z);
    const MatrixXd gram = here.A.transpose() * here.A;
    SolveRegularised(problem, gram, here.A.transpose() * here.residual, &solution.covariance);
    solution.memory_bytes = 3 * static_cast<std::size_t>(here.A.size()) * sizeof(double);
    if (!problem.intervals) break;
    VectorXd lower;
    solution.interval = ProfileIntervals(fit, z, solution.covariance, lower);
    if (lower == z) break;
    solution.interval.resize(0, 0);
    if (Stopped(problem)) break;
    solution.converged = Descend(problem, fit, kProjectionSteps, lower, cost, solution.iterations);
    z = lower;
  }
  if (!solution.converged) solution.remark = "stopped before the last step was small";
  Finish(problem, began, solution);
  return solution;
}

}  // namespace armcal::calibration
