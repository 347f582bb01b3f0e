// methods - a bank of three Kalman filters, for friction that changes during the run.
//
// The three filters (IMM, Blom and Bar-Shalom 1988) share the model. They differ in how fast viscous friction beta may
// change; their states hold beta and its slope. Only friction has process noise, bodies have none. So the variance of
// directions that no sample sees does not grow, as it does under the forgetting of (23), (24). The friction of a joint
// at rest is neither updated nor allowed to drift.
#include <algorithm>
#include <array>
#include <cmath>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/methods/method_list.hpp"
#include "host_sim/identify/methods/shared_steps.hpp"

namespace armcal::calibration {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// Per 10 ms and relative to beta: deviation of the random walk of beta, and of its slope.
struct Mode {
  double walk, slope;
};
constexpr std::array<Mode, 3> kModes = {{{2e-4, 1e-6}, {1e-3, 1e-5}, {0.03, 1e-6}}};
constexpr double kStep_s = 0.01;
constexpr double kFirstSlope = 2e-4;    // per 10 ms: 60 % in 30 s
constexpr double kCoulombShare = 0.02;  // of beta's random walk, relative to Fc
constexpr double kStay = 0.995, kLeast = 1e-4;
constexpr int kMixEvery = 10;

struct Tracked {
  int joint, column, slope;  // slope: its state; -1: the column has a random walk alone
  double size;               // what the relative deviations refer to
};

struct Filter {
  VectorXd x;
  MatrixXd P;
  double log_likelihood = 0;

  void Predict(const Mode& mode, const Tracked& t, double steps) {
    const double walk = t.slope < 0 ? kCoulombShare * mode.walk : mode.walk;
    if (t.slope >= 0) {
      x[t.column] += steps * x[t.slope];
      P.row(t.column) += steps * P.row(t.slope);
      P.col(t.column) += steps * P.col(t.slope);
      P(t.slope, t.slope) += steps * std::pow(mode.slope * t.size, 2);
    }
    P(t.column, t.column) += steps * std::pow(walk * t.size, 2);
  }
  void Update(const VectorXd& h, double tau, double sigma) {
    const VectorXd Ph = P.leftCols(h.size()) * h;
    const double variance = h.dot(Ph.head(h.size())) + sigma * sigma, innovation = tau - h.dot(x.head(h.size()));
    x += Ph * (innovation / variance);
    P.noalias() -= Ph * (Ph / variance).transpose();
    log_likelihood -= 0.5 * (innovation * innovation / variance + std::log(variance));
  }
};

using Bank = std::array<Filter, kModes.size()>;
using Weights = std::array<double, kModes.size()>;

void Reweigh(Bank& bank, Weights& weight) {
  double best = -INFINITY, sum = 0;
  for (const Filter& f : bank) best = std::max(best, f.log_likelihood);
  for (std::size_t i = 0; i < bank.size(); ++i) {
    weight[i] = std::max(kLeast, weight[i] * std::exp(bank[i].log_likelihood - best));
    bank[i].log_likelihood = 0;
    sum += weight[i];
  }
  for (double& w : weight) w /= sum;
}

// Mean and covariance of the mixture.
void Mixture(const Bank& bank, const Weights& weight, VectorXd& x, MatrixXd& P) {
  x = VectorXd::Zero(bank[0].x.size());
  for (std::size_t i = 0; i < bank.size(); ++i) x += weight[i] * bank[i].x;
  P = MatrixXd::Zero(x.size(), x.size());
  for (std::size_t i = 0; i < bank.size(); ++i) {
    const VectorXd d = bank[i].x - x;
    P += weight[i] * (bank[i].P + d * d.transpose());
  }
}

void Mix(Bank& bank, Weights& weight) {
  constexpr double kLeave = (1 - kStay) / (kModes.size() - 1);
  Bank mixed;
  Weights next{};
  for (std::size_t j = 0; j < bank.size(); ++j) {
    Weights share{};
    for (std::size_t i = 0; i < bank.size(); ++i) next[j] += share[i] = (i == j ? kStay : kLeave) * weight[i];
    for (double& s : share) s /= next[j];
    Mixture(bank, share, mixed[j].x, mixed[j].P);
  }
  bank = std::move(mixed);
  weight = next;
}

std::vector<Tracked> FindTracked(const Problem& problem) {
  const codegen::Model& model = *problem.model;
  std::vector<Tracked> tracked;
  int slope = model.columns();
  for (const int c : FreeCoordinates(problem)) {
    if (model.is_rigid(c) || model.column_joint(c) < 0) continue;
    const auto& entry = model.table()[model.table_index(c)];
    if (entry.group != 1) continue;
    const double size = std::max(std::abs(problem.start[c]), 0.1 * std::sqrt(problem.covariance(c, c)));
    const bool viscous = entry.name.rfind("Fv", 0) == 0;
    tracked.push_back({model.column_joint(c), c, viscous ? slope++ : -1, size});
  }
  return tracked;
}

}  // namespace

