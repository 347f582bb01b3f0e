// methods - least squares on filtered and decimated rows (Table 10); knows no truth.
#include "host_sim/identify/methods/parallel_decimation.hpp"

#include <algorithm>
#include <cmath>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/logs/butterworth.hpp"
#include "host_sim/identify/methods/better_methods.hpp"
#include "host_sim/identify/methods/linearised.hpp"

namespace armcal::calibration {

using Eigen::MatrixXd;
using Eigen::VectorXd;

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
    const double rate = (samples - 1) / (log->s.t[samples - 1] - log->s.t[0]);
    const double cutoff = std::min(decimation.cutoff_Hz, 0.4 * rate);
    const int every = decimation.every > 0 ? decimation.every : std::max(1, static_cast<int>(rate / (2 * cutoff)));
    const int reach = static_cast<int>(std::ceil(rate / (2 * cutoff)));
    std::vector<MatrixXd> all = AllRows(problem, *log, z);
    for (int j = 0; j < log->joints(); ++j) {
      for (Eigen::Index c = 0; c < all[j].cols(); ++c)
        if (!all[j].col(c).isZero(0)) all[j].col(c) = logs::ZeroPhaseLowPass(all[j].col(c), cutoff, rate);
      // White noise behind the filter: its share of the band below half the sample rate.
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
