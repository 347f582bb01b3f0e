// methods - the survey's recursive methods: (19) Kalman, (21) extended Kalman, (23) and (24) exponential forgetting.
//
// All share one recursion. With forgetting mu it does this for each sample:
//   G = P K' (K P K' + mu I)^-1,  z += G (tau_j - prediction),  P = (I - G K) P / mu.
// mu = 1 gives (19) and (21) with R = I; mu < 1 gives (23) and (24). A linear model predicts K p. A nonlinear one
// predicts K_d p_d + f(p_f), and K = [K_d, d f / d p_f] is taken at the estimate of that sample. In (21) and (24) the
// survey prints tau_f for tau_j and P_k for P_n. P is neither made symmetric nor bounded, because the survey's is not.
//
// Start: p = 0, P = 100 I. Nonlinear parameters start at Problem::start: a Stribeck speed of zero divides by zero.
// Where their range is positive, the law sees their magnitude, as in (4), and the magnitude is the result. path holds
// every sample of every log, and NaN after a divergence. A sample without used rows only ages P.
#include <fmt/core.h>
#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <optional>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/methods/effect_point.hpp"
#include "host_sim/identify/methods/method_list.hpp"
#include "host_sim/identify/methods/shared_steps.hpp"

namespace armcal::calibration {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kGrown = 1e6;  // growth of a variance beyond its start that a reader must know of

// K and the prediction error of one sample after the other, taken at the estimate then.
class SampleRows {
 public:
  SampleRows(const Problem& problem, const std::vector<int>& free)
      : problem_(problem), model_(*problem.model), free_(free), rows_(StackRows(problem, problem.start)) {
    for (int j = 0; j < model_.joints(); ++j)
      for (int c = 0; c < model_.columns(); ++c)
        if (Varies(model_, j, c)) varying_.push_back({j, c});
    if (model_.nonlinear() > 0) {
      point_.emplace(model_);
      effects_.setZero(model_.joints(), model_.columns());
      slope_.setZero(model_.joints(), model_.nonlinear());
    }
  }

  // Rows of sample k of log l, called in order of time. K: [rows x free].
  void Take(int l, int k, const VectorXd& z, MatrixXd& K, VectorXd& error) {
    const std::size_t begin = next_;
    while (next_ < rows_.joint.size() && rows_.log[next_] == l && rows_.sample[next_] == k) ++next_;
    const auto count = static_cast<Eigen::Index>(next_ - begin), columns = static_cast<Eigen::Index>(model_.columns());
    MatrixXd whole(count, z.size());
    whole.leftCols(columns) = rows_.K.middleRows(static_cast<Eigen::Index>(begin), count);
    if (point_ && count > 0) {
      const codegen::Signals& s = problem_.train[l]->s;
      const VectorXd temp = s.temp.size() ? VectorXd(s.temp.row(k)) : VectorXd();
      point_->Set(s.t.size() ? s.t[k] : 0, s.q.row(k), s.qd.row(k), s.qdd.row(k), temp, z);
      point_->Columns(effects_);
      point_->Slope(slope_);
      for (Eigen::Index r = 0; r < count; ++r) {
        const int j = rows_.joint[begin + r];
        for (const auto& [joint, c] : varying_)
          if (joint == j) whole(r, c) = effects_(j, c);
        whole.row(r).tail(slope_.cols()) = slope_.row(j);
      }
    }
    error = rows_.tau.segment(static_cast<Eigen::Index>(begin), count) - whole.leftCols(columns) * z.head(columns);
    K.resize(count, static_cast<Eigen::Index>(free_.size()));
    for (std::size_t i = 0; i < free_.size(); ++i) K.col(static_cast<Eigen::Index>(i)) = whole.col(free_[i]);
  }