Solution MultipleModel(const Problem& problem) {
  const double began = CpuSeconds();
  const codegen::Model& model = *problem.model;
  if (model.nonlinear() > 0)
    throw io::InputError("method multiple_model: expected a model without nonlinear parameters");
  if (problem.covariance.size() == 0) throw io::InputError("method multiple_model: expected a prior");
  const std::vector<Tracked> tracked = FindTracked(problem);
  const int columns = model.columns();
  int states = columns;
  for (const Tracked& t : tracked) states += t.slope >= 0;
  Filter first{VectorXd::Zero(states), MatrixXd::Zero(states, states)};
  first.x.head(columns) = problem.start;
  for (const int a : FreeCoordinates(problem))
    for (const int b : FreeCoordinates(problem)) first.P(a, b) = problem.covariance(a, b);
  for (const Tracked& t : tracked)
    if (t.slope >= 0) first.P(t.slope, t.slope) = std::pow(kFirstSlope * t.size, 2);
  Bank bank;
  bank.fill(first);
  Weights weight;
  weight.fill(1.0 / kModes.size());
  const Rows rows = StackRows(problem, problem.start);
  int samples = 0;
  for (const Dataset* log : problem.train) samples += log->samples();
  Solution solution;
  solution.path.resize(samples, columns);
  std::size_t next = 0;
  int k = 0;
  VectorXd h(columns);
  for (std::size_t l = 0; l < problem.train.size() && !Stopped(problem); ++l) {
    const Dataset& log = *problem.train[l];
    for (int s = 0; s < log.samples(); ++s, ++k) {
      const double steps = s > 0 && log.s.t.size() ? std::clamp((log.s.t[s] - log.s.t[s - 1]) / kStep_s, 0.0, 10.0) : 0;
      for (const Tracked& t : tracked)
        if (log.used(s, t.joint))
          for (std::size_t i = 0; i < bank.size(); ++i) bank[i].Predict(kModes[i], t, steps);
      for (; next < rows.joint.size() && rows.log[next] == static_cast<int>(l) && rows.sample[next] == s; ++next) {
        const auto r = static_cast<Eigen::Index>(next);
        h = rows.K.row(r);
        for (Filter& f : bank) f.Update(h, rows.tau[r], problem.sigma_Nm[rows.joint[next]]);
      }
      Reweigh(bank, weight);
      if ((k + 1) % kMixEvery == 0) Mix(bank, weight);
      solution.path.row(k).setZero();
      for (std::size_t i = 0; i < bank.size(); ++i)
        solution.path.row(k) += weight[i] * bank[i].x.head(columns).transpose();
    }
    if (problem.progress) problem.progress(static_cast<double>(k) / samples, 0);
  }
  solution.path.conservativeResize(k, columns);
  solution.iterations = k;
  VectorXd x;
  MatrixXd P;
  Mixture(bank, weight, x, P);
  solution.z = x.head(columns);
  solution.covariance = 0.5 * (P + P.transpose()).topLeftCorner(columns, columns);
  solution.converged = x.allFinite();
  if (!solution.converged) solution.remark = "diverged";
  solution.memory_bytes =
      bank.size() * 2 * static_cast<std::size_t>(states) * static_cast<std::size_t>(states) * sizeof(double);
  Finish(problem, began, solution);
  return solution;
}

}  // namespace armcal::calibration
