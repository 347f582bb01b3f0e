// methods - solves the linear part for a given eta, for all joints or for one that changed.
#include "host_sim/identify/methods/projection.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "codegen/src/generator/derivative.hpp"
#include "host_sim/identify/methods/shared_steps.hpp"

namespace armcal::calibration {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

MatrixXd Gram(const MatrixXd& A) {
  MatrixXd H = MatrixXd::Zero(A.cols(), A.cols());
  H.selfadjointView<Eigen::Lower>().rankUpdate(A.transpose());
  return H.selfadjointView<Eigen::Lower>();
}

VectorXd RowWeights(const Problem& problem, const Rows& rows) {
  VectorXd weight(rows.tau.size());
  for (Eigen::Index r = 0; r < weight.size(); ++r) weight[r] = 1 / problem.sigma_Nm[rows.joint[r]];
  return weight;
}

}  // namespace

Projection::Projection(const Problem& problem) : problem_(problem), columns_(problem.model->columns()) {
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

Projection::Whole Projection::At(const VectorXd& at) const {
  Whole w;
  w.z = at;
  w.z.head(columns_) = problem_.start.head(columns_);
  w.rows = StackRows(problem_, w.z);
  w.weight = RowWeights(problem_, w.rows);
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

std::vector<double> Projection::Swapped(const Whole& whole, const VectorXd& trial) const {
  std::vector<double> cost;
  const std::vector<MatrixXd> columns = OwnColumns(whole, trial);
  for (std::size_t g = 0; g < group_.size(); ++g) {
    const Group& group = group_[g];
    VectorXd z = whole.z;
    for (const int c : group.eta) z[c] = trial[c];
    cost.push_back(group.joint < 0 ? Evaluate(z, nullptr, nullptr) : OfColumns(whole, g, columns[g], z));
  }
  return cost;
}

double Projection::OfColumns(const Whole& whole, std::size_t g, const MatrixXd& columns, const VectorXd& z,
                             Solved* solved) const {
  const Group& group = group_[g];
  const std::vector<Eigen::Index>& own = whole.own[g];
  const VectorXd weight = whole.weight(own), before = whole.target(own);
  const MatrixXd A = whole.A(own, Eigen::all), L = L_(group.column, Eigen::all);
  const MatrixXd change = weight.asDiagonal() * (columns - whole.rows.K(own, group.column));
  const VectorXd after = before - change * problem_.start(group.column);
  const MatrixXd half = (A.transpose() * change) * L;
  const MatrixXd H = whole.H + half + half.transpose() + L.transpose() * (change.transpose() * change) * L;
  const VectorXd right = whole.right + A.transpose() * (after - before) + L.transpose() * (change.transpose() * after);
  const double square = whole.target.squaredNorm() - before.squaredNorm() + after.squaredNorm();
  const VectorXd w = H.llt().solve(right);
  if (solved) *solved = {H, w};
  return 0.5 * (square - right.dot(w)) + EtaCost(z);
}

double Projection::EtaCost(const VectorXd& z) const {
  double cost = 0;
  for (const int c : eta_) cost += 0.5 * EtaPrior(c) * Deviation(c, z[c]) * Deviation(c, z[c]);
  return cost;
}

double Projection::Evaluate(VectorXd& z, VectorXd* gradient, MatrixXd* hessian) const {
  z.head(columns_) = problem_.start.head(columns_);
  const Rows rows = StackRows(problem_, z);
  const VectorXd weight = RowWeights(problem_, rows);
  const MatrixXd A = Scaled(rows.K, weight);
  const VectorXd target = weight.cwiseProduct(rows.tau - rows.K * z.head(columns_));
  MatrixXd H = Gram(A);
  // Without a prior, a tiny one keeps directions that no row sees where they are.
  H.diagonal().array() += problem_.covariance.size() > 0 ? 1.0 : 1e-12 * H.diagonal().maxCoeff();
  const Eigen::LLT<MatrixXd> factor(H);
  const VectorXd w = factor.solve(VectorXd(A.transpose() * target));
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

VectorXd Projection::Moved(const VectorXd& z, const VectorXd& step) const {
  VectorXd out = z;
  for (std::size_t i = 0; i < eta_.size(); ++i) {
    double& value = out[eta_[i]];
    const double d = step[static_cast<Eigen::Index>(i)];
    value = logarithmic(eta_[i]) ? value * std::exp(std::clamp(d, -2.0, 2.0)) : value + d;
  }
  ClampEta(problem_, out);
  return out;
}

// Of each group: the columns that its eta changes, in the rows of its joint.
std::vector<MatrixXd> Projection::OwnColumns(const Whole& whole, const VectorXd& z) const {
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
MatrixXd Projection::Scaled(const MatrixXd& K, const VectorXd& weight) const {
  if (problem_.covariance.size() > 0) return weight.asDiagonal() * (K * L_.topRows(columns_));
  MatrixXd A(K.rows(), L_.cols());
  for (std::size_t i = 0; i < linear_.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    A.col(k) = L_(linear_[i], k) * weight.cwiseProduct(K.col(linear_[i]));
  }
  return A;
}

void Projection::MakeGroups() {
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
double Projection::EtaPrior(int c) const {
  if (problem_.covariance.size() == 0 || problem_.covariance(c, c) <= 0) return 0;
  const double variance = problem_.covariance(c, c);
  return 1 / (logarithmic(c) ? variance / (problem_.start[c] * problem_.start[c]) : variance);
}
double Projection::Deviation(int c, double value) const {
  return logarithmic(c) ? std::log(value / problem_.start[c]) : value - problem_.start[c];
}

}  // namespace armcal::calibration
