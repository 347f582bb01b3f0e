// methods - nonlinear laws (13): only eta is searched, and the linear part is solved inside.
//
// Golub and Pereyra 1973 with Kaufman's simplification: F(eta) = min_p |tau - K(eta) p|^2 + prior. Its Gauss-Newton
// Hessian is the Schur complement of p in the Hessian of all. Where the range of eta is positive, its logarithm is
// searched. Some values of each eta are tried first, because exp(-(v / q_s)^2) has no slope where q_s is far off. That
// is where (21) fails.
#include <Eigen/Cholesky>
#include <cmath>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/methods/method_list.hpp"
#include "host_sim/identify/methods/shared_steps.hpp"

namespace armcal::calibration {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kValuesTried = 5;  // values tried of each eta
constexpr int kProjectionSteps = 30;
constexpr double kSettledCost = 1e-6;  // decrease of the cost, in units of chi^2 / 2

class Projection {
 public:
  explicit Projection(const Problem& problem) : problem_(problem), columns_(problem.model->columns()) {
    for (const int c : FreeCoordinates(problem)) (c < columns_ ? linear_ : eta_).push_back(c);
    // p = start + L w: the prior of p is |w|^2 / 2, also where it is singular.
    if (problem.covariance.size() > 0) {
      const MatrixXd L = PriorFactor(problem);
      MatrixXd inner = MatrixXd::Zero(L.rows(), L.cols());
      Eigen::Index kept = 0;
      for (Eigen::Index k = 0; k < L.cols(); ++k)
        if (L.col(k).head(columns_).squaredNorm() > 0) inner.col(kept++).head(columns_) = L.col(k).head(columns_);
      L_ = inner.leftCols(kept);
    } else {
      // Columns of equal size, so that the tiny prior in Evaluate acts on all alike.
      const Rows rows = StackRows(problem, problem.start);
      L_ = MatrixXd::Zero(problem.start.size(), static_cast<Eigen::Index>(linear_.size()));
      for (std::size_t i = 0; i < linear_.size(); ++i) {
        double square = 0;
        for (Eigen::Index r = 0; r < rows.tau.size(); ++r)
          square += std::pow(rows.K(r, linear_[i]) / problem.sigma_Nm[rows.joint[r]], 2);
        L_(linear_[i], static_cast<Eigen::Index>(i)) = square > 0 ? 1 / std::sqrt(square) : 1;
      }
    }
  }

  const std::vector<int>& eta() const { return eta_; }
  bool logarithmic(int c) const { return problem_.lower[c] > 0; }

  // F at the eta in z; z's linear part becomes the best one. Gradient and Hessian in the search coordinates of eta.
  double Evaluate(VectorXd& z, VectorXd* gradient, MatrixXd* hessian) const {
    z.head(columns_) = problem_.start.head(columns_);
    const Rows rows = StackRows(problem_, z);
    VectorXd weight(rows.tau.size());
    for (Eigen::Index r = 0; r < weight.size(); ++r) weight[r] = 1 / problem_.sigma_Nm[rows.joint[r]];
    const MatrixXd A = weight.asDiagonal() * (rows.K * L_.topRows(columns_));
    const VectorXd target = weight.cwiseProduct(rows.tau - rows.K * z.head(columns_));
    MatrixXd H = A.transpose() * A;
    // Without a prior, a tiny one keeps directions that no row sees where they are.
    H.diagonal().array() += problem_.covariance.size() > 0 ? 1.0 : 1e-12 * H.diagonal().maxCoeff();
    const Eigen::LLT<MatrixXd> factor(H);
    const VectorXd w = factor.solve(A.transpose() * target);
    z += L_ * w;
    const VectorXd residual = target - A * w;
    double cost = 0.5 * residual.squaredNorm();
    if (problem_.covariance.size() > 0) cost += 0.5 * w.squaredNorm();
    for (const int c : eta_) cost += 0.5 * EtaPrior(c) * Deviation(c, z[c]) * Deviation(c, z[c]);
    if (!gradient) return cost;
    const MatrixXd all = StackJacobian(problem_, z, rows);
    MatrixXd J(all.rows(), static_cast<Eigen::Index>(eta_.size()));
    for (std::size_t i = 0; i < eta_.size(); ++i)
      J.col(static_cast<Eigen::Index>(i)) =
          weight.cwiseProduct(all.col(eta_[i] - columns_)) * (logarithmic(eta_[i]) ? z[eta_[i]] : 1.0);
    const MatrixXd cross = A.transpose() * J;
    *gradient = -J.transpose() * residual;
    *hessian = J.transpose() * J - cross.transpose() * factor.solve(cross);
    for (std::size_t i = 0; i < eta_.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      (*gradient)[k] += EtaPrior(eta_[i]) * Deviation(eta_[i], z[eta_[i]]);
      (*hessian)(k, k) += EtaPrior(eta_[i]);
    }
    return cost;
  }

