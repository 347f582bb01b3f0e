// methods - the iterated extended Kalman filter, (21), with positive parameters as logarithms.
//
// As (21), with three changes. It starts from the prior, whose covariance comes from the CAD table. R is the variance
// of the torque. The amplitudes of nonlinear effects (Fs - Fc) and their positive eta (q_s) are filtered as logarithms,
// cut to their range. So q_s can neither change its sign nor grow until exp(-(v / q_s)^2) is constant, which is how the
// survey's filter fails.
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/methods/effect_point.hpp"
#include "host_sim/identify/methods/method_list.hpp"
#include "host_sim/identify/methods/shared_steps.hpp"

namespace armcal::calibration {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kRelinearised = 2;       // passes over one sample
constexpr double kUnknownShare = 0.1;  // of its deviation: the start of an amplitude whose mean is zero
constexpr double kWidestLog = 1.5;     // prior deviation of a logarithm: a factor of 4.5
constexpr double kReach = 4;           // prior deviations that a logarithm may move from its start

// z <-> filter state: logarithms where `log` is set.
struct Coordinates {
  std::vector<char> log;
  VectorXd start, lower, upper;  // of the state
  MatrixXd covariance;
  bool guessed = false;  // an amplitude whose mean is zero had to start somewhere

  explicit Coordinates(const Problem& problem) {
    const codegen::Model& model = *problem.model;
    const int size = static_cast<int>(problem.start.size()), columns = model.columns();
    log.assign(static_cast<std::size_t>(size), 0);
    start = problem.start;
    lower = VectorXd::Constant(size, -INFINITY), upper = -lower;
    VectorXd scale = VectorXd::Zero(size);  // 0: held
    for (const int c : FreeCoordinates(problem)) scale[c] = 1;
    covariance = problem.covariance;
    std::vector<std::string> nonlinear;
    for (int k = 0; k < model.nonlinear(); ++k)
      nonlinear.push_back(model.table()[model.parameters() - model.nonlinear() + k].effect);
    for (int c = 0; c < size; ++c) {
      const bool eta = c >= columns;
      if (!eta && model.is_rigid(c)) continue;
      if (!eta) {
        const auto& entry = model.table()[model.table_index(c)];
        if (entry.lower < 0 || std::find(nonlinear.begin(), nonlinear.end(), entry.effect) == nonlinear.end()) continue;
      } else if (problem.lower[c] <= 0) {
        continue;
      }
      if (scale[c] == 0) continue;
      const double sd = std::sqrt(covariance(c, c));
      const double mean = problem.start[c] > 0 ? problem.start[c] : kUnknownShare * sd;
      if (mean <= 0) continue;
      guessed = guessed || problem.start[c] <= 0;
      const double spread = std::min(kWidestLog, std::sqrt(std::log1p(sd * sd / (mean * mean))));
      log[c] = 1;
      start[c] = std::log(mean);
      scale[c] = sd > 0 ? spread / sd : 0;
      lower[c] = eta ? std::log(problem.lower[c]) : start[c] - kReach * kWidestLog;
      upper[c] = eta ? std::log(problem.upper[c]) : start[c] + kReach * kWidestLog;
    }
    covariance = (scale.asDiagonal() * covariance * scale.asDiagonal()).eval();
  }
  VectorXd Z(const VectorXd& state) const {
    VectorXd z = state;
    for (Eigen::Index c = 0; c < z.size(); ++c)
      if (log[c]) z[c] = std::exp(state[c]);
    return z;
  }
  VectorXd Slope(const VectorXd& z) const {  // d z / d state
    VectorXd slope = VectorXd::Ones(z.size());
    for (Eigen::Index c = 0; c < z.size(); ++c)
      if (log[c]) slope[c] = z[c];
    return slope;
  }
};

}  // namespace