 private:
  struct Place {
    int joint, column;
  };
  const Problem& problem_;
  const codegen::Model& model_;
  const std::vector<int>& free_;
  Rows rows_;
  std::vector<Place> varying_;
  std::optional<EffectPoint> point_;
  MatrixXd effects_, slope_;
  std::size_t next_ = 0;
};

// z with the magnitude of those nonlinear parameters that only have one.
VectorXd Magnitude(const codegen::Model& model, VectorXd z) {
  for (int k = 0; k < model.nonlinear(); ++k)
    if (model.unknowns()[k].lower >= 0) z[model.columns() + k] = std::abs(z[model.columns() + k]);
  return z;
}

std::string Remark(const std::string& end, double growth) {
  if (growth < kGrown) return end;
  return fmt::format("{}{}a variance grew {:.1e} times", end, end.empty() ? "" : "; ", growth);
}

}  // namespace

Solution RunOnline(const Problem& problem, double forgetting, double start_variance) {
  const double began = CpuSeconds();
  const codegen::Model& model = *problem.model;
  const std::vector<int> free = FreeCoordinates(problem);
  const auto count = static_cast<Eigen::Index>(free.size());
  SampleRows rows(problem, free);
  VectorXd z = problem.start;
  for (const int c : free)
    if (c < model.columns()) z[c] = 0;
  MatrixXd P = start_variance * MatrixXd::Identity(count, count), K;
  VectorXd error;
  int samples = 0;
  for (const Dataset* log : problem.train) samples += log->samples();

  Solution out;
  out.path = MatrixXd::Constant(samples, z.size(), std::numeric_limits<double>::quiet_NaN());
  std::string end;
  for (int l = 0; l < static_cast<int>(problem.train.size()) && end.empty(); ++l)
    for (int k = 0; k < problem.train[l]->samples() && end.empty(); ++k) {
      const VectorXd now = Magnitude(model, z);
      rows.Take(l, k, now, K, error);
      for (Eigen::Index i = 0; i < count; ++i)
        if (z[free[i]] != now[free[i]]) K.col(i) = -K.col(i);  // d f(|eta|) / d eta
      const MatrixXd before = P;
      VectorXd step = VectorXd::Zero(count);
      if (K.rows() > 0) {
        const MatrixXd PK = P * K.transpose();
        const MatrixXd S = K * PK + forgetting * MatrixXd::Identity(K.rows(), K.rows());
        const MatrixXd G = PK * S.inverse();
        step = G * error;
        P -= G * (K * before);
      }
      P /= forgetting;
      if (!step.allFinite() || !P.allFinite()) {
        end = "diverged at sample " + std::to_string(out.iterations + 1);
        out.converged = false;
        P = before;
        break;
      }
      for (Eigen::Index i = 0; i < count; ++i) z[free[i]] += step[i];
      out.path.row(out.iterations++) = Magnitude(model, z);
      if (problem.progress && out.iterations % 100 == 0)
        problem.progress(static_cast<double>(out.iterations) / samples, error.squaredNorm());
      if (Stopped(problem)) end = "stopped at sample " + std::to_string(out.iterations), out.converged = false;
    }
  out.z = Magnitude(model, z);
  out.covariance.setZero(z.size(), z.size());
  for (Eigen::Index i = 0; i < count; ++i)
    for (Eigen::Index k = 0; k < count; ++k) out.covariance(free[i], free[k]) = P(i, k);
  out.bodies = SmallestBodies(model, out.z);
  out.memory_bytes = sizeof(double) * static_cast<std::size_t>(3 * P.size() + 10 * count * model.joints());
  out.remark = Remark(end, P.diagonal().cwiseAbs().maxCoeff() / start_variance);
  Finish(problem, began, out);
  out.from_prior = 0;
  return out;
}

// (19) as the survey prints it: zero start, P0 = 100 I, R = I.
Solution Kalman(const Problem& problem) {
  ExpectLinear(problem, "Kalman filter");
  return RunOnline(problem, 1);
}

// (21) as the survey prints it, with tau_j for its tau_f and P_n for its P_k. On a linear model it is (19).
Solution ExtendedKalman(const Problem& problem) { return RunOnline(problem, 1); }

// (23) for linear and (24) for nonlinear models, as the survey prints them.
Solution Forgetting(const Problem& problem) {
  if (!(problem.forgetting > 0 && problem.forgetting <= 1))
    throw io::InputError("exponential forgetting: expected mu of (23) in (0, 1], not " +
                         std::to_string(problem.forgetting));
  return RunOnline(problem, problem.forgetting);
}

}  // namespace armcal::calibration