  // Eta moved by a step in search coordinates, kept in its range.
  VectorXd Moved(const VectorXd& z, const VectorXd& step) const {
    VectorXd out = z;
    for (std::size_t i = 0; i < eta_.size(); ++i) {
      double& value = out[eta_[i]];
      const double d = step[static_cast<Eigen::Index>(i)];
      value = logarithmic(eta_[i]) ? value * std::exp(std::clamp(d, -2.0, 2.0)) : value + d;
    }
    ClampEta(problem_, out);
    return out;
  }

 private:
  // Information of eta's prior, and its deviation from the mean, in search coordinates.
  double EtaPrior(int c) const {
    if (problem_.covariance.size() == 0 || problem_.covariance(c, c) <= 0) return 0;
    const double variance = problem_.covariance(c, c);
    return 1 / (logarithmic(c) ? variance / (problem_.start[c] * problem_.start[c]) : variance);
  }
  double Deviation(int c, double value) const {
    return logarithmic(c) ? std::log(value / problem_.start[c]) : value - problem_.start[c];
  }

  const Problem& problem_;
  int columns_;
  std::vector<int> linear_, eta_;
  MatrixXd L_;
};

// The best of some values of each eta in turn, the others held.
void Profile(const Problem& problem, const Projection& fit, VectorXd& z, double& cost) {
  for (const int c : fit.eta())
    for (int k = 0; k < kValuesTried && !Stopped(problem); ++k) {
      VectorXd trial = z;
      const double share = (k + 0.5) / kValuesTried;
      trial[c] = fit.logarithmic(c) ? problem.lower[c] * std::pow(problem.upper[c] / problem.lower[c], share)
                                    : problem.lower[c] + share * (problem.upper[c] - problem.lower[c]);
      if (const double now = fit.Evaluate(trial, nullptr, nullptr); now < cost) cost = now, z = trial;
    }
}

}  // namespace

Solution VariableProjection(const Problem& problem) {
  const double began = CpuSeconds();
  if (problem.model->nonlinear() == 0)
    throw io::InputError("method variable_projection: the model is linear; expected one with nonlinear parameters");
  const Projection fit(problem);
  Solution solution;
  VectorXd z = problem.start, gradient;
  MatrixXd hessian;
  ClampEta(problem, z);
  double cost = fit.Evaluate(z, nullptr, nullptr), damping = 1e-3;
  Profile(problem, fit, z, cost);
  solution.converged = false;
  for (; solution.iterations < kProjectionSteps && !solution.converged && !Stopped(problem); ++solution.iterations) {
    fit.Evaluate(z, &gradient, &hessian);
    solution.converged = true;
    for (int attempt = 0; attempt < 10; ++attempt) {
      MatrixXd damped = hessian;
      damped.diagonal() = damped.diagonal() * (1 + damping) + VectorXd::Constant(damped.rows(), 1e-12);
      VectorXd trial = fit.Moved(z, -damped.ldlt().solve(gradient));
      const double now = fit.Evaluate(trial, nullptr, nullptr);
      if (now < cost) {
        solution.converged = cost - now < kSettledCost * (1 + cost);
        cost = now, z = trial, damping = std::max(1e-9, damping / 10);
        break;
      }
      damping = std::max(1e-6, damping * 10);
    }
    if (problem.progress) problem.progress(static_cast<double>(solution.iterations + 1) / kProjectionSteps, cost);
  }
  solution.z = z;
  const Linearised here = Linearise(problem, z);
  const MatrixXd gram = here.A.transpose() * here.A;
  SolveRegularised(problem, gram, here.A.transpose() * here.residual, &solution.covariance);
  solution.memory_bytes = 3 * static_cast<std::size_t>(here.A.size()) * sizeof(double);
  if (!solution.converged) solution.remark = "stopped before the last step was small";
  Finish(problem, began, solution);
  return solution;
}

}  // namespace armcal::calibration