Solution LogEkf(const Problem& problem) {
  const double began = CpuSeconds();
  if (problem.covariance.size() == 0) throw io::InputError("method log_ekf: expected a prior");
  const codegen::Model& model = *problem.model;
  EffectPoint effects(model);
  const Coordinates at(problem);
  const int size = static_cast<int>(problem.start.size()), columns = model.columns(), n = model.joints();
  const Rows rows = StackRows(problem, problem.start);
  int samples = 0;
  for (const Dataset* log : problem.train) samples += log->samples();
  Solution solution;
  solution.path.resize(samples, size);
  VectorXd state = at.start.cwiseMax(at.lower).cwiseMin(at.upper);
  MatrixXd P = at.covariance, H, PH;
  MatrixXd row = MatrixXd::Zero(n, columns), slope = MatrixXd::Zero(n, model.nonlinear());
  std::size_t next = 0;  // row
  int k = 0;             // sample over all logs
  for (std::size_t l = 0; l < problem.train.size(); ++l) {
    const Dataset& log = *problem.train[l];
    for (int s = 0; s < log.samples(); ++s, ++k) {
      const std::size_t first = next;
      while (next < rows.joint.size() && rows.log[next] == static_cast<int>(l) && rows.sample[next] == s) ++next;
      const auto m = static_cast<Eigen::Index>(next - first);
      if (m > 0) {
        const VectorXd q = log.s.q.row(s), qd = log.s.qd.row(s), qdd = log.s.qdd.row(s);
        const VectorXd temp = log.s.temp.cols() == n ? VectorXd(log.s.temp.row(s)) : VectorXd();
        const VectorXd predicted = state;
        H.resize(m, size);
        Eigen::LDLT<MatrixXd> S;
        for (int pass = 0; pass < kRelinearised; ++pass) {
          const VectorXd z = at.Z(state), dz = at.Slope(z);
          effects.Set(log.s.t.size() ? log.s.t[s] : 0, q, qd, qdd, temp, z);
          effects.Columns(row);
          if (model.nonlinear()) effects.Slope(slope);
          VectorXd innovation(m);
          for (Eigen::Index i = 0; i < m; ++i) {
            const auto r = static_cast<Eigen::Index>(first) + i;
            const int j = rows.joint[first + static_cast<std::size_t>(i)];
            H.row(i).head(columns) = row.row(j);
            H.row(i).segment(model.front(), model.rigid()) = rows.K.row(r).segment(model.front(), model.rigid());
            H.row(i).tail(model.nonlinear()) = slope.row(j);
            innovation[i] = rows.tau[r] - H.row(i).head(columns).dot(z.head(columns));
          }
          H = H * dz.asDiagonal();
          innovation -= H * (predicted - state);
          PH = P * H.transpose();
          MatrixXd spread = H * PH;
          for (Eigen::Index i = 0; i < m; ++i)
            spread(i, i) += std::pow(problem.sigma_Nm[rows.joint[first + static_cast<std::size_t>(i)]], 2);
          S.compute(spread);
          state = (predicted + PH * S.solve(innovation)).cwiseMax(at.lower).cwiseMin(at.upper);
        }
        P -= PH * S.solve(PH.transpose());
        P = (0.5 * (P + P.transpose())).eval();
        if (!state.allFinite()) {
          solution.remark = "diverged at sample " + std::to_string(k);
          solution.converged = false;
          solution.z = at.Z(predicted);
          solution.path.conservativeResize(k, size);
          Finish(problem, began, solution);
          return solution;
        }
      }
      solution.path.row(k) = at.Z(state);
    }
    if (problem.progress) problem.progress(static_cast<double>(k) / samples, 0);
    if (Stopped(problem)) break;
  }
  solution.path.conservativeResize(k, size);
  solution.iterations = k;
  if (at.guessed)
    solution.remark = "no prior mean for an amplitude: may have settled elsewhere, compare with variable_projection";
  solution.z = at.Z(state);
  const VectorXd dz = at.Slope(solution.z);
  solution.covariance = dz.asDiagonal() * P * dz.asDiagonal();
  solution.memory_bytes = static_cast<std::size_t>(size) * static_cast<std::size_t>(size + n) * 2 * sizeof(double);
  Finish(problem, began, solution);
  return solution;
}

}  // namespace armcal::calibration
