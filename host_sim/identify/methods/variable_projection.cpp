// methods - nonlinear laws (13): only eta is searched, and the linear part is solved inside.
//
// Golub and Pereyra 1973 with Kaufman's simplification: F(eta) = min_p |tau - K(eta) p|^2 + prior. Its Gauss-Newton
// Hessian is the Schur complement of p in the Hessian of all. Where the range of eta is positive, its logarithm is
// searched. A grid over each joint's eta is tried first, because exp(-(v / q_s)^2) has no slope where q_s is far off,
// and because (5) and (6) have several minima. That is where (21) fails. The search then starts from the best point of
// each joint's grid, and once more from its other minima; a joint keeps the better end.
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "codegen/src/generator/derivative.hpp"
#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/methods/method_list.hpp"
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

class Projection {
 public:
  explicit Projection(const Problem& problem) : problem_(problem), columns_(problem.model->columns()) {
    for (const int c : FreeCoordinates(problem)) (c < columns_ ? linear_ : eta_).push_back(c);
    MakeGroups();
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

  // Etas that only rows of one joint read, and the columns of these rows that read them. Each eta that several joints
  // read is a group of its own, whose joint is -1.
  struct Group {
    int joint;
    std::vector<int> eta, column;
  };
  const std::vector<Group>& groups() const { return group_; }

  // All of F at one z, by joint, from which F with another eta of one group follows at little cost.
  struct Whole {
    Rows rows;
    MatrixXd A, H;
    VectorXd z, weight, target, right;
    std::vector<std::vector<Eigen::Index>> own;  // rows of each group's joint
  };
  Whole At(const VectorXd& at) const {
    Whole w;
    w.z = at;
    w.z.head(columns_) = problem_.start.head(columns_);
    w.rows = StackRows(problem_, w.z);
    w.weight.resize(w.rows.tau.size());
    for (Eigen::Index r = 0; r < w.weight.size(); ++r) w.weight[r] = 1 / problem_.sigma_Nm[w.rows.joint[r]];
    w.A = Scaled(w.rows.K, w.weight);
    w.target = w.weight.cwiseProduct(w.rows.tau - w.rows.K * w.z.head(columns_));
    w.H = Gram(w.A);
    w.H.diagonal().array() += problem_.covariance.size() > 0 ? 1.0 : 1e-12 * w.H.diagonal().maxCoeff();
    w.right = w.A.transpose() * w.target;
    w.own.resize(group_.size());
    for (std::size_t g = 0; g < group_.size(); ++g)
      for (std::size_t r = 0; r < w.rows.joint.size(); ++r)
        if (w.rows.joint[r] == group_[g].joint) w.own[g].push_back(static_cast<Eigen::Index>(r));
    return w;
  }
  // F for each group with its eta from `trial` and all others from `whole`.
  std::vector<double> Swapped(const Whole& whole, const VectorXd& trial) const {
    std::vector<double> cost;
    const std::vector<MatrixXd> columns = OwnColumns(whole, trial);
    for (std::size_t g = 0; g < group_.size(); ++g) {
      const Group& group = group_[g];
      VectorXd z = whole.z;
      for (const int c : group.eta) z[c] = trial[c];
      if (group.joint < 0) {
        cost.push_back(Evaluate(z, nullptr, nullptr));
        continue;
      }
      const std::vector<Eigen::Index>& own = whole.own[g];
      const VectorXd weight = whole.weight(own), before = whole.target(own);
      const MatrixXd A = whole.A(own, Eigen::all), L = L_(group.column, Eigen::all);
      const MatrixXd change = weight.asDiagonal() * (columns[g] - whole.rows.K(own, group.column));
      const VectorXd after = before - change * problem_.start(group.column);
      const MatrixXd half = (A.transpose() * change) * L;
      const MatrixXd H = whole.H + half + half.transpose() + L.transpose() * (change.transpose() * change) * L;
      const VectorXd right =
          whole.right + A.transpose() * (after - before) + L.transpose() * (change.transpose() * after);
      const double square = whole.target.squaredNorm() - before.squaredNorm() + after.squaredNorm();
      cost.push_back(0.5 * (square - right.dot(H.llt().solve(right))) + EtaCost(z));
    }
    return cost;
  }
  double EtaCost(const VectorXd& z) const {
    double cost = 0;
    for (const int c : eta_) cost += 0.5 * EtaPrior(c) * Deviation(c, z[c]) * Deviation(c, z[c]);
    return cost;
  }
  bool logarithmic(int c) const { return problem_.lower[c] > 0; }

  // F at the eta in z; z's linear part becomes the best one. Gradient and Hessian in the search coordinates of eta.
  double Evaluate(VectorXd& z, VectorXd* gradient, MatrixXd* hessian) const {
    z.head(columns_) = problem_.start.head(columns_);
    const Rows rows = StackRows(problem_, z);
    VectorXd weight(rows.tau.size());
    for (Eigen::Index r = 0; r < weight.size(); ++r) weight[r] = 1 / problem_.sigma_Nm[rows.joint[r]];
    const MatrixXd A = Scaled(rows.K, weight);
    const VectorXd target = weight.cwiseProduct(rows.tau - rows.K * z.head(columns_));
    MatrixXd H = Gram(A);
    // Without a prior, a tiny one keeps directions that no row sees where they are.
    H.diagonal().array() += problem_.covariance.size() > 0 ? 1.0 : 1e-12 * H.diagonal().maxCoeff();
    const Eigen::LLT<MatrixXd> factor(H);
    const VectorXd w = factor.solve(A.transpose() * target);
    z += L_ * w;
    const VectorXd residual = target - A * w;
    double cost = 0.5 * residual.squaredNorm();
    if (problem_.covariance.size() > 0) cost += 0.5 * w.squaredNorm();
    cost += EtaCost(z);
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
  // Of each group: the columns that its eta changes, in the rows of its joint.
  std::vector<MatrixXd> OwnColumns(const Whole& whole, const VectorXd& z) const {
    const codegen::Model& model = *problem_.model;
    std::vector<MatrixXd> out(group_.size()), row;
    for (std::size_t g = 0; g < group_.size(); ++g)
      out[g].resize(static_cast<Eigen::Index>(whole.own[g].size()), static_cast<Eigen::Index>(group_[g].column.size()));
    for (std::size_t log = 0; log < problem_.train.size(); ++log) {
      model.Regressor(problem_.train[log]->s, {z.data(), static_cast<std::size_t>(columns_)},
                      {z.data() + columns_, static_cast<std::size_t>(model.nonlinear())}, row);
      for (std::size_t g = 0; g < group_.size(); ++g)
        for (std::size_t i = 0; i < whole.own[g].size(); ++i) {
          const auto r = static_cast<std::size_t>(whole.own[g][i]);
          if (whole.rows.log[r] != static_cast<int>(log)) continue;
          for (std::size_t c = 0; c < group_[g].column.size(); ++c)
            out[g](static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(c)) =
                row[static_cast<std::size_t>(group_[g].joint)](whole.rows.sample[r], group_[g].column[c]);
        }
    }
    return out;
  }
  // W K L. Without a prior L only scales columns.
  MatrixXd Scaled(const MatrixXd& K, const VectorXd& weight) const {
    if (problem_.covariance.size() > 0) return weight.asDiagonal() * (K * L_.topRows(columns_));
    MatrixXd A(K.rows(), L_.cols());
    for (std::size_t i = 0; i < linear_.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      A.col(k) = L_(linear_[i], k) * weight.cwiseProduct(K.col(linear_[i]));
    }
    return A;
  }
  static MatrixXd Gram(const MatrixXd& A) {
    MatrixXd H = MatrixXd::Zero(A.cols(), A.cols());
    H.selfadjointView<Eigen::Lower>().rankUpdate(A.transpose());
    return H.selfadjointView<Eigen::Lower>();
  }
  void MakeGroups() {
    const codegen::Model& model = *problem_.model;
    for (const int c : eta_) {
      const std::string& name = model.unknowns()[static_cast<std::size_t>(c - columns_)].name;
      int joint = -1, joints = 0;
      std::vector<int> column;
      for (int j = 0; j < model.joints(); ++j) {
        const auto before = column.size();
        for (int k = 0; k < columns_; ++k) {
          const codegen::Expr& e = model.rows()[j][k];
          if (!model.is_rigid(k) && codegen::Reads(e, e.graph()->Symbol(name))) column.push_back(k);
        }
        if (column.size() > before) joint = j, ++joints;
      }
      if (joints != 1) joint = -1;
      auto group = group_.end();
      if (joint >= 0)
        group = std::find_if(group_.begin(), group_.end(), [&](const Group& g) { return g.joint == joint; });
      if (group == group_.end()) group = group_.insert(group_.end(), Group{joint, {}, {}});
      group->eta.push_back(c);
      for (const int k : column)
        if (std::find(group->column.begin(), group->column.end(), k) == group->column.end()) group->column.push_back(k);
    }
  }

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
  std::vector<Group> group_;
  MatrixXd L_;
};

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
