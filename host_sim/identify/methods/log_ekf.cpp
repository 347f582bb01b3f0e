// methods - the iterated extended Kalman filter, (21), with positive parameters as logarithms.
//
// As (21), with three changes. It starts from the prior, whose covariance comes from the CAD table. R is the variance
// of the torque. The amplitudes of nonlinear effects (Fs - Fc) and their positive eta (q_s) are filtered as logarithms,
// cut to their range. So q_s can neither change its sign nor grow until exp(-(v / q_s)^2) is constant, which is how the
// survey's filter fails.
//
// The first rows are linearised far from the truth, and a filter never looks at them again. So it passes over the log
// again, from the same prior, with every row linearised at the end of the pass before. Each further pass is one step of
// Gauss and Newton towards the most likely parameters; one that does not get nearer is not kept. The path is that of
// the first pass, which knows only what is past.
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

constexpr int kRelinearised = 2;       // of a sample in the first pass
constexpr int kPasses = 6;             // over the log at most
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

// What one pass over the log ends with.
struct Passed {
  VectorXd state;
  MatrixXd P;
  int samples = 0;
  bool diverged = false;
};

class LogFilter {
 public:
  LogFilter(const Problem& problem, const Coordinates& at)
      : problem_(problem),
        model_(*problem.model),
        at_(at),
        effects_(model_),
        rows_(StackRows(problem, problem.start)),
        row_(MatrixXd::Zero(model_.joints(), model_.columns())),
        slope_(MatrixXd::Zero(model_.joints(), model_.nonlinear())) {}

  // about: where each row is linearised; null: where the filter is. path: filled in, one row a sample; may be null.
  Passed Pass(const VectorXd* about, MatrixXd* path) {
    Passed now{at_.start.cwiseMax(at_.lower).cwiseMin(at_.upper), at_.covariance};
    std::size_t next = 0;  // row
    for (std::size_t l = 0; l < problem_.train.size(); ++l) {
      const Dataset& log = *problem_.train[l];
      for (int s = 0; s < log.samples(); ++s, ++now.samples) {
        const std::size_t first = next;
        while (next < rows_.joint.size() && rows_.log[next] == static_cast<int>(l) && rows_.sample[next] == s) ++next;
        if (next > first && !Update(log, s, first, next, about, now)) {
          now.diverged = true;
          return now;
        }
        if (path) path->row(now.samples) = at_.Z(now.state);
      }
      if (Stopped(problem_)) break;
    }
    return now;
  }

  // What the logs and the prior say against a state, chi^2.
  double Cost(const VectorXd& state) const {
    const VectorXd off = state - at_.start;
    return Linearise(problem_, at_.Z(state)).residual.squaredNorm() +
           off.dot(at_.covariance.completeOrthogonalDecomposition().solve(off));
  }

 private:
  // Rows first .. next - 1 of one sample. Returns whether the state is finite; if not, it stays as it was.
  bool Update(const Dataset& log, int s, std::size_t first, std::size_t next, const VectorXd* about, Passed& now) {
    const int columns = model_.columns();
    const auto m = static_cast<Eigen::Index>(next - first);
    const VectorXd q = log.s.q.row(s), qd = log.s.qd.row(s), qdd = log.s.qdd.row(s);
    const VectorXd temp = log.s.temp.cols() == log.joints() ? VectorXd(log.s.temp.row(s)) : VectorXd();
    VectorXd state = now.state;
    H_.resize(m, now.state.size());
    MatrixXd PH;
    Eigen::LDLT<MatrixXd> S;
    for (int pass = 0; pass < (about ? 1 : kRelinearised); ++pass) {
      const VectorXd& here = about ? *about : state;
      const VectorXd z = at_.Z(here), dz = at_.Slope(z);
      effects_.Set(log.s.t.size() ? log.s.t[s] : 0, q, qd, qdd, temp, z);
      effects_.Columns(row_);
      if (model_.nonlinear()) effects_.Slope(slope_);
      VectorXd innovation(m);
      for (Eigen::Index i = 0; i < m; ++i) {
        const auto r = static_cast<Eigen::Index>(first) + i;
        const int j = rows_.joint[first + static_cast<std::size_t>(i)];
        H_.row(i).head(columns) = row_.row(j);
        H_.row(i).segment(model_.front(), model_.rigid()) = rows_.K.row(r).segment(model_.front(), model_.rigid());
        H_.row(i).tail(model_.nonlinear()) = slope_.row(j);
        innovation[i] = rows_.tau[r] - H_.row(i).head(columns).dot(z.head(columns));
      }
      H_ = H_ * dz.asDiagonal();
      innovation -= H_ * (now.state - here);
      PH = now.P * H_.transpose();
      MatrixXd spread = H_ * PH;
      for (Eigen::Index i = 0; i < m; ++i)
        spread(i, i) += std::pow(problem_.sigma_Nm[rows_.joint[first + static_cast<std::size_t>(i)]], 2);
      S.compute(spread);
      state = (now.state + PH * S.solve(innovation)).cwiseMax(at_.lower).cwiseMin(at_.upper);
    }
    if (!state.allFinite()) return false;
    now.state = state;
    now.P -= PH * S.solve(MatrixXd(PH.transpose()));
    now.P = (0.5 * (now.P + now.P.transpose())).eval();
    return true;
  }

  const Problem& problem_;
  const codegen::Model& model_;
  const Coordinates& at_;
  EffectPoint effects_;
  Rows rows_;
  MatrixXd row_, slope_, H_;
};

}  // namespace

Solution LogEkf(const Problem& problem) {
  const double began = CpuSeconds();
  if (problem.covariance.size() == 0) throw io::InputError("method log_ekf: expected a prior");
  const Coordinates at(problem);
  const auto size = static_cast<std::size_t>(problem.start.size());
  int samples = 0;
  for (const Dataset* log : problem.train) samples += log->samples();
  Solution solution;
  solution.path.resize(samples, problem.start.size());
  LogFilter filter(problem, at);
  Passed best = filter.Pass(nullptr, &solution.path);
  solution.path.conservativeResize(best.samples, Eigen::NoChange);
  solution.iterations = best.samples;
  if (best.diverged) {
    solution.remark = "diverged at sample " + std::to_string(best.samples);
    solution.converged = false;
    solution.z = at.Z(best.state);
    Finish(problem, began, solution);
    return solution;
  }
  double cost = filter.Cost(best.state);
  for (int pass = 1; pass < kPasses && !Stopped(problem); ++pass) {
    if (problem.progress) problem.progress(static_cast<double>(pass) / kPasses, cost);
    Passed next = filter.Pass(&best.state, nullptr);
    if (next.diverged || Stopped(problem)) break;
    const double now = filter.Cost(next.state);
    if (!(now < cost)) break;
    const VectorXd moved = (next.state - best.state).cwiseAbs(), sd = next.P.diagonal().cwiseMax(0).cwiseSqrt();
    best = std::move(next), cost = now;
    if ((moved.array() <= kSettled * sd.array()).all()) break;
  }
  if (at.guessed)
    solution.remark = "no prior mean for an amplitude: may have settled elsewhere, compare with variable_projection";
  solution.z = at.Z(best.state);
  const VectorXd dz = at.Slope(solution.z);
  solution.covariance = dz.asDiagonal() * best.P * dz.asDiagonal();
  solution.memory_bytes = size * (size + static_cast<std::size_t>(problem.model->joints())) * 2 * sizeof(double);
  Finish(problem, began, solution);
  return solution;
}

}  // namespace armcal::calibration
